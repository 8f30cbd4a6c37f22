"""Two agents taking turns in N environments: the world, the ledger of the turns, and the agents' observations.

The AEC, parallel and Gymnasium environments and the trainer are views of this one class, so they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.controller import Observation, observation_spaces
from hierroom.support.arrays import ArrayPool, freeze, read_only
from hierroom.support.errors import InputError
from hierroom.turns.ledger import Ledger
from hierroom.turns.records import META, N_OUTCOMES, REWARDED, RULES, STEP, Step, clear_steps, ledger_schema
from hierroom.turns.rewards import make_reward
from hierroom.turns.situation import Situation
from hierroom.worlds.actions import actions_in
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.make import make_world
from hierroom.worlds.seeds import chosen_envs
from hierroom.worlds.world import Seeds


class Turns:
    """Two agents taking turns in N environments.

    Args:
        config: what the environments are made of.
        num_envs: N.
        seed: seed of the first episodes. None: call `reset` with a seed before the first step.
        autoreset: whether the next episode begins in the step that ends the last one.
        measure_shortest: whether to compute each episode's shortest length (about 10 microseconds in EscapeRooms).
        threads: most threads to step the world with.
        memories: what the world remembers of each episode, in addition to what the reward needs.

    Attributes:
        world: the `BaseWorld`.
        ledger: the state of the turns, a `Ledger`.
        reward: the controller's `ControllerReward`.
        action_kind: the kind of the controller's actions.
        actions: [N, ...] the controller's next actions, as `act` writes them.
        last_step: the last `Step`, or None before the first one after a reset.
        n_ended: number of environments in which the last step ended the episode.
    """

    def __init__(
        self,
        config: EnvConfig,
        num_envs: int = 1,
        *,
        seed: int | None = None,
        autoreset: bool = True,
        measure_shortest: bool = False,
        threads: int = 1,
        memories: Iterable[str] = (),
    ):
        horizon = config.subgoal_horizon
        given = None if config.reward is None else make_reward(config.reward, config.novelty_bonus)
        memories = *(given.memories if given else ()), *memories
        settings: dict[str, Any] = {"seed": seed, "autoreset": autoreset, "threads": threads, "memories": memories}
        self.world = world = make_world(config, num_envs, **settings)
        usual = "intrinsic" if len(world.goals) else "extrinsic"
        self.config, self.reward = (config, given) if given else (replace(config, reward=usual), make_reward(usual))
        if not len(world.goals) and {"n_first", "reached"} & self.reward.weights.keys():
            raise InputError(
                f"{self.reward.name} rewards goals, and {world.variants[0]} has none; give it the reward extrinsic"
            )
        self.action_kind = actions_in(world)
        self._n_codes = world.n_actions or 1  # see `DiscreteActions.codes`
        self.ledger = Ledger.at_reset(num_envs, self._n_codes)
        self.n_ended = 0
        self._steps = ArrayPool(self._empty_steps)
        self._written: np.ndarray | None = None  # the writable records of the last step
        self.last_step: Step | None = None
        self._n_goals = len(world.goals)
        self._rules = np.zeros(1, RULES)
        self._rules[0] = (
            self.reward.ends_with_option,
            np.iinfo(np.int64).max if horizon is None else int(horizon),
            self._n_codes,
            *(self.reward.weights.get(name, 0.0) for name in REWARDED),
            autoreset,
            world.goals.target,
        )
        self._keeps_states = self.reward.needs_states and world.state_after is not None
        self._autoreset, self._measure_shortest = autoreset, measure_shortest
        self._everywhere: NDArray[np.integer] = world.everywhere
        self._all_legal = np.ones((num_envs, world.n_actions), bool)
        self._all_legal.setflags(write=False)
        self.actions = np.zeros((num_envs, *self.action_kind.shape), self.action_kind.dtype)
        if world.has_begun:
            self._begin(self._everywhere)

    def __len__(self) -> int:
        return len(self._everywhere)

    def _empty_steps(self) -> tuple[tuple[Any, ...], None]:
        records = np.empty(len(self), STEP)
        shown = read_only(records)
        return (records, shown, Step(shown, self._n_goals)), None

    @property
    def goals(self) -> NDArray[np.integer]:
        """Goals [N] pursued now, or -1, in a new read-only array."""
        return freeze(self.ledger.goals.copy())

    def reset(self, seed: Seeds = None, envs: NDArray[np.integer] | None = None) -> None:
        """Begin the first episode of a seed, or without a seed the next one, in some environments.

        Args:
            seed: one for all of them, or a sequence with a seed or None for each.
            envs: [M] their indices; None: all.
        """
        chosen = self._everywhere if envs is None else chosen_envs(envs, len(self))
        self.world.reset(seed, chosen)
        if envs is None:
            self.last_step = None
        self._begin(chosen)

    def _begin(self, envs: NDArray[np.integer]) -> None:
        self.ledger.begin_episodes(envs)
        if self._measure_shortest:
            self.ledger.write_fields({"shortest": self.world.shortest_lengths(envs)}, envs)

    def due(self, agent: str) -> NDArray[np.integer]:
        """Return the environments [M] in which an agent acts now; the controller acts everywhere."""
        return np.flatnonzero(self.ledger.is_meta_turn) if agent == META else self._everywhere

    def observe(self, agent: str, envs: NDArray[np.integer]) -> Observation:
        """Return an agent's observations in environments [M], in new arrays; for the meta-controller a `Situation`."""
        if agent == META:
            return self.situation(envs)
        ledger = self.ledger.records.take(envs)
        ledger.setflags(write=False)
        given = ledger["goals"], ledger["previous_actions"], ledger["last_outcomes"]
        return Observation(envs, self.world.observe(envs), self.world.goals, *given, self.action_masks(envs))

    def action_masks(self, envs: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return the controller's legal actions in environments [M], [M, A]; read-only, or a copy."""
        masks = self.world.action_masks
        return self._all_legal[: len(envs)] if masks is None else masks.take(envs, axis=0)

    def act(self, agent: str, observation: Observation, actions: ArrayLike) -> None:
        """Take an agent's turn, given its observation of M environments and its actions [M, ...] (see `choose`).

        The meta-controller's goals take effect immediately, the controller's actions at the next `step`.
        """
        if isinstance(observation, Situation):
            self.choose(observation, actions)
        else:
            self.actions[observation.envs] = self.action_kind.read(actions, len(observation))

    def situation(self, envs: NDArray[np.integer]) -> Situation:
        """Return all facts for meta-controllers of environments [M]. All arrays are copies; masks are read-only.

        Where the meta-controller has a turn, ``masks`` marks the goals that the goal mask allows; elsewhere only 'no
        goal' is legal. `choose` checks goals against ``masks``.
        """
        ledger, view, goals = self.ledger, self.world.exact_view(envs), self.world.goals
        meta_turns = ledger.meta_turns[envs]
        masks = self.world.legal_goals(self.config.goal_mask, ledger.is_meta_turn[envs], view)
        masks.setflags(write=False)
        given = ledger.last_goals[envs], ledger.previous_actions[envs], ledger.last_outcomes[envs]
        return Situation(envs, view, goals, *given, masks, meta_turns, view.uniforms(meta_turns, goals.n_choices))

    def choose(self, situation: Situation, actions: ArrayLike) -> None:
        """Take the meta-controller's turn where it has one, in M environments.

        Actions are goal ids [M], or no goal (G or -1); illegal ones act as no goal and are counted.
        """
        envs = situation.envs
        goals, is_legal = situation.validate_goals(actions)
        self.ledger.count_illegal_goals(envs, ~is_legal)
        is_turn = self.ledger.is_meta_turn[envs]
        self.ledger.begin_options(envs[is_turn], goals[is_turn])

    def choose_everywhere(self, actions: NDArray[np.int64]) -> None:
        """Take the meta-controller's turn wherever it has one, without a `Situation`: see `kernels.take_goals`."""
        self.ledger.take_goals(self.meta_masks(), actions)

    def meta_masks(self) -> NDArray[np.bool_]:
        """Return the meta-controller's legal choices [N, G + 1]; where it has no turn, only 'no goal' is legal."""
        return self.world.legal_goals(self.config.goal_mask, self.ledger.is_meta_turn)

    def step(self, actions: ArrayLike | None = None) -> Step:
        """Take the controller's turn everywhere; where the meta-controller has not chosen, no goal is pursued.

        Actions are whole numbers [N] or arrays [N, ...], by default those given to `act`. One that does not apply only
        costs the step.
        """
        world, reward = self.world, self.reward
        if not world.has_begun:
            raise InputError("reset the environment before its first step")
        taken = self.actions if actions is None else self.action_kind.read(actions, len(self._everywhere))
        if (masks := world.action_masks) is not None:  # a forbidden action does not exist now
            is_legal = self.action_kind.are_legal(taken)
            is_legal &= masks[self._everywhere, np.where(is_legal, taken, 0)]
            taken = np.where(is_legal, taken, -1)
        before = freeze(world.get_state()) if self._keeps_states else None
        outcomes = world.step(taken)
        self._written = self.last_step = None  # frees them for the next step
        records, _, step = self._steps.take()[0]
        if world.n_actions:
            self.n_ended = self.ledger.record(outcomes, taken, records, self._rules)
        else:
            self.n_ended = self.ledger.record(outcomes, self.action_kind.codes(taken), records, self._rules)
            step.taken = freeze(taken.copy())
        self._written, self.last_step = records, step
        if reward.custom is not None:
            step.before, step.after = before, None if before is None else freeze(world.state_after(before, taken))
            records["rewards"] = reward.of(step)
        if self.n_ended and self._autoreset and self._measure_shortest:
            begun = np.flatnonzero(records["episode_ended"])
            self.ledger.write_fields({"shortest": world.shortest_lengths(begun)}, begun)
        return step

    def reset_ended(self, envs: NDArray[np.integer]) -> None:
        """Begin the next episode in environments [M] that had ended before the last step; clear the step's records."""
        assert self._written is not None
        self.world.reset(None, envs)
        self._begin(envs)
        clear_steps(self._written, envs, self._n_codes, self.ledger.shortest[envs])

    def final_observation(self, agent: str, step: Step, envs: NDArray[np.integer]) -> Observation:
        """Return an agent's observations of environments [M] right after a step, before a reset or the next goal.

        Where the step ended an option, this is the option's last observation and has its goal.
        """
        goals = self.world.goals
        if agent == META:
            masks = np.zeros((len(envs), goals.n_choices), bool)
            masks[:, goals.no_goal_action] = True
        else:
            masks = self._all_legal[: len(envs)]
        view = self.world.last_view(envs, step.episode_ended[envs])
        outcomes = np.where(step.option_ended[envs], step.outcomes[envs], self.ledger.last_outcomes[envs])
        return Observation(envs, view, goals, step.goals[envs], step.records["actions"][envs], outcomes, masks)

    def observation_space(self, agent: str) -> spaces.Dict:
        """Return a new space of an agent's observations of one environment, as `Observation.as_dict` gives them.

        Each space samples from its own random generator, so no two environments or agents share one.
        """
        world, goals = deepcopy(self.world.observation_spaces), self.world.goals
        if agent == META:
            outcome = {"outcome": spaces.Discrete(N_OUTCOMES)}
            return spaces.Dict({**observation_spaces(world, goals, goals.n_choices), **outcome})
        return spaces.Dict(observation_spaces(world, goals, self.world.n_actions))

    def action_space(self, agent: str) -> spaces.Space:
        """Return a new space of an agent's actions."""
        return spaces.Discrete(self.world.goals.n_choices) if agent == META else self.action_kind.new_space()

    def get_state(self, envs: NDArray[np.integer] | None = None) -> dict[str, np.ndarray]:
        """Return the ledger's fields and the world's arrays in environments [M], all by default, as fresh arrays."""
        chosen = self._everywhere if envs is None else envs
        records = self.ledger.records[chosen]
        return {**{name: records[name].copy() for name in records.dtype.names or ()}, **self.world.get_arrays(chosen)}

    def set_state(self, state: Mapping[str, np.ndarray]) -> None:
        """Restore a state from `get_state` of as many environments of the same kind."""
        names = self.ledger.records.dtype.names or ()
        ledger = {name: state[name] for name in names if name in state}
        world = {name: array for name, array in state.items() if name not in names}
        if len(ledger) < len(names) or world.keys() != self.world.get_arrays(self._everywhere).keys():
            raise InputError(f"the state of turns does not hold what get_state gives, but {', '.join(map(str, state))}")
        ledger_schema(len(self), len(self.world.goals), self._n_codes).check(ledger, "turns")
        self.world.set_arrays(world)
        self.ledger.write_fields(ledger)
        self.last_step = None

    @property
    def can_split(self) -> bool:
        """Return whether environments are independent: not linked by curriculum stages or a custom reward."""
        return self.world.can_split and self.reward.custom is None

    def subset(self, envs: NDArray[np.integer]) -> Turns:
        """Return a copy of some of these environments [M], if `can_split`; they continue as in the full batch."""
        subset = Turns(self.config, len(envs), autoreset=self._autoreset, measure_shortest=self._measure_shortest)
        subset.set_state(self.get_state(envs))
        return subset
