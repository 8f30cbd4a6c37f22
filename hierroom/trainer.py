"""Training: act in the rooms of a config, learn from the turns, again and again."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch

from hierroom.assembly import make_inputs, make_learner, make_turns, warm_start
from hierroom.curiosity import Curiosity
from hierroom.episodes import MILESTONES, EpisodeLog
from hierroom.errors import InputError
from hierroom.graph_pool import GraphPool
from hierroom.meta import make_meta
from hierroom.methods import find_method
from hierroom.presets import TrainConfig
from hierroom.runs import RunFolder
from hierroom.turns import Step
from hierroom.world.layout import ROOM


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
        self.pool = GraphPool(config.graph, config.drop_key, config.rooms, config.curriculum_stages)
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
            **{f"steps_to_{m}": self.log.steps_to.get(m) for m in MILESTONES},
            **{f"seconds_to_{m}": self.log.seconds_to.get(m) for m in MILESTONES},
        }

    def state_dict(self) -> dict[str, Any]:
        """Everything that decides what happens next, as tensors and plain types."""
        turns = self.turns.get_state()
        rooms = turns.pop("rooms")
        state = {
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
        """Go on from what `state_dict` gave, in a trainer with the same config."""
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
