"""Random play under the script, counted by stages: what later steps cost, measured before anybody trains.

A *stage* is how many goals of each kind were achieved in the episode. A *trial* is one stay in a stage. Where a world
can go back to a state, trials start from saved states where they teach most: splitting (Kahn and Harris, 1951). Tasks
go back by replaying actions, only while this costs little.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.episode_facts import EpisodeFacts
from hierroom.agents.player import RandomPlayer
from hierroom.lab.advise.stages import DONE, Trials
from hierroom.meta import FixedDFS, RandomGoals, take_turn
from hierroom.support.errors import InputError
from hierroom.support.kernel import compile_clock
from hierroom.turns.records import Step
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import DEFAULT_MAX_STEPS

SAVED = 32
"""States kept of each stage."""
REVIEW = 512
"""Steps between two looks at which stage is known worst."""
CHECKED = 20_000
"""Most episodes that are kept to check the rules."""
CHEAP = 0.02
"""Largest share of the steps so far that going back once may cost."""
Progress = Callable[[float], object]
Achieved = tuple[NDArray[np.integer] | None, list[tuple[int, str]]]
"""The marking of the rules at an episode's start, None for the usual; the step and name of each achieved goal."""


@dataclass
class Budget:
    """Ends play: after ``play_steps`` primitive steps if they are given, else after ``seconds``; Ctrl-C ends it too."""

    seconds: float = 30.0
    play_steps: int | None = None
    steps: int = 0
    replayed: int = 0  # of the steps, to go back to states
    is_interrupted: bool = False
    started: float = field(default_factory=lambda: time.perf_counter() - compile_clock().seconds)

    @property
    def share(self) -> float:
        """The share that is used up."""
        if self.is_interrupted:
            return 1.0
        return self.spent_seconds / self.seconds if self.play_steps is None else self.steps / self.play_steps

    @property
    def spent_seconds(self) -> float:
        """The seconds since the start, without those of compilation."""
        return time.perf_counter() - compile_clock().seconds - self.started

    def replay(self, steps: int) -> bool:
        """Return whether replaying so many steps costs little of the play so far, and all of them half; count them."""
        if is_cheap := steps <= CHEAP * self.steps and 2 * (self.replayed + steps) <= self.steps:
            self.replayed, self.steps = self.replayed + steps, self.steps + steps
        return is_cheap


@dataclass
class Episodes:
    """Hold the results of whole episodes of play.

    Attributes:
        n: episodes that began early enough to end within the play, so that short ones do not count too often.
        successes: how many of them reached the target.
        sequences: the achieved goals of each ended episode, in order.
    """

    n: int = 0
    successes: int = 0
    sequences: list[Achieved] = field(default_factory=list)


