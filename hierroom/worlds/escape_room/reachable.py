"""All reachable states of one level, with the state after each action."""

from __future__ import annotations

import numpy as np

from hierroom.complexity.measures.mdp import DeterministicMDP
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room import batch_kernels
from hierroom.worlds.escape_room.layout import OUTCOME, State

CHUNK = 4096
"""States expanded together, which bounds the memory for their copies."""


class TooManyStatesError(InputError):
    """A level has more states than are allowed."""


def reachable_states(state: State, max_states: int = 1_000_000) -> DeterministicMDP:
    """Find all states of a level by taking every action in batches of states.

    They are numbered in the order in which they are found: first the start, last the escaped state, in which every
    action stays. The reward is 1 for the step onto the exit.

    The step count and memories do not influence the future, so they are not part of a state. If there are more than
    ``max_states``, including the escaped state, `TooManyStatesError` is raised.
    """
    if len(state) != 1:
        raise InputError(f"the states of one level are enumerated, but the state holds {len(state)} environments")
    if state.levels["has_ended"][0]:
        raise InputError("the episode of the level has ended, so that no further state can be reached")
    first = state.copy()
    first.levels["max_steps"], first.levels["remembers"] = 2**31 - 1, 0
    n_actions = 6 if first.levels["can_drop"][0] else 5
    numbers = dict.fromkeys(_keys(first.levels), 0)
    transitions, rewards, frontier = [], [], [first]
    while frontier:
        here = frontier.pop(0)
        after = here[np.repeat(np.arange(len(here)), n_actions)]
        outcomes = np.zeros(len(after), OUTCOME)
        batch_kernels.step_levels(after.levels, after.grids, np.tile(np.arange(n_actions), len(here)), outcomes)
        targets, new = np.full(len(after), -1), []
        keys = _keys(after.levels)
        for i in np.flatnonzero(~outcomes["terminated"]).tolist():
            n_known = len(numbers)
            targets[i] = numbers.setdefault(keys[i], n_known)
            if targets[i] == n_known:
                new.append(i)
        if len(numbers) >= max_states:
            raise TooManyStatesError(f"the level has more than {max_states:,} states, which is the limit")
        transitions.append(targets.reshape(-1, n_actions))
        rewards.append(outcomes["reward"].reshape(-1, n_actions).copy())
        frontier += [after[new[begin : begin + CHUNK]] for begin in range(0, len(new), CHUNK)]
    escaped = len(numbers)
    table = np.concatenate([*transitions, np.full((1, n_actions), escaped)])
    return DeterministicMDP(np.where(table < 0, escaped, table), np.concatenate([*rewards, np.zeros((1, n_actions))]))


def _keys(levels: np.ndarray) -> list[bytes]:
    columns = [levels["row"], levels["col"], levels["direction"], levels["keys"], levels["doors"]]
    if levels["can_drop"][0]:
        branches = np.arange(levels["keys_at"].shape[1])
        lies = (levels["keys"][:, None] >> branches) & 1 == 0
        columns += [*np.where(lies[:, :, None], levels["keys_at"], 0).reshape(len(levels), -1).T]
        is_locked = (levels["doors"][:, None] >> levels["bag"]) & 1 == 0
        can_be_dropped = (branches < levels["bag_size"][:, None]) & is_locked
        bag = np.where(can_be_dropped, levels["bag"], -1)
        columns += [*np.take_along_axis(bag, np.argsort(~can_be_dropped, axis=1, kind="stable"), axis=1).T]
    rows = np.stack(columns, axis=1).astype(np.int8)  # a grid has at most 63 + 10 cells along a side
    return rows.view(f"V{rows.shape[1]}").ravel().tolist()
