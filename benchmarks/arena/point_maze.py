"""PointMaze of Gymnasium-Robotics: a ball that is pushed in two dimensions through mazes with waypoints.

    pip install gymnasium-robotics

Waypoints are the corners of the way through the maze. The actions are two forces, not a number of choices.
"""

import gymnasium
import gymnasium_robotics
import numpy as np
from gymnasium.spaces import Dict, MultiBinary
from gymnasium_robotics.envs.maze import maps

import hierroom

gymnasium.register_envs(gymnasium_robotics)
_CORRIDOR = [[1] * 9, [1, *[0] * 7, 1], [1] * 9]
_SNAKE = [[1] * 7, [1, *[0] * 5, 1], [1] * 5 + [0, 1], [1, *[0] * 5, 1], [1, 0] + [1] * 5, [1, *[0] * 5, 1], [1] * 7]
_FORK = [[1] * 7, [1, 0, 1, 0, 1, 0, 1], [1, *[0] * 5, 1], [1, 0, 1, 0, 1, 0, 1], [1] * 7]


class Waypoints(gymnasium.Wrapper):
    """Keeps which places the ball was at, at most half a cell away; a place counts after those that it needs.

    Args:
        env: the maze.
        centres: the place of each waypoint, by name.
        needs: for each one the names of those that come before.
    """

    def __init__(self, env, centres, needs):
        super().__init__(env)
        self.centres, self.needs, self.reached = centres, needs, set()
        entries = {**env.observation_space.spaces, "reached": MultiBinary(len(centres))}
        del entries["desired_goal"]
        self.observation_space = Dict(entries)

    def _shown(self, observation):
        place = observation["achieved_goal"]
        for name, centre in self.centres.items():
            if self.needs[name] <= self.reached and np.linalg.norm(place - centre) <= 0.5:
                self.reached.add(name)
        reached = np.array([name in self.reached for name in self.centres], np.int8)
        return {name: observation[name] for name in ("observation", "achieved_goal")} | {"reached": reached}

    def reset(self, **settings):
        """Begin an episode, with nothing reached but where the ball is."""
        observation, info = self.env.reset(**settings)
        self.reached = set()
        return self._shown(observation), info

    def step(self, action):
        """Push the ball."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self._shown(observation), reward, terminated, truncated, info


def maze(cells, way, max_steps, *, is_free=False):
    """Return the task of a maze.

    Args:
        cells: the map, 1 is a wall.
        way: cells as (row, column): the start, waypoints, and the target.
        max_steps: of an episode.
        is_free: whether waypoints can be visited in any order; all of them before the target.
    """
    start, *points = way
    rows, columns = len(cells), len(cells[0])
    map_ = [list(row) for row in cells]
    map_[start[0]][start[1]], map_[points[-1][0]][points[-1][1]] = "r", "g"
    centres = {f"{row}-{col}": np.array([col + 0.5 - columns / 2, rows / 2 - row - 0.5]) for row, col in points}
    names = [*centres]
    needs = {name: set(() if is_free else names[n - 1 : n]) for n, name in enumerate(names)}
    needs |= {names[-1]: set(names[:-1] if is_free else names[-2:-1])}

    def make(render_mode=None):
        own = {"maze_map": map_, "continuing_task": True, "max_episode_steps": max_steps}
        return Waypoints(gymnasium.make("PointMaze_UMaze-v3", render_mode=render_mode, **own), centres, needs)

    return hierroom.Task(
        make,
        {name: lambda env, info, name=name: name in env.reached for name in names},
        {name: {"needs": sorted(before)} for name, before in needs.items()},
        names[-1],
        max_steps,
        vectors={name: centre / (max(rows, columns) / 2) for name, centre in centres.items()},
    )


_TO_CORNER = [(1, 1), (2, 2), (3, 3), (4, 4), (4, 6), (6, 6)]
TASKS = {
    "u_maze": maze(maps.U_MAZE, [(1, 1), (1, 3), (3, 3), (3, 1)], 300),
    "u_maze_short": maze(maps.U_MAZE, [(1, 1), (1, 3), (3, 3)], 200),
    "corridor": maze(_CORRIDOR, [(1, 1), (1, 4), (1, 7)], 300),
    "there_and_back": maze(_CORRIDOR, [(1, 4), (1, 1), (1, 7)], 500),
    "snake": maze(_SNAKE, [(1, 1), (1, 5), (3, 5), (3, 1), (5, 1), (5, 5)], 800),
    "fork_2": maze(_FORK, [(2, 3), (1, 1), (1, 5)], 600),
    "fork_4": maze(_FORK, [(2, 3), (1, 1), (3, 1), (1, 5), (3, 5)], 1000, is_free=True),
    "open": maze(maps.OPEN, [(2, 3), (1, 1), (3, 1), (3, 5)], 400, is_free=True),
    "medium": maze(maps.MEDIUM_MAZE, _TO_CORNER[:5], 600),
    "medium_long": maze(maps.MEDIUM_MAZE, _TO_CORNER, 800),
}
globals().update(TASKS)  # runs name a task like benchmarks.arena.point_maze:snake
