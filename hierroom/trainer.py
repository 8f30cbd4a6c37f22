"""Training: rooms, turns, a meta-controller and a learner, put together from a config and stepped."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch

from hierroom.curiosity import Curiosity
from hierroom.episodes import EpisodeLog
from hierroom.errors import InputError
from hierroom.graph_pool import GraphPool
from hierroom.inputs import GOAL_INPUTS, InputColumns
from hierroom.learners import AgentSpace, Learner
from hierroom.meta import make_meta
from hierroom.methods import find_method
from hierroom.network import first_inputs, make_network
from hierroom.presets import TrainConfig
from hierroom.runs import RunFolder
from hierroom.turns import Step, Turns
from hierroom.world.batch import Batch
from hierroom.world.layout import ROOM

CHECKPOINT_FORMAT = 1


def make_turns(
    config: TrainConfig, rooms: int, seed: int, *, autoreset: bool = True, measure_shortest: bool = False
) -> Turns:
    """The rooms that a config describes, and the turns taken in them; the last two arguments are those of `Turns`."""
    world = Batch(
        GraphPool(config.graph, config.drop_key).everything,
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
    """What the controller of a config is fed."""
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
    check_format(state)
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


class Trainer:
    """Trains the controller of a config.

    Args:
        config: what to train.

    Attributes:
        steps: primitive steps taken so far, over all rooms.
        seconds: seconds spent in `advance` so far.
        log: what the last episodes were like.
        statistics: of the learner's last update.

    Raises:
        InputError: if the config holds a value that cannot be used.
    """

    def __init__(self, config: TrainConfig):
        if config.steps < 1:
            raise InputError(f"steps must be at least 1, not {config.steps}")
        self.config = config
        self.pool = GraphPool(config.graph, config.drop_key, config.curriculum_stages)
        self.turns = make_turns(config, config.rooms, config.seed)
        self.turns.world.set_graphs(self.pool.graphs)
        self.turns.reset(config.seed)
        self.turns.world.stagger_clocks()
        self.meta = make_meta(config.meta_name, config)
        self.inputs = make_inputs(config)
        self.learner = make_learner(config, config.rooms)
        if config.warm_start:
            warm_start(self.learner, config, RunFolder.open(config.warm_start))
        self.curiosity = Curiosity(config, self.inputs.n_actions) if find_method(config.method).is_curious else None
        self.log = EpisodeLog()
        self.statistics: dict[str, float] = {}
        self.steps = 0
        self.seconds = 0.0
        self._all = np.arange(config.rooms)
        self._masks = np.ones((config.rooms, self.inputs.n_actions), bool)
        self.turns.ask(self.meta)

    @property
    def is_done(self) -> bool:
        """Whether the config's steps are taken."""
        return self.steps >= self.config.steps

    def advance(self) -> None:
        """Act in every room until the learner has learned once more."""
        started = time.perf_counter() - self.seconds
        codes = self.inputs.codes(self.turns.sight())
        while not self.learner.ready:
            step = self.turns.step(self.learner.act(self._all, codes, self._masks))
            self.steps += len(self._all)
            terminated, truncated = self._ends_of_returns(step)
            if hasattr(self.meta, "learn"):
                self.meta.learn(step, self.turns)  # pyright: ignore[reportAttributeAccessIssue]
            rewards = step.rewards + self.curiosity.rewards(step, self.turns) if self.curiosity else step.rewards
            self.turns.ask(self.meta)
            codes = self.inputs.codes(self.turns.sight())
            next_codes, bootstrapped = codes.copy(), np.flatnonzero(truncated)
            if len(bootstrapped):
                next_codes[bootstrapped] = self.inputs.codes(self.turns.final_sight(step, bootstrapped))
            elapsed = np.ones(len(self._all), np.int64)
            self.learner.finish(self._all, rewards, elapsed, terminated, truncated, step.over, next_codes)
            self.log.add(step, self.steps, time.perf_counter() - started)
            if self.pool.add(step):
                self.turns.world.set_graphs(self.pool.graphs)
        self.statistics = self.learner.update(min(self.steps / self.config.steps, 1.0))
        if self.curiosity:
            self.statistics |= self.curiosity.learn()
        self.seconds = time.perf_counter() - started

    def _ends_of_returns(self, step: Step):
        """Where the controller's returns end with nothing to come, and where they are cut off (both [N] bool)."""
        terminated, truncated = step.terminated, step.truncated
        if self.turns.pay.ends_with_goal:
            terminated, truncated = terminated | step.reached, truncated | step.timed_out
        return terminated, truncated & ~terminated

    def metrics(self) -> dict[str, float]:
        """One row of numbers on how training stands."""
        return {
            "steps": self.steps,
            "seconds": self.seconds,
            "episodes": self.log.episodes,
            "success_rate": self.log.success_rate,
            "episode_length": self.log.episode_length,
            **self.statistics,
            **{f"meta_{name}": value for name, value in getattr(self.meta, "statistics", {}).items()},
        }

    def summary(self) -> dict[str, Any]:
        """What is left to be said at the end of training."""
        return {
            "success_rate": self.log.success_rate,
            "episode_length": self.log.episode_length,
            "episodes": self.log.episodes,
            "steps": self.steps,
            "seconds": self.seconds,
            "steps_per_second": self.steps / self.seconds if self.seconds else 0.0,
            "rollout_bytes": self.learner.n_rollout_bytes,
            **{f"steps_to_{m}": self.log.steps_to.get(m) for m in (50, 90, 95, 99)},
            **{f"seconds_to_{m}": self.log.seconds_to.get(m) for m in (50, 90, 95, 99)},
        }

    def state_dict(self) -> dict[str, Any]:
        """Everything that decides what happens next, as tensors and plain types."""
        turns = self.turns.get_state()
        rooms = turns.pop("rooms")
        state = {
            "format": CHECKPOINT_FORMAT,
            "turns": {name: torch.from_numpy(array) for name, array in turns.items()},
            "rooms": {name: torch.from_numpy(rooms[name].copy()) for name in ROOM.names or ()},
            "learner": self.learner.state_dict(),
            "log": self.log.state_dict(),
            "pool": self.pool.state_dict(),
            "steps": self.steps,
            "seconds": self.seconds,
        }
        if self.curiosity:
            state["curiosity"] = self.curiosity.state_dict()
        if hasattr(self.meta, "state_dict"):
            state["meta"] = self.meta.state_dict()  # pyright: ignore[reportAttributeAccessIssue]
        return state

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave, in a trainer with the same config.

        Raises:
            InputError: if the checkpoint is of another format.
        """
        check_format(state)
        turns = {name: tensor.numpy() for name, tensor in state["turns"].items()}
        rooms = np.zeros(self.config.rooms, ROOM)
        for name, values in state["rooms"].items():
            rooms[name] = values.numpy()
        self.turns.set_state({**turns, "rooms": rooms})
        self.learner.load_state_dict(state["learner"])
        self.log.load_state_dict(state["log"])
        self.pool.load_state_dict(state["pool"])
        self.turns.world.set_graphs(self.pool.graphs)
        self.steps, self.seconds = state["steps"], state["seconds"]
        if self.curiosity:
            self.curiosity.load_state_dict(state["curiosity"])
        if "meta" in state:
            self.meta.load_state_dict(state["meta"])  # pyright: ignore[reportAttributeAccessIssue]


def check_format(state: dict[str, Any]) -> None:
    """Refuse a checkpoint that another version of hierroom wrote in another format."""
    if state.get("format") != CHECKPOINT_FORMAT:
        raise InputError(f"the checkpoint has format {state.get('format')}, this hierroom reads {CHECKPOINT_FORMAT}")
