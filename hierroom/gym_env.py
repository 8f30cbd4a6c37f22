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

from hierroom.goals import NAMED_GRAPHS, NO_GOAL
from hierroom.meta import MetaController, make_meta
from hierroom.room import CONTROLLER, Room
from hierroom.settings import FRAMES_PER_SECOND, RoomSettings, fresh_seed
from hierroom.step import Step
from hierroom.world.render import RENDER_MODES


class EscapeRoom(gymnasium.Env):
    """One room, and in it the controller.

    Args:
        meta: who picks the goals: a name, ``package.module:Class`` or a meta-controller (see `hierroom.meta`).
        pay: how the controller is paid: ``extrinsic``, ``bonus``, ``intrinsic`` or ``novelty``.
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
        self.room = Room(RoomSettings(pay=pay, **settings), render_mode)
        self.meta = make_meta(meta)
        self.render_mode = render_mode
        self.complexity = self.room.complexity
        self.observation_space = self.room.observation_spaces[CONTROLLER]
        self.action_space = self.room.action_spaces[CONTROLLER]

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begin an episode: the first one of a seed, or without a seed the next one.

        Args:
            seed: 0 to 2**63 - 1.
            options: ``{"complexity": True}`` puts the complexity report into the info; other keys are ignored.
        """
        infos = self.room.reset(seed, options)
        super().reset(seed=seed)
        self.room.ask(self.meta)
        return self.room.observe(CONTROLLER), infos[CONTROLLER]

    def step(self, action: int):
        """Act once."""
        rewards, terminations, truncations = self.room.act(action)
        self.room.ask(self.meta)
        return (
            self.room.observe(CONTROLLER),
            rewards[CONTROLLER],
            terminations[CONTROLLER],
            truncations[CONTROLLER],
            self.room.infos()[CONTROLLER],
        )

    def render(self) -> str | NDArray[np.uint8] | None:
        """The room as text, as a picture [H, W, 3] or in a window, with the current subgoal shown."""
        return self.room.render()

    def close(self) -> None:
        """Close the window, if one is open."""
        self.room.close()


class EscapeRooms(VectorEnv):
    """N rooms on the batch engine; a room whose episode ends begins its next one in the same step.

    Observations and infos are laid out as Gymnasium's own ``SyncVectorEnv`` lays out those of N `EscapeRoom` with
    room indices 0, 1, ... in its same-step mode: where an episode ended, ``final_obs`` and ``final_info`` tell of its
    last step, and everything else of the new episode.

    Args:
        num_envs: N.
        meta: who picks the goals, as for `EscapeRoom`.
        pay: how the controller is paid.
        threads: most threads to step the rooms with.
        **settings: see `RoomSettings`.

    Attributes:
        complexity: the `ComplexityReport` of its goal graph.
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
        """Begin an episode in every room: the first one of a seed, or without a seed each room's next.

        Args:
            seed: 0 to 2**63 - 1; one for all rooms, whose indices make their episodes differ.
            options: ``{"complexity": True}`` puts the complexity report into the infos; other keys are ignored.
        """
        self.turns.reset(fresh_seed() if seed is None and not self._is_seeded else seed)
        self._is_seeded = True
        super().reset(seed=seed)
        self.turns.ask(self.meta)
        infos = self._infos(np.full(self.num_envs, NO_GOAL), np.zeros(self.num_envs, np.int64))
        if (options or {}).get("complexity"):
            infos["complexity"] = self.complexity.to_dict()
        return self._observations(), infos

    def step(self, actions: NDArray[np.integer]):
        """Act once in every room."""
        step = self.turns.step(actions)
        over = step.over
        infos = self._infos(np.where(over, NO_GOAL, step.events), np.where(over, 0, 1))
        if over.any():
            infos |= self._final_infos(step)
        self.turns.ask(self.meta)
        return self._observations(), step.rewards, step.terminated, step.truncated, infos

    def _observations(self) -> dict[str, NDArray]:
        return self.turns.controller_observations(self.turns.sight())

    def _infos(self, events: NDArray[np.integer], elapsed: NDArray[np.integer]) -> dict[str, Any]:
        infos = {"goal_event": events, "elapsed": elapsed, "illegal_actions": self.turns.ledger.illegal_actions.copy()}
        return _masked(infos, np.ones(self.num_envs, bool))

    def _final_infos(self, step: Step) -> dict[str, Any]:
        """What there is to say of the episodes that a step ended."""
        over = step.over
        info = {
            "goal_event": step.events,
            "elapsed": np.ones(self.num_envs, np.int64),
            "illegal_actions": step.illegal_actions,
            "success": step.terminated,
            "length": step.lengths,
            "shortest_length": step.shortest,
        }
        final_info = _masked(
            {name: np.where(over, values, np.zeros_like(values)) for name, values in info.items()}, over
        )
        final_obs = np.full(self.num_envs, None, object)
        ended = np.flatnonzero(over)
        observations = self.turns.controller_observations(self.turns.final_sight(step, ended))
        for m, n in enumerate(ended):
            final_obs[n] = {name: values[m] for name, values in observations.items()}
        return _masked({"final_obs": final_obs, "final_info": final_info}, over)


def _masked(infos: dict[str, Any], where: NDArray[np.bool_]) -> dict[str, Any]:
    """Infos with Gymnasium's entries that say which rooms they tell of."""
    return infos | {f"_{name}": where.copy() for name in infos}


def register_envs() -> None:
    """Register ``hierroom/EscapeRoom-{a..g}-v0``; ``import hierroom`` has done so."""
    for letter in NAMED_GRAPHS:
        gymnasium.register(
            f"hierroom/EscapeRoom-{letter}-v0",
            entry_point="hierroom.gym_env:EscapeRoom",
            vector_entry_point="hierroom.gym_env:EscapeRooms",
            kwargs={"graph": letter},
        )
