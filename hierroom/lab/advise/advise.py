"""Advice before training, from rules and a little random play."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from hierroom.complexity.report import analyze
from hierroom.goals import GoalGraph, Rules
from hierroom.lab.advise.check import training_speed
from hierroom.lab.advise.costs import PlayCosts, measure_costs
from hierroom.lab.advise.measures import Known, rule_numbers
from hierroom.lab.advise.model import read_model
from hierroom.lab.advise.outside import OTHER, world_of
from hierroom.lab.advise.prediction import Advice, best_of, predict, similar
from hierroom.lab.advise.rule_check import RuleCheck, check_rules
from hierroom.runs.config.presets import find_preset, implied_preset
from hierroom.support.cli import progress_bar, shell_words
from hierroom.support.errors import InputError
from hierroom.worlds.base import BaseWorld
from hierroom.worlds.env_config import EnvConfig, is_task
from hierroom.worlds.make import make_world, name_in_module

RULES_ONLY = "rules alone have nothing to play; give a task or a goal graph, and steps are predicted"
PROVISIONAL = "no run was made in this world: its intervals are provisional, from {} other worlds"

SLOW = 200
"""Steps a second of play; with fewer, the update that the speed of training is measured by takes too long."""


def advise(
    graph: Any = None,
    *,
    task: Any = None,
    rules: Rules | str | Path | None = None,
    max_steps: int | None = None,
    seconds: float = 30.0,
    play_steps: int | None = None,
    seed: int = 0,
    **entries: Any,
) -> Advice:
    """Return what to expect of training, before anybody trains: which method, how many steps, and how sure.

    Exactly one of graph, task and rules is given. Ctrl-C ends play; the answer says what is known by then.

    Args:
        graph: a goal graph of EscapeRooms, in every form that training takes.
        task: a `hierroom.Task`, or its name as in training.
        rules: `Rules`, or the path of a TOML file with them: only the chain is measured, and nothing predicted.
        max_steps: steps after which an episode is truncated; by default as in training.
        seconds: time to play, above 0.
        play_steps: primitive steps to play in place of ``seconds``; equal seeds then give equal answers.
        seed: of levels and actions.
        **entries: other entries of `EnvConfig`, such as ``size`` or ``drop_key``.

    Examples:
        >>> advice = hierroom.advise("a", play_steps=20_000)
        >>> advice.method, sorted(advice.predictions)
        ('hippo', ['hippo', 'ppo', 'ppo-bonus'])
    """
    if sum(one is not None for one in (graph, task, rules)) != 1:
        raise InputError("advice is on exactly one of a graph, a task and rules")
    if rules is not None:
        rules = rules if isinstance(rules, Rules) else Rules.from_toml(rules)
        chain = dict(_chain(rules)) | {"bottleneck": next(iter(analyze(rules).goal_sensitivity()), None)}
        return Advice(rules.name, "", {}, None, None, None, None, True, RULES_ONLY, read_model().name, chain)
    given = {"graph": graph, "task": task, "max_steps": max_steps}
    config = EnvConfig.of_arguments({name: one for name, one in given.items() if one is not None} | entries)
    if is_task(config.task):
        with suppress(InputError):  # no module has it
            config = config.changed(task=name_in_module(config.task))
    with progress_bar() as bar:
        bar_task = bar.add_task("playing", total=1.0)
        costs = measure_costs(config, seconds, play_steps, seed, lambda share: bar.update(bar_task, completed=share))
    world = make_world(config, 1)
    try:
        return _of_play(config, world, costs)
    finally:
        world.close()


def _of_play(config: EnvConfig, world: BaseWorld, costs: PlayCosts) -> Advice:
    check = _check(world, costs)
    rules = check.suggested if check is not None and world.rules is None else world.rules
    model, where = read_model(), world_of(config)
    known = Known.of(costs, rules)
    predictions, reason = predict(known, where, model)
    speed = None
    if predictions and not costs.is_interrupted and costs.steps_per_second > SLOW:
        with suppress(KeyboardInterrupt):
            speed = training_speed(find_preset(implied_preset({"task": config.task})).changed(env=config))
    method, steps = best_of(predictions)
    if predictions and where == OTHER:
        reason = PROVISIONAL.format(model.worlds)
    facts = (predictions, costs, check, method, steps, not predictions, reason, model.name, _chain(rules))
    return Advice(config.key, _words(config), *facts, speed, similar(known, model) if predictions else ())


def _words(config: EnvConfig) -> str:
    """Return the options of training that name a config."""
    unusual = {name: value for name, value in config.unusual.items() if name != "drop_key"}
    words = [f"--{config.kind}", *config.names, *["--drop-key"] * config.drop_key]
    return shell_words(*words, *(f"--{name.replace('_', '-')}={value}" for name, value in unusual.items()))


def _check(world: BaseWorld, costs: PlayCosts) -> RuleCheck | None:
    """Compare a world's rules with play; None for goal graphs, which the levels are built from."""
    if isinstance(world.rules, GoalGraph):
        return None
    goals = world.goals
    is_repeatable = np.broadcast_to(getattr(world, "is_repeatable", False), len(goals))
    once = [name for name, again in zip(goals.names, is_repeatable, strict=True) if not again]
    return check_rules(world.rules, costs.sequences, goals.names, goals.names[goals.target], once)


def _chain(rules: Rules | GoalGraph | None) -> Mapping[str, Any]:
    if rules is None:
        return {}
    fewest, markings, _ = rule_numbers(rules)
    depth = analyze(rules).exit_depth
    return {"exit depth": depth, "fewest goals": fewest, "markings": markings}
