"""Measures of a level with too many states to enumerate, by rollouts from its exact states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierroom.complexity.measures.effective_horizon import horizon_of, samples_of
from hierroom.complexity.measures.policy_information import policy_information
from hierroom.complexity.measures.summary import SampledMeasures
from hierroom.complexity.played.observed import wilson_interval
from hierroom.support.errors import InputError, require_number
from hierroom.worlds.escape_room import batch_kernels
from hierroom.worlds.escape_room.layout import OUTCOME, State
from hierroom.worlds.escape_room.oracle import shortest_lengths
from hierroom.worlds.escape_room.rollout_kernels import policy_rollouts, random_rollouts


class SampledLevel:
    """Rollouts in one level, from given states to the horizon; ``steps_played`` counts random steps."""

    def __init__(self, state: State, horizon: int, seed: int = 0) -> None:
        require_number("the horizon of a level", horizon, 1, 2**31 - 1, is_whole=True)
        if len(state) != 1:
            raise InputError(f"one level is measured, but the state holds {len(state)} environments")
        self.shortest = int(shortest_lengths(state)[0])
        if self.shortest > horizon:
            raise InputError(
                f"a solution of the level needs at least {self.shortest} steps, but the horizon is {horizon}"
            )
        self.state, self.horizon = state.copy(), horizon
        levels = self.state.levels
        levels["max_steps"], levels["steps"], levels["remembers"] = horizon, 0, 0
        self.n_actions = 6 if levels["can_drop"][0] else 5
        self._rng = np.random.default_rng(seed)
        self._scratch = np.zeros(1, OUTCOME)
        self.steps_played = 0

    def random_successes(self, state: State, n_rollouts: int) -> NDArray[np.int64]:
        """Count the rollouts of the random policy that escape, [N], of ``n_rollouts`` from each of N states."""
        successes, seed = np.zeros(len(state), np.int64), self._rng.integers(2**63, dtype=np.uint64)
        self.steps_played += random_rollouts(
            state.levels, state.grids, n_rollouts, self.n_actions, seed, self._scratch, successes
        )
        return successes

    def policy_returns(self, n_policies: int, n_rollouts: int) -> NDArray[np.float64]:
        """Return the returns [policies, rollouts] of policies with independent normal preferences: 1 for an escape."""
        returns = np.zeros((n_policies, n_rollouts))
        policies = self._rng.integers(2**63, size=n_policies, dtype=np.uint64)
        seed = self._rng.integers(2**63, dtype=np.uint64)
        policy_rollouts(
            self.state.levels, self.state.grids, policies, n_rollouts, self.n_actions, seed, self._scratch, returns
        )
        return returns

    def gorp_success(self, m: int, runs: int) -> float:
        """Return the share of runs of GORP, with k = 1, that find a solution (Laidlaw et al. 2023, algorithm 1).

        At each step a run makes m rollouts of the random policy after each action, and takes the action after which
        most of them escape. It breaks ties at random.
        """
        here, solved = self.state[np.zeros(runs, int)], 0
        actions = np.arange(self.n_actions)
        while len(here):
            after = here[np.repeat(np.arange(len(here)), self.n_actions)]
            outcomes = np.zeros(len(after), OUTCOME)
            batch_kernels.step_levels(after.levels, after.grids, np.tile(actions, len(here)), outcomes)
            values = self.random_successes(after, m) + m * outcomes["terminated"]
            ranks = values.reshape(-1, self.n_actions) + self._rng.random((len(here), self.n_actions))
            chosen = np.arange(len(here)) * self.n_actions + ranks.argmax(axis=1)
            solved += int(outcomes["terminated"][chosen].sum())
            here = after[chosen[~after.levels["has_ended"][chosen]]]
        return solved / runs

    def gorp_rollouts(self, runs: int, max_steps: int) -> tuple[int | None, int]:
        """Find m_1 by doubling and bisecting, as `Gorp.rollouts` does, in about ``max_steps`` steps.

        Return m_1, or None if not found, and the largest number of rollouts that was not enough.
        """
        low, high, begun = 0, 1, self.steps_played
        while True:
            before = self.steps_played
            if self.gorp_success(high, runs) >= 0.5:
                break
            low, high = high, 2 * high
            if self.steps_played - begun + 2 * (self.steps_played - before) > max_steps:
                return None, low
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if self.gorp_success(middle, runs) >= 0.5 else (middle, high)
        return high, low

    def measure(
        self,
        states: int | None = None,
        *,
        episodes: int = 1000,
        n_policies: int = 20,
        policy_episodes: int = 100,
        gorp_runs: int = 20,
        max_steps: int = 500_000_000,
    ) -> SampledMeasures:
        """Estimate the measures; ``states`` is the number of states if known. GORP takes about ``max_steps``."""
        start = self.state[:]
        success = wilson_interval(int(self.random_successes(start, episodes)[0]) / episodes, episodes, 0.95)
        information = policy_information(self.policy_returns(n_policies, policy_episodes))
        rollouts, tried = self.gorp_rollouts(gorp_runs, max_steps)
        horizon = float("inf") if rollouts is None else horizon_of(1, rollouts, self.n_actions)
        return SampledMeasures(
            states=states,
            actions=self.n_actions,
            horizon=self.horizon,
            shortest=self.shortest,
            random_success=success.value,
            random_success_low=success.low,
            random_success_high=success.high,
            rollouts=rollouts,
            rollouts_tried=tried,
            effective_horizon=horizon,
            samples=samples_of(self.horizon, self.n_actions, horizon),
            pic=information.pic,
            poic=information.poic,
        )
