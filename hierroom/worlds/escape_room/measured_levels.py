"""Measures of real levels from their exact states."""

from __future__ import annotations

from collections.abc import Sequence

from hierroom.complexity.measures.mdp import DeterministicMDP
from hierroom.complexity.measures.summary import measure_mdp
from hierroom.complexity.measures.table import MeasuredGraph, with_progress
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.engine import Engine
from hierroom.worlds.escape_room.level_map import LevelMap
from hierroom.worlds.escape_room.map_arrays import map_arrays
from hierroom.worlds.escape_room.reachable import TooManyStatesError, reachable_states
from hierroom.worlds.escape_room.sampled_level import SampledLevel

MAX_LEVEL_STATES = 20_000
"""Levels with more states are measured by rollouts: the values of all states would take minutes."""
MAX_COUNTED_STATES = 1_000_000
GORP_RUNS = 100
GORP_STEPS = 2_000_000_000
"""About the most steps that GORP plays in a level measured by rollouts: half a minute."""
LEVEL_POLICIES = 20


def level_mdp(graph: GoalGraph, seed: int, drop_key: bool = False, size: int = 19) -> DeterministicMDP:
    """Return the first level of an environment with this seed as the MDP of its exact states."""
    return reachable_states(Engine([graph], size=size, drop_key=drop_key, seed=seed).state)


def measure_levels(
    graphs: Sequence[GoalGraph | LevelMap], n_levels: int, horizon: int = 1000, drop_key: bool = False, seed: int = 0
) -> list[MeasuredGraph]:
    """Measure ``n_levels`` levels of each graph or map, with seeds from ``seed`` on.

    Levels of more than `MAX_LEVEL_STATES` states have `SampledMeasures`.
    """
    if n_levels < 1:
        raise InputError(f"measure at least one level of each goal graph, not {n_levels}")

    def measure(item: tuple[GoalGraph | LevelMap, int]) -> MeasuredGraph:
        one, level = item
        fixed = {"size": one.size, "maps": map_arrays([one], one.size)} if isinstance(one, LevelMap) else {}
        graph = one.graph if isinstance(one, LevelMap) else one
        name, start = f"{one.name} {level}", Engine([graph], drop_key=drop_key, seed=level, **fixed).state
        try:
            mdp = reachable_states(start, MAX_COUNTED_STATES)
        except TooManyStatesError:
            return MeasuredGraph(name, SampledLevel(start, horizon, seed).measure(max_steps=GORP_STEPS))
        if mdp.n_states > MAX_LEVEL_STATES:
            return MeasuredGraph(name, SampledLevel(start, horizon, seed).measure(mdp.n_states, max_steps=GORP_STEPS))
        return MeasuredGraph(name, measure_mdp(mdp, horizon, n_policies=LEVEL_POLICIES, gorp_runs=GORP_RUNS, seed=seed))

    levels = [(graph, seed + i) for graph in graphs for i in range(n_levels)]
    return with_progress(measure, levels)
