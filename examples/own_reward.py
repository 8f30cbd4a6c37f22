"""Custom rewards: shaping by the distance to the goal, and a cost for each step.

python -m hierroom train --reward own_reward:Closer
python -m hierroom train --method ppo --reward own_reward:hurry
"""

GAMMA = 0.95  # that of the learner, so that shaping does not change which policy is best (Ng, Harada & Russell, 1999)


class Closer:
    """1 where the goal is reached, and on the way there what a step changes in a potential: minus the distance."""

    ends_with_option = True  # the next goal is another task: nothing after the option is this goal's merit

    def rewards(self, step):
        """Return the rewards of the N environments [N]."""
        before = -0.02 * step.before.distances(step.goals)
        after = -0.02 * step.after.distances(step.goals) * ~step.return_terminated  # at its end the potential is zero
        return step.reached + GAMMA * after - before


def hurry(step):
    """Return 1 at the exit, and 0.001 less for each step [N]: a function of a step is a reward, too."""
    return step.extrinsic - 0.001
