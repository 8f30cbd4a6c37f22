"""Wrappers that add the learner's features to observations, for other learners or trained agents in a user's loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import BaseParallelWrapper
from pettingzoo.utils.wrappers import BaseWrapper

from hierroom.agents.config import require_features
from hierroom.agents.features import CHOICE, ENTRY, Features
from hierroom.controller import Observation
from hierroom.support.errors import InputError
from hierroom.turns.records import AGENTS, CONTROLLER, META, Step
from hierroom.turns.turns import Turns
from hierroom.worlds.make import world_spec

if TYPE_CHECKING:
    from hierroom.envs.single_env import SingleEnv
    from hierroom.runs.trained_agent import TrainedAgent

Env = TypeVar("Env", AECEnv, ParallelEnv, gymnasium.Env, VectorEnv)


def add_features(
    env: Env, names: Sequence[str] | TrainedAgent, agent: str = CONTROLLER, *, seed: int | None = None
) -> Env:
    """Add features to the observations of an agent, as one more entry: ``features`` [K] int64.

    Features that need memory are complete only after the next `reset`.

    Args:
        env: an environment of hierroom, of any API: AEC, parallel, Gymnasium or Gymnasium vector; wrapped or not.
        names: names from `agents.features.offered`, in order; each is one or several whole numbers. Or a
            `TrainedAgent`, to play with its `act`: then the features are those of its controller. In an AEC or parallel
            environment, ``meta_0`` also observes ``choice``, the goal that the agent's meta-controller chooses; the
            controller's features already use that goal. Gymnasium's environments take the meta-controller when they are
            made: ``meta=agent.meta_controller(num_envs)``.
        agent: ``controller_0`` or ``meta_0``; Gymnasium's environments have only the first.
        seed: determines the choices of a `TrainedAgent`'s meta-controller; None: 0.

    Returns:
        the wrapped environment, of the same API.

    Examples:
        >>> env = hierroom.add_features(hierroom.parallel_env("a"), ["previous-action", "goal-status"])
        >>> observations, infos = env.reset(seed=0)
        >>> observations["controller_0"]["features"].shape
        (14,)
    """
    trained = _trained(names)
    if trained is None:
        require_features("features", cast(Sequence[str], names))
    for api, wrapper in ((AECEnv, _AEC), (ParallelEnv, _Parallel), (VectorEnv, _Vector), (gymnasium.Env, _Gymnasium)):
        if isinstance(env, api) and hasattr(env.unwrapped, "single" if wrapper is not _Vector else "turns"):
            agents = AGENTS if wrapper in (_AEC, _Parallel) else (CONTROLLER,)
            if agent not in agents:
                raise InputError(f"agent must be {' or '.join(agents)} in this environment, not {agent!r}")
            if trained is not None and agent != CONTROLLER:
                raise InputError(f"agent goes with names of features; those of a TrainedAgent are for {CONTROLLER}")
            if seed is not None and (trained is None or len(agents) == 1):
                raise InputError("seed is for the meta-controller of a TrainedAgent, in an AEC or parallel environment")
            if trained is None:
                return cast(Env, wrapper(env, cast(Sequence[str], names), agent))
            inner: Any = env.unwrapped
            trained.require_world((inner.turns if wrapper is _Vector else inner.single.turns).config)
            wrapped: Any = wrapper(env, trained.controller.features.names)
            if wrapper in (_AEC, _Parallel):
                wrapped.follow(trained, seed or 0)
            return cast(Env, wrapped)
    raise InputError(f"add_features takes an environment of hierroom, not {env!r}")


def _trained(names: Any) -> TrainedAgent | None:
    if isinstance(names, (list, tuple, str)):
        return None
    from hierroom.runs.trained_agent import TrainedAgent  # this imports torch

    return names if isinstance(names, TrainedAgent) else None


class _Reader:
    """Reads the features of an agent, and makes the world remember what they need."""

    def __init__(self, turns: Turns, names: Sequence[str], agent: str) -> None:
        self.agent = agent
        self._features = Features(world_spec(turns.config), names, agent)
        self.space = spaces.MultiDiscrete(list(self._features.cardinalities))
        turns.world.remember(self._features.memories)

    def extend(self, space: spaces.Space) -> spaces.Dict:
        if not isinstance(space, spaces.Dict) or "goal" not in space.spaces:
            raise InputError(
                f"features are added to observations that are dicts, before other wrappers, not to {space}"
            )
        if ENTRY in space.spaces:
            raise InputError("these observations have features already: name all of them in one call")
        return spaces.Dict({**space.spaces, ENTRY: self.space})

    def read(self, observation: Observation) -> NDArray[np.int64]:
        return self._features.encode(observation).astype(np.int64)


class _Goals:
    """Lets a trained agent's meta-controller choose goals in one environment, once at each of its turns."""

    def __init__(self, single: SingleEnv, trained: TrainedAgent, seed: int) -> None:
        self._single = single
        self._agent: Any = trained.pair(1, seed=seed).agents[META]
        if hasattr(self._agent, "features"):
            single.turns.world.remember(self._agent.features.memories)
        self._choice: int | None = None  # in the current turn

    def choice(self) -> int:
        """Return the goal that it chooses, or the last action (no goal) if it is not its turn."""
        turns, step = self._single.turns, self._single.turns.last_step
        if not self._single.is_meta_turn or (step is not None and step.episode_ended[0]):
            return len(turns.world.goals)
        if self._choice is None:
            situation = turns.situation(turns.due(META))
            goals, _ = situation.validate_goals(self._agent.act(situation))
            self._choice = int(goals[0]) % situation.goal_set.n_choices
        return self._choice

    def begin(self) -> None:
        self._choice = None
        if hasattr(self._agent, "forget"):
            self._agent.forget(np.zeros(1, np.int64))

    def watch(self, before: Step | None) -> None:
        """Let the meta-controller record a step, if one was taken since the step ``before``."""
        turns = self._single.turns
        if turns.last_step is not None and turns.last_step is not before:
            self._choice = None
            self._agent.record(turns.last_step, turns)


