"""Trials of stages, counted, and the chain of stages that they give.

With n_s trials of stage s that were left, T_s steps in it (unfinished trials included) and N_st moves to stage t,

    t_s = T_s / n_s,    P_st = N_st / n_s,    v = e_start + P' v,    E = sum_s v_s t_s,

v_s is how often natural play enters stage s on its way to the target. An episode that ends without it moves to stage 0,
so that E counts its steps, too. The first is the estimate for durations that are cut off at times which do not depend
on them. The means over trials weighted by v are those of natural play, whatever stages the trials started from.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

DONE = -1
"""In place of a stage: the target is reached."""
CUT = -2
"""In place of the next stage of a trial that did not end."""
ENOUGH = 32
"""With as many trials a stage is known well enough."""
SMALL = 0.02
"""Share of E below which a stage needs no more trials."""
LOST = 0.2
"""Largest share of visits that may lead to stages which no trial left; E is then that of all other ways."""


class Flow(NamedTuple):
    """Expectations over natural play, from the start to the target.

    Args:
        steps: E, or ``inf`` if play shows no way to the target.
        by_kind: [K + 1] the steps in which a goal of each kind is pursued, the last of no goal.
        reached: [K + 1] how often a given goal of each kind is reached.
        visits: [S] how often each stage is entered.
    """

    steps: float
    by_kind: NDArray[np.float64]
    reached: NDArray[np.float64]
    visits: NDArray[np.float64]


class Trials:
    """Counts the trials of N environments; all begin in stage 0."""

    def __init__(self, num_envs: int, n_kinds: int) -> None:
        self.numbers: dict[tuple[int, ...], int] = {(0,) * n_kinds: 0}
        self.stage, self.entered = [0] * num_envs, [num_envs]
        self._steps = np.zeros((num_envs, n_kinds + 1), np.int64)  # of the current trials
        self._reached = np.zeros((num_envs, n_kinds + 1), np.int64)
        self._rows: list[tuple[int, int, int]] = []  # environment, stage, next stage
        self._by_kind: list[NDArray[np.int64]] = []  # [2, K + 1] steps and goals reached
        self._everywhere = np.arange(num_envs)

    def number_of(self, kinds: tuple[int, ...]) -> int:
        """Return the number of a stage; a new one gets the next number."""
        if kinds not in self.numbers:
            self.numbers[kinds] = len(self.numbers)
            self.entered.append(0)
        return self.numbers[kinds]

    def tick(self, pursued: NDArray[np.integer], reached: NDArray[np.bool_]) -> None:
        """Count a step in every environment, which pursued goals of kinds [N]; ``reached`` [N] marks the given ones."""
        self._steps[self._everywhere, pursued] += 1
        if reached.any():
            envs = np.flatnonzero(reached)
            self._reached[envs, pursued[envs]] += 1

    def leave(self, env: int, stage: int) -> None:
        """End a trial, and begin one in the next stage; after `CUT` in stage 0."""
        self._rows.append((env, self.stage[env], stage))
        self._by_kind.append(np.stack([self._steps[env], self._reached[env]]))
        self.enter(env, max(stage, 0))

    def enter(self, env: int, stage: int) -> None:
        """Begin a trial in a stage, without counting what came before."""
        self.stage[env] = stage
        self.entered[stage] += 1
        self._steps[env] = self._reached[env] = 0

    def close(self) -> None:
        """Note the unfinished trials."""
        for env in self._everywhere.tolist():
            self.leave(env, CUT)

    def totals(self) -> NDArray[np.int64]:
        """Return the steps that pursued goals of each kind, and how often these were reached: [2, K + 1]."""
        return np.sum(self._by_kind, axis=0)

    def flow(self, weights: NDArray[np.float64] | None = None) -> Flow:
        """Return the expectations over natural play, after `close`; ``weights`` [N] count environments so often."""
        n = len(self.numbers)
        env, stage, after = np.array(self._rows).T
        weight = np.ones(len(env)) if weights is None else weights[env]
        counts = np.array(self._by_kind, float)  # [R, 2, K + 1]
        left = np.bincount(stage, weight * (after != CUT), n)
        spent = sp.csr_matrix((weight, (stage, np.arange(len(stage)))), shape=(n, len(stage)))
        steps, reached = spent @ counts[:, 0], spent @ counts[:, 1]
        is_known = left > 0
        moved = (after >= 0) & is_known[np.maximum(after, 0)]
        moves = sp.csr_matrix((weight[moved], (stage[moved], after[moved])), shape=(n, n))
        done = np.bincount(stage[after == DONE], weight[after == DONE], n)
        onward = np.asarray(moves.sum(axis=1)).ravel() + done
        share = np.divide(1.0, onward, out=np.zeros(n), where=onward > 0)
        visits, is_lost = _visits(sp.diags(share) @ moves, onward > 0)
        lost = float(np.divide(left - onward, left, out=np.zeros(n), where=is_known) @ visits)
        if is_lost or lost > LOST or not done.any():
            return Flow(np.inf, steps.sum(axis=0), reached.sum(axis=0), visits)
        mean = np.divide(visits, left, out=np.zeros(n), where=is_known)
        by_kind = mean @ steps
        return Flow(float(by_kind.sum()), by_kind, mean @ reached, visits)

    def needs(self) -> dict[int, float]:
        """Return how much one more trial lowers the variance of E, v t / n, for stages that few trials left.

        Durations vary about like their mean. More trials than `ENOUGH` from saved states would only prefer short ones.
        A stage that no trial has left yet counts with the steps spent in it, or with the longest of the others.
        """
        _, stage, after = np.array(self._rows or [(0, 0, CUT)]).T
        n = len(self.numbers)
        steps = np.zeros(n)
        if self._rows:
            steps += np.bincount(stage, np.array(self._by_kind)[:, 0].sum(axis=1), n)
        np.add.at(steps, self.stage, self._steps.sum(axis=1))
        left = np.bincount(stage[after != CUT], minlength=n)
        moved = after >= 0
        moves = sp.csr_matrix((np.ones(moved.sum()), (stage[moved], after[moved])), shape=(n, n))
        visits, _ = _visits(sp.diags(1 / np.maximum(left, 1)) @ moves, np.ones(n, bool))
        mean = steps / np.maximum(left, 1)
        mean[left == 0] = np.maximum(mean, mean[left > 0].max(initial=1.0))[left == 0]
        cost = visits * mean
        need = cost / np.maximum(self.entered, 1)
        is_needed = (left < ENOUGH) & (cost > SMALL * cost.sum())
        return {stage: float(need[stage]) for stage in np.flatnonzero(is_needed).tolist()}


def _visits(chances: sp.spmatrix, is_kept: NDArray[np.bool_]) -> tuple[NDArray[np.float64], bool]:
    """Solve v = e_0 + P' v; stages that lead nowhere are left out. The flag says whether there is no solution."""
    n = chances.shape[0]
    keep = sp.diags(is_kept.astype(float))
    system = (sp.identity(n) - (keep @ chances @ keep).T).tocsc()
    start = np.zeros(n)
    start[0] = 1.0
    try:
        visits = splu(system).solve(start)
    except RuntimeError:  # play never leaves a set of stages, so the matrix is singular
        return np.ones(n), True
    return (visits, False) if np.isfinite(visits).all() and (visits > -1e-9).all() else (np.ones(n), True)
