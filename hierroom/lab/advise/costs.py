"""Costs of goals, measured: mean random steps to each once it is pursued, and to the target, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hierroom.lab.advise.play import Achieved, Budget, Progress, RandomPlay
from hierroom.lab.advise.stages import Trials
from hierroom.support.errors import InputError
from hierroom.support.intervals import Interval, wilson_interval
from hierroom.turns.turns import Turns
from hierroom.worlds.env_config import EnvConfig

NUM_ENVS = 64
FEW_ENVS = 8
"""Of environments in Python, which are large and slow."""
LIMITED = 0.25
"""Share of the budget for episodes of the usual length, where the rest has no limit."""
UNLIMITED = 10**8
LEVEL = 0.9
RESAMPLES = 100


@dataclass(frozen=True)
class GoalCost:
    """Hold the costs of one kind of goal in random play.

    Args:
        steps: mean primitive steps until it is reached, once it is pursued; ``inf`` if it never was.
        share: its share of the expected steps to the target.
        pursued: steps of play in which it was pursued.
        reached: how often it was then reached.
    """

    steps: Interval
    share: float
    pursued: int
    reached: int


@dataclass(frozen=True)
class PlayCosts:
    """Hold the costs of random play under the script in one task.

    Args:
        goals: the cost of each kind of goal that was pursued, by name.
        expected_steps: E, mean steps to the target, see `stages`; without a limit, unless the task has its own.
        random_success: share of episodes of ``limit`` steps that reach the target, with Wilson's interval.
        episodes: how many these are.
        limit: steps of an episode.
        steps: primitive steps played.
        steps_per_second: their speed here.
        sequences: of each episode, to check rules: see `play.Achieved`.
        is_interrupted: whether Ctrl-C ended play.
    """

    goals: Mapping[str, GoalCost]
    expected_steps: Interval
    random_success: Interval
    episodes: int
    limit: int
    steps: int
    steps_per_second: float
    sequences: Sequence[Achieved] = field(default=(), repr=False)
    is_interrupted: bool = False

    @property
    def hardest(self) -> str | None:
        """The kind of goal with the largest share of the expected steps, or that was never reached; None if none."""
        return max(
            self.goals, key=lambda name: (np.isinf(self.goals[name].steps.value), self.goals[name].share), default=None
        )


def measure_costs(
    config: EnvConfig,
    seconds: float = 30.0,
    play_steps: int | None = None,
    seed: int = 0,
    progress: Progress = lambda share: None,
) -> PlayCosts:
    """Play randomly in a config's environments and return what goals cost.

    Args:
        config: the environments.
        seconds: time to play, above 0.
        play_steps: primitive steps to play in place of ``seconds``, so that equal seeds give equal answers.
        seed: of levels and actions.
        progress: called with the share of the budget that is used up.
    """
    if not 0 < seconds < 10**6:
        raise InputError(f"seconds of play must be above 0, and at most a million, not {seconds}")
    if play_steps is not None and not 0 < play_steps < 10**12:
        raise InputError(f"play_steps must be a whole number above 0, not {play_steps}")
    config = config.changed(levels="training")
    few = Turns(config, 1, seed=seed)
    is_fast, first = few.world.can_split, Budget(play_steps=1)
    try:
        if not few.world.goals.has_target:
            raise InputError(f"{few.world.variants[0]} has no target, to which goals could lead")
        RandomPlay(few, seed, is_split=True).play(first, 1.0)  # compiles the kernels, before the clock starts
    finally:
        few.world.close()
    budget = Budget(seconds, play_steps, is_interrupted=first.is_interrupted)
    n = NUM_ENVS if is_fast else FEW_ENVS
    limited = play = RandomPlay(Turns(config, n, seed=seed), seed)
    try:
        limited.play(budget, LIMITED, progress)
        if is_fast:
            play = RandomPlay(Turns(config.changed(max_steps=UNLIMITED), n, seed=seed), seed, is_split=True)
        play.is_split = True  # the environments of a task have limits of their own, so they play on
        play.play(budget, 1.0, progress)
    finally:
        limited.turns.world.close()
    trials, speed = play.trials, budget.steps / budget.spent_seconds
    trials.close()
    episodes, world = limited.episodes, limited.turns.world
    share = episodes.successes / max(episodes.n, 1)
    return PlayCosts(
        *_costs(trials, world.goals.kinds, seed),
        wilson_interval(share, episodes.n, LEVEL) if episodes.n else Interval(np.nan, 0.0, 1.0),
        episodes.n,
        limited.limit,
        budget.steps,
        speed,
        episodes.sequences,
        budget.is_interrupted,
    )


def _costs(trials: Trials, kinds: Sequence[str], seed: int) -> tuple[dict[str, GoalCost], Interval]:
    """Return the cost of each kind that was pursued and E, with intervals over resampled environments."""
    flow, n = trials.flow(), len(trials.stage)
    random = np.random.default_rng(seed)
    others = [trials.flow(random.multinomial(n, np.full(n, 1 / n)).astype(float)) for _ in range(RESAMPLES)]

    def interval(value: float, resampled: Sequence[float]) -> Interval:
        low, high = np.quantile(resampled, ((1 - LEVEL) / 2, (1 + LEVEL) / 2), method="inverted_cdf")
        return Interval(value, min(value, float(low)), max(value, float(high)))

    played = trials.totals()
    found = {}
    for kind, name in enumerate(kinds):
        if played[0, kind]:
            steps = [_ratio(one.by_kind[kind], one.reached[kind]) for one in (flow, *others)]
            share = _ratio(flow.by_kind[kind], flow.by_kind.sum())
            found[name] = GoalCost(interval(steps[0], steps[1:]), share, *played[:, kind].tolist())
    return found, interval(flow.steps, [one.steps for one in others])


def _ratio(steps: float, reached: float) -> float:
    return float(steps / reached) if reached else np.inf
