"""Wrappers: the learner's features, those of `agents.features.FEATURES`, for users of other learners."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar, cast

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
from hierroom.agents.features import Features
from hierroom.controller import Observation
from hierroom.support.errors import InputError
from hierroom.turns.records import AGENTS, CONTROLLER
from hierroom.turns.turns import Turns
from hierroom.worlds.make import world_spec

Env = TypeVar("Env", AECEnv, ParallelEnv, gymnasium.Env, VectorEnv)


def add_features(env: Env, names: Sequence[str], agent: str = CONTROLLER) -> Env:
    """Put features into the observations of an agent, as one more entry: ``features`` [K] int64.

    What levels must remember for them, they remember from the next `reset` on.

    Args:
        env: an environment of hierroom, of any API: AEC, parallel, Gymnasium or Gymnasium vector; wrapped or not.
        names: names in `agents.features.FEATURES`, in order; each is one whole number or several.
        agent: whose observations; those of Gymnasium's environments are all ``controller_0``'s.

    Returns:
        the wrapped environment, of the same API.
    """
    require_features("features", names)
    for api, wrapper in ((AECEnv, _AEC), (ParallelEnv, _Parallel), (VectorEnv, _Vector), (gymnasium.Env, _Gymnasium)):
        if isinstance(env, api) and hasattr(env.unwrapped, "single" if wrapper is not _Vector else "turns"):
            agents = AGENTS if wrapper in (_AEC, _Parallel) else (CONTROLLER,)
            if agent not in agents:
                raise InputError(f"agent must be {' or '.join(agents)} in this environment, not {agent!r}")
            return cast(Env, wrapper(env, names, agent))
    raise InputError(f"add_features takes an environment of hierroom, not {env!r}")


class _Reader:
    """Reads the features of an agent, and lets the world remember what they need."""

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
        if "features" in space.spaces:
            raise InputError("these observations have features already: name all of them at once")
        return spaces.Dict({**space.spaces, "features": self.space})

    def read(self, observation: Observation) -> NDArray[np.int64]:
        return self._features.encode(observation).astype(np.int64)


class _TwoAgents:
    def __init__(self, env: Any, names: Sequence[str], agent: str) -> None:
        super().__init__(env)  # pyright: ignore[reportCallIssue] - PettingZoo's wrapper
        self._single = env.unwrapped.single
        self._reader = _Reader(self._single.turns, names, agent)
        self.observation_spaces = {name: env.observation_space(name) for name in env.possible_agents}
        self.observation_spaces[agent] = self._reader.extend(self.observation_spaces[agent])

    def observation_space(self, agent: str) -> spaces.Space:
        return self.observation_spaces[agent]

    def _extended(self, agent: str, observation: Any) -> Any:
        if agent == self._reader.agent:
            observation["features"] = self._reader.read(self._single.observation(agent))[0]
        return observation


class _AEC(_TwoAgents, BaseWrapper):
    def observe(self, agent: str) -> Any:
        return self._extended(agent, self.env.observe(agent))


class _Parallel(_TwoAgents, BaseParallelWrapper):
    def __init__(self, env: Any, names: Sequence[str], agent: str) -> None:
        super().__init__(env, names, agent)
        self.possible_agents = env.possible_agents

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None):
        observations, infos = self.env.reset(seed, options)
        return {agent: self._extended(agent, of_agent) for agent, of_agent in observations.items()}, infos

    def step(self, actions: dict[str, int]):
        observations, *results = self.env.step(actions)
        return {agent: self._extended(agent, of_agent) for agent, of_agent in observations.items()}, *results


class _Gymnasium(gymnasium.ObservationWrapper, RecordConstructorArgs):
    def __init__(self, env: Any, names: Sequence[str], agent: str = CONTROLLER) -> None:
        RecordConstructorArgs.__init__(self, names=list(names))
        gymnasium.ObservationWrapper.__init__(self, env)
        self._single = env.unwrapped.single
        self._reader = _Reader(self._single.turns, names, agent)
        self.observation_space = self._reader.extend(env.observation_space)

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        return {**observation, "features": self._reader.read(self._single.observation(CONTROLLER))[0]}


class _Vector(VectorWrapper):
    def __init__(self, env: Any, names: Sequence[str], agent: str) -> None:
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
                infos["final_obs"][env]["features"] = of_env
        return self._extended(observations), *results, infos

    def _extended(self, observations: dict[str, Any]) -> dict[str, Any]:
        features = self._reader.read(self._turns.observe(CONTROLLER, self._turns.due(CONTROLLER)))
        ended = np.flatnonzero(cast(Any, self.env.unwrapped).have_ended)
        if len(ended):  # the ledger has their goals no more
            step = self._turns.last_step
            assert step is not None
            features[ended] = self._reader.read(self._turns.final_observation(CONTROLLER, step, ended))
        return {**observations, "features": features}
