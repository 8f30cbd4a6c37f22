"""The PettingZoo AEC environment: a meta-controller and a controller take turns in one EscapeRoom.

| facts | |
|---|---|
| agents | ``meta_0``, ``controller_0`` |
| actions of meta_0 | 0-5 key of that colour, 6-11 door of that colour, 12 exit, 13 none: find something new |
| actions of controller_0 | 0 forward, 1 left, 2 right, 3 pickup, 4 open, 5 drop (where enabled) |
| observations | ``observation`` 7 x 7 x 3, ``goal``, ``direction``, ``keys_held``, ``doors_open``, ``action_mask`` |
| and for meta_0 | ``outcome``: 0 no goal before, 1 it was reached, 2 its horizon ran out, 3 the episode ended |
| rewards | meta_0: 1 for the exit; controller_0: by ``reward`` |
| infos | ``goal_event``, ``elapsed``, ``illegal_actions``, ``success``, ``length``, ``shortest_length``: always all |
| ends | terminated at the exit, truncated after ``max_steps`` primitive steps; both agents together |

``meta_0`` acts at reset and whenever its option ends; ``controller_0`` acts at all other times. An illegal action is
never an error: one of the meta-controller counts as no goal, and one of the controller only costs the step.

Version history: v0, the first.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray
from pettingzoo import AECEnv
from pettingzoo.utils.env import AECIterable
from pettingzoo.utils.wrappers import AssertOutOfBoundsWrapper, OrderEnforcingWrapper

from hierroom.envs.base import TwoAgentEnv, class_metadata
from hierroom.goals import GraphSpecs
from hierroom.support.errors import InputError
from hierroom.turns.records import AGENTS, CONTROLLER, META


class raw_env(TwoAgentEnv, AECEnv):
    """The AEC environment without wrappers.

    Args:
        graph: the goal graphs, as for `EnvConfig`.
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.
        **entries: other entries of the `EnvConfig`, by name; the reward is ``"intrinsic"`` unless it is given,
            and ``"extrinsic"`` in a task without goals.

    Attributes:
        complexity: the report on its goal graph, on the hardest one it may draw, or on its rules; None if unknown.

    Examples:
        >>> env = hierroom.raw_env("a")
        >>> env.reset(seed=0)
        >>> env.agent_selection, env.complexity.exit_depth
        ('meta_0', 2)
    """

    metadata = {**class_metadata(), "is_parallelizable": False}  # noqa: RUF012 - PettingZoo reads it from the class

    def reset(self, seed: int | None = None, options: dict | None = None) -> None:
        """Begin an episode: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: none; each key gives a warning.
        """
        self.infos = self.single.reset(seed, options)
        self.agents = list(AGENTS)
        self.rewards = dict.fromkeys(AGENTS, 0.0)
        self._cumulative_rewards = dict.fromkeys(AGENTS, 0.0)
        self.terminations = dict.fromkeys(AGENTS, False)
        self.truncations = dict.fromkeys(AGENTS, False)
        self.agent_selection = META

    def _require_reset(self) -> None:
        if not self.single.has_begun:
            raise InputError("reset the environment before its first step")

    def _require_agents(self) -> None:
        self._require_reset()
        if not self.agents:
            raise InputError("the episode has ended and no agent is left: reset the environment")

    def last(self, observe: bool = True) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Return the selected agent's observation, reward, termination, truncation and info."""
        self._require_agents()
        return super().last(observe)

    def agent_iter(self, max_iter: int = 2**63) -> AECIterable:
        """Return an iterator over the agents in the order of their turns, of at most ``max_iter`` turns."""
        self._require_reset()
        return super().agent_iter(max_iter)

    def observe(self, agent: str) -> dict[str, NDArray]:
        """Return an agent's current observation, in new arrays."""
        self._require_reset()
        return self.single.observe(agent)

    def step(self, action: Any) -> None:
        """Take the selected agent's turn."""
        self._require_agents()
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        if action is None:
            raise InputError(f"{agent} must act; None is for agents with an ended episode")
        if agent == META:
            self.single.choose(action)
            self.rewards = dict.fromkeys(AGENTS, 0.0)
        else:
            self.rewards, self.terminations, self.truncations = self.single.act(action)
        self._cumulative_rewards[agent] = 0.0  # only now, so that a refused action loses no reward
        self._accumulate_rewards()
        self.infos = self.single.infos()
        has_ended = self.terminations[META] or self.truncations[META]
        self.agent_selection = META if has_ended or self.single.is_meta_turn else CONTROLLER


def env(graph: GraphSpecs = "c", **entries: Any) -> AECEnv:
    """Return the AEC environment with PettingZoo's checks of order and bounds; the arguments are those of `raw_env`.

    Examples:
        >>> env = hierroom.env("a", size=11, max_steps=200)
        >>> env.reset(seed=0)
        >>> for agent in env.agent_iter():
        ...     observation, reward, terminated, truncated, info = env.last()
        ...     mask = observation["action_mask"]
        ...     env.step(None if terminated or truncated else env.action_space(agent).sample(mask))
        >>> env.agents
        []
    """
    inner = raw_env(graph, **entries)  # PettingZoo's wrapper checks the bounds of discrete actions only
    is_discrete = inner.single.turns.action_kind.kind == "discrete"
    return OrderEnforcingWrapper(AssertOutOfBoundsWrapper(inner) if is_discrete else inner)
