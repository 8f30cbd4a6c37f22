"""The Gymnasium environments ``hierroom/EscapeRoom-{a..g}-v0``: the controller alone, in one room or in many.

The goals come from a meta-controller inside the environment (none by default: flat). Observations, actions, ends and
infos are those of ``controller_0`` in `hierroom.aec_env`.

Version history: v0, the first.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from hierroom.goals import NAMED_GRAPHS
from hierroom.meta import MetaController, make_meta
from hierroom.settings import FRAMES_PER_SECOND, RENDER_MODES, RoomSettings, fresh_seed
from hierroom.world.render import Screen

_ROOM = np.zeros(1, np.int64)


class EscapeRoom(gymnasium.Env):
    """One room, and in it the controller.

    Args:
        meta: who picks the goals: a name, ``package.module:Class`` or a meta-controller (see `hierroom.meta`).
        pay: how the controller is paid: ``extrinsic``, ``bonus`` or ``intrinsic``.
        render_mode: ``"ansi"``, ``"rgb_array"``, ``"human"`` or None.
        **settings: see `RoomSettings`.

    Attributes:
        complexity: the `ComplexityReport` of its goal graph.
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": FRAMES_PER_SECOND}  # noqa: RUF012 - read from the class

    def __init__(
        self,
        meta: str | MetaController = "none",
        pay: str = "extrinsic",
        render_mode: str | None = None,
        **settings: Any,
    ):
        room = RoomSettings(pay=pay, **settings)
        self.turns = room.turns()
        self.complexity = room.complexity()
        self.meta = make_meta(meta)
        self.render_mode = render_mode
        self.observation_space = self.turns.controller_space()
        self.action_space = gymnasium.spaces.Discrete(self.turns.world.n_actions)
        self._screen = Screen(render_mode)
        self._is_seeded = False

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begin an episode: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: ``{"complexity": True}`` puts the complexity report into the info; other keys are ignored.
        """
        super().reset(seed=seed)
        self.turns.reset(fresh_seed() if seed is None and not self._is_seeded else seed)
        self._is_seeded = True
        self.turns.ask(self.meta)
        self._screen.show(self.turns.world.state, int(self.turns.goals[0]))
        info = {"goal_event": -1, "elapsed": 0}
        if (options or {}).get("complexity"):
            info["complexity"] = self.complexity.to_dict()
        return self._observation(self.turns.sight(_ROOM)), info

    def step(self, action: int):
        """Act once."""
        step = self.turns.step([action])
        info = {"goal_event": int(step.events[0]), "elapsed": 1}
        if step.over[0]:
            info.update(
                success=bool(step.terminated[0]), length=int(step.lengths[0]), shortest_length=int(step.shortest[0])
            )
            sight = self.turns.final_sight(step, _ROOM)
        else:
            self.turns.ask(self.meta)
            sight = self.turns.sight(_ROOM)
        self._screen.show(self.turns.world.state, int(sight.goals[0]))
        reward, terminated, truncated = float(step.rewards[0]), bool(step.terminated[0]), bool(step.truncated[0])
        return self._observation(sight), reward, terminated, truncated, info

    def render(self) -> str | NDArray[np.uint8] | None:
        """The room as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        return self._screen.render(self.turns.world.state, int(self.turns.goals[0]))

    def close(self) -> None:
        """Close the window, if one is open."""
        self._screen.close()

    def _observation(self, sight) -> dict[str, NDArray]:
        return {name: values[0] for name, values in self.turns.controller_observations(sight).items()}


class EscapeRooms(VectorEnv):
    """N rooms on the batch engine; a room whose episode ends begins its next one in the same step.

    The infos of a step hold ``goal_event`` and ``elapsed`` [N]; where an episode ended, ``final_obs`` [N] (each a
    dict, or None) and ``final_info``: ``success``, ``length`` and ``shortest_length`` [N].

    Args:
        num_envs: N.
        meta: who picks the goals, as for `EscapeRoom`.
        pay: how the controller is paid.
        threads: most threads to step the rooms with.
        **settings: see `RoomSettings`.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 - Gymnasium reads it from the class

    def __init__(
        self,
        num_envs: int = 1,
        meta: str | MetaController = "none",
        pay: str = "extrinsic",
        threads: int = 1,
        **settings: Any,
    ):
        room = RoomSettings(pay=pay, **settings)
        self.turns = room.turns(num_envs, autoreset=True, threads=threads)
        self.complexity = room.complexity()
        self.meta = make_meta(meta)
        self.num_envs = num_envs
        self.single_observation_space = self.turns.controller_space()
        self.single_action_space = gymnasium.spaces.Discrete(self.turns.world.n_actions)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._is_seeded = False

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begin an episode in every room: the first one of a seed, or without a seed each room's next."""
        super().reset(seed=seed)
        self.turns.reset(fresh_seed() if seed is None and not self._is_seeded else seed)
        self._is_seeded = True
        self.turns.ask(self.meta)
        n = self.num_envs
        infos = {"goal_event": np.full(n, -1), "elapsed": np.zeros(n, np.int64)}
        return self.turns.controller_observations(self.turns.sight()), infos

    def step(self, actions: NDArray[np.integer]):
        """Act once in every room."""
        step = self.turns.step(actions)
        over = step.over
        infos: dict[str, Any] = {"goal_event": step.events, "elapsed": np.ones(self.num_envs, np.int64)}
        if over.any():
            ended = np.flatnonzero(over)
            last = self.turns.controller_observations(self.turns.final_sight(step, ended))
            final_observations = np.full(self.num_envs, None, object)
            for m, n in enumerate(ended):
                final_observations[n] = {name: values[m] for name, values in last.items()}
            final_info = {"success": step.terminated, "length": step.lengths, "shortest_length": step.shortest}
            final_info |= {f"_{name}": over.copy() for name in final_info}
            infos |= {
                "final_obs": final_observations,
                "_final_obs": over,
                "final_info": final_info,
                "_final_info": over,
            }
        self.turns.ask(self.meta)
        observations = self.turns.controller_observations(self.turns.sight())
        return observations, step.rewards, step.terminated, step.truncated, infos


def register_envs() -> None:
    """Register ``hierroom/EscapeRoom-{a..g}-v0``; ``import hierroom`` has done so."""
    for letter in NAMED_GRAPHS:
        gymnasium.register(
            f"hierroom/EscapeRoom-{letter}-v0",
            entry_point="hierroom.gym_env:EscapeRoom",
            vector_entry_point="hierroom.gym_env:EscapeRooms",
            kwargs={"graph": letter},
        )
