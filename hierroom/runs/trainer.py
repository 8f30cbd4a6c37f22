"""Training: two agents repeatedly act in the environments of a config and learn from their turns."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch

from hierroom.agents.evaluation import Evaluation, evaluate
from hierroom.agents.player import Pair
from hierroom.agents.ppo_agent import PPOAgent
from hierroom.agents.scripted_agent import ScriptedAgent
from hierroom.goals import GraphSpecs
from hierroom.learners.networks.initial_weights import plain_torch
from hierroom.meta import MetaSpec, make_meta
from hierroom.runs.assembly import derived_seed, freeze, make_agents, make_turns
from hierroom.runs.config.config import MOST_EVALUATION_EPISODES, TrainConfig
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.folder.weights import SavedAgent, weights_file
from hierroom.runs.logs.episode_log import EpisodeLog
from hierroom.support.errors import DivergenceError, InputError, require_number
from hierroom.support.files import to_json
from hierroom.support.kernel import compile_clock
from hierroom.support.schema import Schema, Table, as_array, of_records
from hierroom.turns.records import CONTROLLER, META
from hierroom.turns.turns import Turns

MAX_EVALUATION_ENVS = 100
"""The most environments that an evaluation plays in parallel."""
MOST_EPISODES, ROUND = 100, 25
"""The most episodes of an evaluation, and its number of environments, if the config does not set the episodes."""


class Trainer:
    """Trains the agents of a config; if the run ``begins``, the controller starts from the warm start, if any.

    The callback of `hierroom.train` gets the trainer after each update, and may use `metrics`, `evaluate` and:

    Attributes:
        config: the `TrainConfig`.
        steps: primitive steps so far, over all environments.
        seconds: seconds of training so far, without compilation and evaluations.
        compile_seconds: seconds of compilation so far.
        evaluation: the latest of the run's own evaluations (``evaluations``) in this session, an `Evaluation` with
            ``success_rate`` and ``mean_return``; None before the first.
        agents: the two agents by name.
        turns: the environments.

    Examples:
        >>> def stop_early(trainer):
        ...     return trainer.steps >= 256
        ...
        >>> small = dict(graph="a", size=11, num_envs=8, evaluations=0)
        >>> hierroom.train(**small, steps=10_000, callback=stop_early, out="stopped", quiet=True).is_finished
        False
    """

    def __init__(self, config: TrainConfig, *, begins: bool = True):
        self.config = config
        self.turns = make_turns(config, config.num_envs, config.seed, levels="training")
        if config.stagger_clocks:
            self.turns.world.stagger_clocks()
        meta, controller = make_agents(config)
        self.agents = {META: meta, CONTROLLER: controller}  # the meta-controller acts first
        self._pair, self.controller = Pair(self.agents), controller
        if config.warm_start and begins:
            source = config.warm_start
            file = weights_file(source)
            saved = RunFolder.open(source).load_checkpoint()["agents"] if file is None else SavedAgent.read(file).agents
            try:
                controller.take_weights(saved.get(CONTROLLER, {}))
            except InputError as error:
                raise InputError(f"{source} cannot warm-start this run: {error}") from error
        self.log = EpisodeLog(self.turns.world.goals, self.turns.world.clocks())
        self.evaluation: Evaluation | None = None
        self.steps = 0
        self.seconds = self.compile_seconds = 0.0  # spent in `advance`
        self._speed = float("nan")

    @property
    def is_done(self) -> bool:
        """Return whether the config's steps are taken."""
        return self.steps >= self.config.steps

    @property
    def steps_per_second(self) -> float:
        """Return the steps per second of all training so far, without compilation and evaluations."""
        return self.steps / self.seconds if self.seconds else 0.0

    def advance(self) -> None:
        """Act in every environment until the controller has learned once more (paper, Algorithm 1).

        It raises a `DivergenceError` if an agent's numbers are no longer finite, or far too large.
        """
        clock = compile_clock()
        started, compiled, steps = time.perf_counter(), clock.seconds, self.steps
        self.log.begin_update()
        while not self.controller.ready:
            self._choose_goals()
            step = self._pair.step(self.turns)
            self.steps += len(self.turns)
            self.log.add(step, self.turns, self.steps)
        self._choose_goals()  # the controller's next observation holds its next goal
        self._learn(CONTROLLER)
        compiled = clock.seconds - compiled
        seconds = time.perf_counter() - started - compiled
        self.compile_seconds += compiled
        self.seconds += seconds
        self._speed = (self.steps - steps) / seconds

    def _choose_goals(self) -> None:
        if self.agents[META].ready and len(self.turns.due(META)):
            self._learn(META)
        self._pair.choose(self.turns, META)

    def _learn(self, name: str) -> None:
        observation = self.turns.observe(name, self.turns.due(name))
        try:
            with plain_torch():  # a user's environment may have changed torch's modes since the run began
                self.agents[name].update(observation, min(self.steps / self.config.steps, 1.0))
        except DivergenceError as error:
            raise DivergenceError(f"training diverged after {self.steps:,} steps in {name}'s {error}") from error

    def fresh_turns(self, num_envs: int, seed: int, *, graph: GraphSpecs | None = None) -> Turns:
        """Make other environments of the config, with evaluation levels, which measure shortest lengths."""
        config = self.config if graph is None else self.config.changed(graph=graph, exclude=())
        return make_turns(config, num_envs, seed, levels="evaluation", measure_shortest=True)

    def freeze(self, num_envs: int, *, seed: int) -> Pair:
        """Return copies of the agents, to play in other environments without learning; see `assembly.freeze`."""
        return freeze(self.agents[META], self.controller, num_envs, seed=seed)

    def evaluate(
        self,
        episodes: int | None = None,
        *,
        meta: MetaSpec | None = None,
        graph: GraphSpecs | None = None,
        is_greedy: bool = False,
    ) -> Evaluation:
        """Evaluate the agents as they are now, each time on the same levels; None: as in the config."""
        if episodes is not None:
            require_number("episodes", episodes, 1, MOST_EVALUATION_EPISODES, is_whole=True)
        asked = self.config.evaluation_episodes if episodes is None else episodes
        episodes, num_envs = (MOST_EPISODES, ROUND) if asked is None else (asked, min(MAX_EVALUATION_ENVS, asked))
        seed = derived_seed(self.config.seed, "evaluation")
        chooses = self.agents[META] if meta is None else ScriptedAgent(make_meta(meta))
        player = freeze(chooses, self.controller, num_envs, seed=seed, is_greedy=is_greedy)
        return evaluate(player, self.fresh_turns(num_envs, seed, graph=graph), episodes, may_stop=asked is None)

    def metrics(self) -> dict[str, float]:
        """Return the present numbers of training by name: a row of ``metrics.csv``.

        They include ``success_rate``, ``episode_length`` and ``episode_return`` of the last 500 episodes, and the
        losses of the last update, such as ``policy_loss``. The stage of a curriculum is counted from 1.
        """
        world, ledger = self.turns.world, self.turns.ledger
        illegal = float(ledger.illegal_goals.sum() / max(1, ledger.meta_turns.sum()))
        return {
            "steps": self.steps,
            "seconds": self.seconds,
            "compile_seconds": self.compile_seconds,
            "steps_per_second": self._speed,
            "episodes": self.log.episodes,
            **self.log.means,
            **self.log.reached,
            **({"meta_illegal_goals": illegal} if self.config.resolved_method.meta != "none" else {}),
            **({"stage": world.stage + 1} if world.stage_titles else {}),
            **self.controller.statistics,
            **{f"meta_{name}": value for name, value in self.agents[META].statistics.items()},
        }

    def summary(self) -> dict[str, Any]:
        """Return the numbers of training for ``summary.json``."""
        row, world = self.metrics(), self.turns.world
        return {
            **{f"training_{name}": value for name, value in self.log.means.items()},
            **{name: row[name] for name in ("episodes", "steps", "seconds", "compile_seconds")},
            "steps_per_second": self.steps_per_second,
            "rollout_bytes": self.controller.learner.n_rollout_bytes,
            **({"stage": row["stage"], "stages": len(world.stage_titles)} if world.stage_titles else {}),
        }

    def state_dict(self) -> dict[str, Any]:
        """Return the complete state, as tensors and plain types."""
        return {
            "config": to_json(self.config.to_dict()),
            "turns": {
                name: {field: torch.from_numpy(array[field].copy()) for field in array.dtype.names}
                if array.dtype.names
                else torch.from_numpy(array)
                for name, array in self.turns.get_state().items()
            },
            "agents": {name: agent.state_dict() for name, agent in self.agents.items()},
            "log": self.log.state_dict(),
            "steps": self.steps,
            "seconds": self.seconds,
            "compile_seconds": self.compile_seconds,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore a state from `state_dict`, in a trainer with the same config."""
        now = self.turns.get_state()
        Table(dict.fromkeys(now, Schema())).check(state["turns"], "turns")
        self.turns.set_state({name: _as_array(state["turns"][name], like, name) for name, like in now.items()})
        for name, agent in self.agents.items():
            try:
                agent.load_state_dict(state["agents"][name])
            except InputError as error:
                raise InputError(f"agents.{name}: {error}") from error
            if isinstance(agent, PPOAgent) and agent.learner.has_begun[self.turns.due(name)].any():
                raise InputError(f"agents.{name}: it is in a turn where it is about to begin one")
        if self.controller.ready:
            raise InputError("the controller must learn from its full rollout before its state is saved")
        self.log.load_state_dict(state["log"])
        self.steps, self.seconds, self.compile_seconds = state["steps"], state["seconds"], state["compile_seconds"]


def _as_array(saved: Any, like: np.ndarray, name: str) -> np.ndarray:
    if like.dtype.names is None:
        return as_array(saved, f"turns.{name}")
    of_records(like.dtype, len(like), {}).check(saved, name)
    array = np.zeros_like(like)
    for field in like.dtype.names:
        array[field] = as_array(saved[field], f"{name}.{field}")
    return array
