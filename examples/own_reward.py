"""Custom rewards: shaping by the distance to the goal, and a cost for each step.

python -m hierroom train --reward own_reward:Closer
python -m hierroom train --method ppo --reward own_reward:hurry
"""

GAMMA = 0.95  # that of the learner, so that shaping does not change which policy is best (Ng, Harada & Russell, 1999)


class Closer:
    """1 at the goal, plus the change of a potential: -0.02 times the distance to the goal."""

    ends_with_option = True  # rewards after the option belong to the next goal

    def rewards(self, step):
        """Return the rewards of the N environments [N]."""
        before = -0.02 * step.before.distances(step.goals)
        after = -0.02 * step.after.distances(step.goals) * ~step.return_terminated  # no potential where the return ends
        return step.reached + GAMMA * after - before


def hurry(step):
    """Return 1 at the exit, and 0.001 less for each step [N]: a function of a step is a reward, too."""
    return step.extrinsic - 0.001
