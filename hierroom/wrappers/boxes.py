"""The box view: flat, equal spaces for both agents, for libraries that accept no dicts or need equal spaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import BaseParallelWrapper
from pettingzoo.utils.wrappers import BaseWrapper

from hierroom.agents.features import CHOICE, ENTRY
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META

_ORDER = ("observation", "goal", "direction", "keys_held", "doors_open", "outcome")
"""The entries of EscapeRooms in the order of a box."""


@overload
def box_view(env: ParallelEnv) -> ParallelBoxes: ...
@overload
def box_view(env: AECEnv) -> AECBoxes: ...
def box_view(env: ParallelEnv | AECEnv) -> ParallelBoxes | AECBoxes:
    """Return an environment in which both agents observe one Box and act in one Discrete.

    | part | numbers | padded |
    |---|---|---|
    | ``observation`` / 10 | 147 | |
    | ``goal`` | 9 | |
    | ``direction``, one-hot | 4 | |
    | ``keys_held`` | 6 | |
    | ``doors_open`` | 6 | |
    | ``outcome``, one-hot | 4 | all zero for ``controller_0`` |
    | ``action_mask`` | 14 | zero for the actions that ``controller_0`` does not have |
    | which agent | 1 | 1 for ``meta_0``, 0 for ``controller_0`` |
    | ``features``, one-hot | as many as they have values | all zero for an agent without; see `add_features` |
    | ``choice``, one-hot, where a trained agent chooses goals | 14 | all zero for ``controller_0`` |

    For a task, the parts are its own entries, flattened, and then the last four of the table. Both agents have as many
    actions as the agent with more.

    Both agents of an EscapeRoom have 14 actions. An action that ``controller_0`` does not have only costs the step. In
    an AEC environment, wrappers inside this view do not see such actions, so put wrappers outside of it.

    Args:
        env: a `hierroom.parallel_env` or a `hierroom.env`, which may have features.

    Returns:
        The environment, of the same API. A parallel one observes these boxes, as SuperSuit needs; its infos have a list
        ``action_mask`` of the 14 actions, as AgileRL and TorchRL need. An AEC one observes dicts of ``observation``
        (the box) and ``action_mask``, as Tianshou and PettingZoo's tutorials need.

    Examples:
        >>> env = hierroom.box_view(hierroom.parallel_env("a"))
        >>> env.observation_space("meta_0").shape, env.action_space("meta_0")
        ((191,), Discrete(14))
    """
    if hasattr(getattr(env, "unwrapped", None), "single"):
        if isinstance(env, ParallelEnv):
            return ParallelBoxes(env)
        if isinstance(env, AECEnv):
            return AECBoxes(env)
    raise InputError(f"box_view takes a hierroom.env or a hierroom.parallel_env, not {env!r}")


class Boxes:
    """Turns the observations of both agents into boxes of one size, in EscapeRooms with numbers from 0 to 1."""

    def __init__(self, env: Any, agents: Sequence[str]) -> None:
        if any(not isinstance(env.action_space(agent), spaces.Discrete) for agent in agents):
            raise InputError(f"box_view takes Discrete actions, not {env.action_space(CONTROLLER)}")
        self.n_actions: int = max(env.action_space(agent).n for agent in agents)
        self._spaces = {agent: {**env.observation_space(agent).spaces} for agent in agents}
        sizes: dict[str, int] = {}  # an entry of both agents, such as ``features``, may have two spaces
        for name, one in (item for entries in self._spaces.values() for item in entries.items()):
            sizes[name] = max(sizes.get(name, 0), spaces.flatdim(one))
        added = {name: sizes.pop(name) for name in (ENTRY, CHOICE) if name in sizes}
        last = {"action_mask": sizes.pop("action_mask"), "is_meta": 1}
        self._is_task = env.unwrapped.single.turns.config.task is not None
        own = sizes if self._is_task else {name: sizes[name] for name in _ORDER}
        self._sizes = {**own, **last, **added}
        low, high = (-np.inf, np.inf) if self._is_task else (0, 1)
        self.space = spaces.Box(low, high, (sum(self._sizes.values()),), np.float32)

    def mask(self, observation: Mapping[str, Any]) -> NDArray[np.int8]:
        """Return the legal actions, [A] int8."""
        mask = np.zeros(self.n_actions, np.int8)
        mask[: len(observation["action_mask"])] = observation["action_mask"]
        return mask

    def vector(self, agent: str, observation: Mapping[str, Any]) -> NDArray[np.float32]:
        """Return one observation as numbers, with zeros for entries that the agent does not have."""
        numbers, start, own = np.zeros(self.space.shape, np.float32), 0, self._spaces[agent]
        for name, size in self._sizes.items():
            if name == "is_meta":
                numbers[start] = agent == META
            elif name in observation:
                part: Any = spaces.flatten(own[name], observation[name])
                scale = 10 if name == "observation" and not self._is_task else 1
                numbers[start : start + len(part)] = part / np.float32(scale)
            start += size
        return numbers


class _OwnSpaces:
    observation_spaces: dict[str, spaces.Space]
    action_spaces: dict[str, spaces.Space]

    def observation_space(self, agent: str) -> spaces.Space:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space:
        return self.action_spaces[agent]


class ParallelBoxes(_OwnSpaces, BaseParallelWrapper):
    """The parallel environment as `box_view` gives it."""

    def __init__(self, env: ParallelEnv) -> None:
        super().__init__(env)
        self.possible_agents = env.possible_agents
        self._boxes = Boxes(env, env.possible_agents)
        self.action_spaces = {agent: spaces.Discrete(self._boxes.n_actions) for agent in env.possible_agents}
        self.observation_spaces = dict.fromkeys(env.possible_agents, self._boxes.space)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None):
        """Begin an episode like the environment, with flat observations."""
        observations, infos = self.env.reset(seed, options)
        return self._flat(observations), self._with_masks(infos, observations)

    def step(self, actions: dict[str, int]):
        """Take a step like the environment, with flat observations."""
        observations, *results, infos = self.env.step(actions)
        return self._flat(observations), *results, self._with_masks(infos, observations)

    def _with_masks(self, infos: dict[str, Any], observations: dict[str, Any]) -> dict[str, Any]:
        masks = {agent: self._boxes.mask(observation).tolist() for agent, observation in observations.items()}
        return {agent: {**info, "action_mask": masks[agent]} for agent, info in infos.items()}

    def _flat(self, observations: dict[str, dict[str, Any]]) -> dict[str, NDArray[np.float32]]:
        return {agent: self._boxes.vector(agent, observation) for agent, observation in observations.items()}


class AECBoxes(_OwnSpaces, BaseWrapper):
    """The AEC environment as `box_view` gives it."""

    def __init__(self, env: AECEnv) -> None:
        super().__init__(env)
        agents = env.unwrapped.possible_agents
        self._boxes = Boxes(env, agents)
        self.action_spaces = {agent: spaces.Discrete(self._boxes.n_actions) for agent in agents}
        mask = spaces.Box(0, 1, (self._boxes.n_actions,), np.int8)
        self.observation_spaces = {
            agent: spaces.Dict({"observation": self._boxes.space, "action_mask": mask}) for agent in agents
        }

    def observe(self, agent: str) -> dict[str, NDArray]:
        """Return an agent's observation, in new arrays: ``observation`` [K] float32 and ``action_mask`` [14] int8."""
        observation: Any = self.env.observe(agent)
        return {"observation": self._boxes.vector(agent, observation), "action_mask": self._boxes.mask(observation)}

    def step(self, action: int | None) -> None:
        """Take the selected agent's turn; an action that only the other agent has costs the controller the step."""
        agent = self.env.agent_selection
        if self.action_spaces[agent].contains(action) and not self.env.action_space(agent).contains(action):
            self.unwrapped.step(action)  # illegal but not an error; the wrapper that checks bounds would raise one
        else:
            self.env.step(action)
