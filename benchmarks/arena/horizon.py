"""The effective horizon of the arena's tasks that are deterministic, for the verdict's comparison of measures.

    python -m benchmarks.arena.horizon     # the rows that are lacking of horizon.csv; minutes a task

As in BRIDGE (Laidlaw, Russell and Dragan, 2023) an episode is that of seed 0, and the only reward is 1 at the target.
The measure is log(T^2 A^H), with the bound on H of their theorem 5.4 and T the limit of an episode. A task with more
states than can be enumerated has an error in place of it.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Hashable
from copy import deepcopy
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium

from benchmarks.arena.families import find_families
from benchmarks.arena.predictions import add_rows
from benchmarks.measures.effective_horizon import effective_horizon
from benchmarks.measures.mdp import enumerate_env
from benchmarks.prediction.play import RESULTS
from hierroom import Task
from hierroom.support.cli import run

ROWS = RESULTS / "arena" / "horizon.csv"
MAX_STATES = 20_000
RANDOM = ("taxi_2", "taxi_2_short", "taxi_1_rain", "lake_small_slips", "cliff_2_slips")
"""Tasks whose steps are drawn at random, beside their starts."""


class AtTarget(gymnasium.Wrapper):
    """Earns 1 at the target of a task, which ends the episode; copies share what never changes."""

    def __init__(self, task: Task) -> None:
        super().__init__(task.make())
        assert task.goals is not None
        assert task.target is not None
        self.reached = task.goals[task.target]

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Act, and look whether the target is achieved."""
        observation, _, terminated, truncated, info = self.env.step(action)
        is_there = bool(self.reached(self.env, info))
        return observation, float(is_there), terminated or is_there, truncated, info

    def __deepcopy__(self, memo: dict[int, Any]) -> AtTarget:
        shared = (self.reached, getattr(self.unwrapped, "world", None), getattr(self.unwrapped, "P", None))
        memo |= {id(one): one for one in shared if one is not None}
        copied = memo[id(self)] = object.__new__(type(self))
        vars(copied).update(deepcopy(vars(self), memo))
        return copied


def _of_toy_text(env: Any) -> Hashable:
    return env.unwrapped.s, env.get_wrapper_attr("n" if env.has_wrapper_attr("n") else "homes")


def _of_hierarchycraft(env: Any) -> Hashable:
    state = env.unwrapped.state
    return tuple(array.tobytes() for array in (state.player_inventory, state.position, state.zones_inventories))


def _of_minigrid(env: Any) -> Hashable:
    level = env.unwrapped
    held = None if level.carrying is None else level.carrying.encode()
    return tuple(map(int, level.agent_pos)), int(level.agent_dir), level.grid.encode().tobytes(), held


STATES: dict[str, Callable[[Any], Hashable]] = {
    "hierarchycraft": _of_hierarchycraft,
    "minigrid_levels": _of_minigrid,
    "toy_text": _of_toy_text,
}
"""All that determines what is to come, in families whose environments can be copied."""


def measured(family: str, task: str) -> dict[str, Any]:
    """Return the measure of a task, and what it is made of."""
    one = import_module(f"{__package__}.{family}").TASKS[task]
    mdp = enumerate_env(AtTarget(one), STATES[family], max_states=MAX_STATES)
    bound = effective_horizon(mdp, one.max_steps).value
    samples = 2 * math.log(one.max_steps) + bound * math.log(mdp.n_actions)
    return {"states": mdp.n_states, "shortest": mdp.shortest_solution(), "horizon": bound, "log_samples": samples}


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", nargs="+", choices=STATES, default=[], help="by default all that are installed")
    parser.add_argument("--out", type=Path, default=ROWS)
    given = parser.parse_args()
    tasks = [
        {"family": family.name, "task": task}
        for family in find_families(given.families)
        if family.name in STATES
        for task in family.tasks()
        if task not in RANDOM
    ]
    add_rows(given.out, tasks, measured)
    return 0


if __name__ == "__main__":
    run(main)