class RandomPlay:
    """Plays random actions in N environments while the script gives goals, and counts stages and episodes.

    Args:
        turns: N fresh environments with autoreset.
        seed: determines the actions, together with the environments' own seed.

    Attributes:
        is_split: whether trials may start from saved states; only episodes without it are counted.
    """

    def __init__(self, turns: Turns, seed: int, is_split: bool = False) -> None:
        n, goals = len(turns), turns.world.goals
        self.turns, self.random = turns, np.random.default_rng([seed, is_split])
        self._player = RandomPlayer(self.random)
        self.meta = RandomGoals() if turns.world.rules is None else FixedDFS()
        limit: int = getattr(turns.world, "max_steps", turns.config.max_steps or DEFAULT_MAX_STEPS)
        self.limit = min(limit, getattr(turns.world, "own_limit", None) or limit)
        self.trials = Trials(n, len(goals.kinds))
        self.episodes = Episodes()
        self.is_split, self._kind_of = is_split, np.append(goals.kind_of, len(goals.kinds))  # -1: no goal
        self._achieved = np.zeros((n, len(goals)), bool)
        self._saved: dict[int, list[dict[str, np.ndarray]]] = {}
        self._began, self._ended, self._facts = np.zeros(n, np.int64), [], EpisodeFacts(n)
        self._start: list[NDArray | None] = [*getattr(turns.world, "markings", [None] * n).copy()]
        self._needs: dict[int, float] = {}
        self._can_return = True  # to a saved state
        self._n_steps = 0

    def play(self, budget: Budget, until: float, progress: Progress = lambda share: None) -> None:
        """Play until a share of the budget is used up; Ctrl-C ends play, and keeps what was counted."""
        turns = self.turns
        n_unseen = 16 if turns.world.can_split else 1  # looking at the clock takes time, which few tasks notice
        try:
            while budget.share < until:
                for _ in range(n_unseen):
                    take_turn(self.meta, turns)
                    pursued = self._kind_of[turns.ledger.goals]
                    step = self._player.step(turns)
                    self._n_steps += 1
                    budget.steps += len(turns)
                    self._count(step, pursued, budget)
                if self.is_split and self._n_steps % REVIEW == 0:
                    self._needs = self.trials.needs()
                progress(budget.share)
        except KeyboardInterrupt:
            budget.is_interrupted = True
        if self.is_split:
            return
        counted = [success for began, success in self._ended if began <= self._n_steps - self.limit]
        self.episodes.n, self.episodes.successes = len(counted), sum(counted)

    def _count(self, step: Step, pursued: NDArray[np.integer], budget: Budget) -> None:
        self.trials.tick(pursued, step.reached)
        ended = self._facts.add(step, self.turns)
        if not (self.turns.n_ended or step.n_first.any()):
            return
        if not self.is_split:
            began = self._began[ended.rows].tolist()
            self._ended += zip(began, ended.successes.tolist(), strict=True)
            self._began[ended.rows] = self._n_steps
        names = self.turns.world.goals.milestones
        if not self.is_split and len(self.episodes.sequences) < CHECKED:
            for env, one in zip(ended.rows.tolist(), ended.milestones, strict=True):
                self.episodes.sequences.append((self._start[env], [(at, names[goal]) for at, goal in one]))
                if self._start[env] is not None:
                    self._start[env] = self.turns.world.markings[env].copy()
        self._achieved |= step.achieved
        goals, entering = self.turns.world.goals, np.flatnonzero(step.is_first | step.episode_ended).tolist()
        for env in entering:
            if not step.episode_ended[env]:
                kinds = np.bincount(goals.kind_of[self._achieved[env]], minlength=len(goals.kinds))
                self.trials.leave(env, self.trials.number_of(tuple(kinds.tolist())))
            else:
                self.trials.leave(env, DONE if step.success[env] else 0)
                self._achieved[env] = False
            self._save(self.trials.stage[env], env)
        if self.is_split and self._needs and self._can_return:
            self._jump(entering, budget)

    def _save(self, stage: int, env: int) -> None:
        saved = self._saved.setdefault(stage, [])
        place = len(saved) if len(saved) < SAVED else int(self.random.integers(self.trials.entered[stage] + 1))
        if place < SAVED:
            state = self.turns.get_state(np.array([env])) | {"achieved": self._achieved[[env]]}
            saved[place : place + 1] = [state]

    def _jump(self, envs: list[int], budget: Budget) -> None:
        """Let environments that just entered a stage begin a trial in the stage that is known worst instead."""
        worst = max(self._needs, key=self._needs.__getitem__)
        chosen = [env for env in envs if self._needs.get(self.trials.stage[env], 0.0) < 0.2 * self._needs[worst]]
        if not chosen or worst not in self._saved:
            return
        state, saved = self.turns.get_state(), self._saved[worst]
        jumps = {env: saved[int(self.random.integers(len(saved)))] for env in chosen}
        for env, start in jumps.items():
            for name, array in state.items():
                if len(array) == len(self.turns):  # not of a curriculum, which plays no part here
                    array[env] = start[name][0]
        if not budget.replay(int(np.sum(state.get("taken", 0)))):  # a task replays the actions in all environments
            return
        for env, start in jumps.items():
            self._achieved[env] = start["achieved"][0]
            self.trials.enter(env, worst)
            self._needs[worst] *= self.trials.entered[worst] / (self.trials.entered[worst] + 1)
        try:
            self.turns.set_state(state)
            is_back = not self.turns.world.get_arrays(self.turns.world.everywhere).get("cut", np.zeros(1)).any()
        except InputError:
            is_back = False
        if not is_back:  # its episodes do not repeat themselves, so all begin anew
            self._can_return, self._achieved[:] = False, False
            self.turns.reset()
            for env in range(len(self.turns)):
                self.trials.enter(env, 0)
