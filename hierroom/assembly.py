"""A config's rooms, inputs and learner, put together."""

from __future__ import annotations

import torch

from hierroom.errors import InputError
from hierroom.graph_pool import GraphPool
from hierroom.inputs import GOAL_INPUTS, InputColumns
from hierroom.learners import AgentSpace, Learner
from hierroom.methods import find_method
from hierroom.network import first_inputs, make_network
from hierroom.presets import TrainConfig
from hierroom.runs import RunFolder
from hierroom.turns import Turns
from hierroom.world.batch import Batch


def make_turns(
    config: TrainConfig, rooms: int, seed: int, *, autoreset: bool = True, measure_shortest: bool = False
) -> Turns:
    """The rooms that a config describes, and the turns taken in them; the last two arguments are those of `Turns`."""
    world = Batch(
        GraphPool(config.graph, config.drop_key, rooms).everything,
        rooms,
        size=config.size,
        max_steps=config.max_steps,
        drop_key=config.drop_key,
        seed=seed,
        threads=config.threads,
    )
    return Turns(
        world,
        pay=find_method(config.method).pay,
        novelty_bonus=config.novelty_bonus,
        subgoal_horizon=config.subgoal_horizon,
        goal_mask=config.goal_mask,
        autoreset=autoreset,
        measure_shortest=measure_shortest,
    )


def make_inputs(config: TrainConfig) -> InputColumns:
    """What the controller of a config is fed.

    Raises:
        InputError: if an input is unknown, or not for controllers.
    """
    if "goal-outcome" in config.inputs:
        raise InputError("goal-outcome is how the last goal ended: one of meta_inputs, not of inputs")
    sees_goal = find_method(config.method).sees_goal
    names = [name for name in config.inputs if sees_goal or name not in GOAL_INPUTS]
    return InputColumns([*first_inputs(config.network_name), *names], n_actions=6 if config.drop_key else 5)


def make_learner(config: TrainConfig, rooms: int) -> Learner:
    """The learner of a config's controller, for a number of rooms."""
    if config.device != "cpu" and not _has_device(config.device):
        raise InputError(f"this machine has no device {config.device!r}; cpu is always there")
    inputs = make_inputs(config)
    return Learner(
        AgentSpace(inputs.cardinalities, inputs.n_actions),
        rooms,
        config.ppo,
        seed=config.seed,
        device=config.device,
        threads=config.threads,
        network=lambda space, hidden_size: make_network(config.network_name, space, hidden_size, inputs.vectors),
    )


def warm_start(learner: Learner, config: TrainConfig, run: RunFolder) -> None:
    """Give the learner of a config the weights of a run's newest checkpoint.

    Raises:
        InputError: if the controllers differ in what they see or can do or in their network, or there is no checkpoint.
    """
    before = run.config()
    for what, ours, theirs in (
        ("network", config.network_name, before.network_name),
        ("hidden_size", config.ppo.hidden_size, before.ppo.hidden_size),
        ("drop_key", config.drop_key, before.drop_key),
        ("inputs", " ".join(make_inputs(config).names), " ".join(make_inputs(before).names)),
    ):
        if ours != theirs:
            raise InputError(f"{run.path} cannot warm-start this run: its {what} is {theirs}, here it is {ours}")
    state = run.load_checkpoint()
    try:
        learner.take_weights(state["learner"])
    except (RuntimeError, KeyError) as error:
        raise InputError(f"the newest checkpoint of {run.path} does not fit its config.json") from error


def _has_device(device: str) -> bool:
    try:
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError):
        return False
    return True