class _TwoAgents:
    goals: _Goals | None = None

    def __init__(self, env: Any, names: Sequence[str], agent: str = CONTROLLER) -> None:
        super().__init__(env)  # pyright: ignore[reportCallIssue] - PettingZoo's wrapper
        self._single = env.unwrapped.single
        self._reader = _Reader(self._single.turns, names, agent)
        self.observation_spaces = {name: env.observation_space(name) for name in env.possible_agents}
        self.observation_spaces[agent] = self._reader.extend(self.observation_spaces[agent])

    def follow(self, trained: TrainedAgent, seed: int) -> None:
        """Add the choices of a trained agent's meta-controller to the observations."""
        self.goals, space = _Goals(self._single, trained, seed), cast(spaces.Dict, self.observation_spaces[META])
        choice = spaces.Discrete(self._single.turns.world.goals.n_choices)
        self.observation_spaces[META] = spaces.Dict({**space.spaces, CHOICE: choice})

    def observation_space(self, agent: str) -> spaces.Space:
        return self.observation_spaces[agent]

    def _extended(self, agent: str, observation: Any) -> Any:
        if agent == self._reader.agent:
            moment = self._single.observation(agent)
            if self.goals is not None and (choice := self.goals.choice()) < len(moment.goal_set):
                moment = replace(moment, goals=np.array([choice]))
            observation[ENTRY] = self._reader.read(moment)[0]
        elif self.goals is not None:
            observation[CHOICE] = np.int64(self.goals.choice())
        return observation


class _AEC(_TwoAgents, BaseWrapper):
    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        if self.goals is not None:
            self.goals.begin()
        self.env.reset(seed, options)

    def observe(self, agent: str) -> Any:
        return self._extended(agent, self.env.observe(agent))

    def step(self, action: Any) -> None:
        before = self._single.turns.last_step
        self.env.step(action)
        if self.goals is not None:
            self.goals.watch(before)


class _Parallel(_TwoAgents, BaseParallelWrapper):
    def __init__(self, env: Any, names: Sequence[str], agent: str = CONTROLLER) -> None:
        super().__init__(env, names, agent)
        self.possible_agents = env.possible_agents

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None):
        if self.goals is not None:
            self.goals.begin()
        observations, infos = self.env.reset(seed, options)
        return {agent: self._extended(agent, of_agent) for agent, of_agent in observations.items()}, infos

    def step(self, actions: dict[str, int]):
        before = self._single.turns.last_step
        observations, *results = self.env.step(actions)
        if self.goals is not None:
            self.goals.watch(before)
        return {agent: self._extended(agent, of_agent) for agent, of_agent in observations.items()}, *results


class _Gymnasium(gymnasium.ObservationWrapper, RecordConstructorArgs):
    def __init__(self, env: Any, names: Sequence[str], agent: str = CONTROLLER) -> None:
        RecordConstructorArgs.__init__(self, names=list(names))
        gymnasium.ObservationWrapper.__init__(self, env)
        self._single = env.unwrapped.single
        self._reader = _Reader(self._single.turns, names, agent)
        self.observation_space = self._reader.extend(env.observation_space)

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        return {**observation, ENTRY: self._reader.read(self._single.observation(CONTROLLER))[0]}


class _Vector(VectorWrapper):
    def __init__(self, env: Any, names: Sequence[str], agent: str = CONTROLLER) -> None:
        super().__init__(env)
        self._turns: Turns = env.unwrapped.turns
        self._reader = _Reader(self._turns, names, agent)
        self.single_observation_space = self._reader.extend(env.single_observation_space)
        self.observation_space = batch_space(self.single_observation_space, env.num_envs)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None):
        observations, infos = self.env.reset(seed=seed, options=options)
        return self._extended(observations), infos

    def step(self, actions: Any):
        observations, *results, infos = self.env.step(actions)
        if "final_obs" in infos:
            step, ended = self._turns.last_step, np.flatnonzero(infos["_final_obs"])
            assert step is not None
            features = self._reader.read(self._turns.final_observation(CONTROLLER, step, ended))
            for env, of_env in zip(ended, features, strict=True):
                infos["final_obs"][env][ENTRY] = of_env
        return self._extended(observations), *results, infos

    def _extended(self, observations: dict[str, Any]) -> dict[str, Any]:
        features = self._reader.read(self._turns.observe(CONTROLLER, self._turns.due(CONTROLLER)))
        ended = np.flatnonzero(cast(Any, self.env.unwrapped).have_ended)
        if len(ended):  # the ledger no longer has their goals
            step = self._turns.last_step
            assert step is not None
            features[ended] = self._reader.read(self._turns.final_observation(CONTROLLER, step, ended))
        return {**observations, ENTRY: features}
