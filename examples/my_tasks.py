"""Tasks of your own environments: ``python -m hierroom.train --task my_tasks:taxi --meta fixed-dfs``."""

import hierroom


def has_passenger(env, info):
    """Return whether the passenger is in the taxi."""
    return env.unwrapped.s // 4 % 5 == 4


def is_home(env, info):
    """Return whether the passenger is at the destination."""
    return env.unwrapped.s // 4 % 5 == env.unwrapped.s % 4


taxi = hierroom.Task(
    make="Taxi-v4",  # Taxi-v3 before Gymnasium 1.3
    goals={"passenger": has_passenger, "home": is_home},
    rules={"passenger": {}, "home": {"needs": "passenger"}},
    target="home",
    max_steps=200,
)


def next_goal(level):
    """Return the first legal goal that is not achieved yet: a meta-controller."""
    return next(goal for goal in level.legal_goals if not goal.achieved)


def hurry(step):
    """Return 1 at the goal, less 0.01 a step: a reward of the controller."""
    return step.reached - 0.01


hurry.ends_with_option = True  # rewards after the option belong to the next goal
