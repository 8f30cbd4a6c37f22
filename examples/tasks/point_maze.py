"""PointMaze of Gymnasium-Robotics, with a continuous action; waypoints on the way through the maze are the goals.

    pip install gymnasium-robotics
    cd examples/tasks
    python -m hierroom train --task point_maze:maze --meta fixed-dfs --steps 40_000

With two seeds, 43% and 46% of the last 100 episodes of training then reach the corner, and 4 of 7 evaluated ones; by
``--method ppo`` none of 68 in training, and none of 8.
"""

import functools
import itertools

import gymnasium
import gymnasium_robotics
import numpy as np

import hierroom

gymnasium.register_envs(gymnasium_robotics)
MAP = [  # the map of PointMaze_Medium; r: here the ball begins, g: this is its target
    [1, 1, 1, 1, 1, 1, 1, 1],
    [1, "r", 0, 1, 1, 0, 0, 1],
    [1, 0, 0, 1, 0, 0, 0, 1],
    [1, 1, 0, 0, 0, 1, 1, 1],
    [1, 0, 0, 1, 0, 0, 0, 1],
    [1, 0, 1, 0, 0, 1, 0, 1],
    [1, 0, 0, 0, 1, 0, "g", 1],
    [1, 1, 1, 1, 1, 1, 1, 1],
]
WAYPOINTS = {"bend": (2, 2), "gate": (3, 3), "middle": (4, 4), "east": (4, 6), "corner": (6, 6)}  # row, column


def place(cell):
    """Return x and y of a cell."""
    return np.array([cell[1] - 3.5, 3.5 - cell[0]])


def is_near(cell, env, info):
    """Return whether the ball is at most half a cell from the centre of a cell."""
    return np.linalg.norm(env.unwrapped.point_env.data.qpos[:2] - place(cell)) <= 0.5


maze = hierroom.Task(
    make=lambda render_mode=None: gymnasium.make(
        "PointMaze_Medium-v3", maze_map=MAP, continuing_task=False, max_episode_steps=600, render_mode=render_mode
    ),
    goals={name: functools.partial(is_near, cell) for name, cell in WAYPOINTS.items()},
    rules={"bend": {}} | {name: {"needs": before} for before, name in itertools.pairwise(WAYPOINTS)},
    target="corner",
    vectors={name: place(cell) / 3.5 for name, cell in WAYPOINTS.items()},
    max_steps=600,
    label="PointMaze",
)
