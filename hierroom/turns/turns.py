"""Two agents taking turns in N environments: the world, the ledger of the turns, and what either agent observes.

The AEC, parallel and Gymnasium environments and the trainer are views of this one class, so they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hierroom.complexity.report import ComplexityReport, analyze
from hierroom.controller import Observation, observation_spaces
from hierroom.goals import NO_GOAL
from hierroom.meta import MetaController, NoGoals, choose_goals
from hierroom.support.errors import InputError
from hierroom.turns.kernels import KERNEL_REWARDS, OWN_REWARD
from hierroom.turns.ledger import META, Ledger, Transition, reset_values, transitions
from hierroom.turns.records import N_OUTCOMES, Step
from hierroom.turns.rewards import make_reward
from hierroom.turns.situation import GOAL_MASKS, N_META_ACTIONS, NO_GOAL_ACTION, Situation
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.engine import Seeds, World, whole_numbers
from hierroom.worlds.escape_room.graph_sampler import GraphSampler
from hierroom.worlds.escape_room.layout import State
from hierroom.worlds.escape_room.oracle import shortest_lengths
from hierroom.worlds.escape_room.random_kernels import turn_uniforms


class Turns:
    """Two agents taking turns in N environments.

    Args:
        config: what the environments are made of.
        num_envs: N.
        seed: of their first episodes; None makes no level yet: call `reset` with a seed first.
        autoreset: whether an environment whose episode ends begins its next one in the same step.
        measure_shortest: whether each episode's shortest length is found (about a millisecond an episode).
        threads: most threads to step the world with.
        memories: what levels remember of their episode beside what the reward needs, names in `layout.MEMORIES`.

    Attributes:
        config: what the environments are made of.
        world: the environments.
        sampler: which goal graphs they play, and the curriculum.
        ledger: who is to act in each environment, and what else there is to know of the turns.
        reward: how the controller is rewarded.
        last_step: what the last step did, or None before the first one since a reset.
        n_ended: in how many environments it ended the episode.
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
        self.config, horizon = config, config.subgoal_horizon
        self.sampler = GraphSampler(config.graph, config.exclude, config.drop_key, num_envs, config.curriculum_stages)
        name = "intrinsic" if config.reward is None else config.reward
        self.reward = make_reward(name, config.novelty_bonus)
        self.world = world = World(
            self.sampler.graphs,
            num_envs,
            size=config.size,
            max_steps=config.max_steps,
            drop_key=config.drop_key,
            seed=seed,
            first_index=config.env_index,
            threads=threads,
            memories=(*self.reward.memories, *memories),
            levels=config.levels,
        )
        self.ledger = Ledger.at_reset(len(world), world.n_actions)
        self.last_step: Step | None = None
        self.n_ended = 0
        self._subgoal_horizon = np.iinfo(np.int64).max if horizon is None else int(horizon)
        self._goal_mask = GOAL_MASKS[config.goal_mask]
        self._kernel_reward = KERNEL_REWARDS.get(name, OWN_REWARD) if isinstance(name, str) else OWN_REWARD
        self._autoreset, self._has_stages = autoreset, self.sampler.n_stages > 1
        self._measure_shortest = measure_shortest
        self._step_world = world.step if autoreset else world.step_within_episode
        self._finals = world.finals if autoreset else world.state.levels
        self._everywhere = np.arange(len(world))
        self._all_legal = np.ones((len(world), world.n_actions), bool)
        for shared in (self._everywhere, self._all_legal):
            shared.setflags(write=False)
        self._actions, self._no_goals = np.zeros(len(world), np.int64), np.full(len(world), NO_GOAL)
        if world.has_begun:
            self._begin(self._everywhere)

    def __len__(self) -> int:
        return len(self.world)

    @property
    def goals(self) -> NDArray[np.integer]:
        """[N] int, the goal ids pursued now, or -1."""
        return self.ledger.goals

    @property
    def complexity(self) -> ComplexityReport:
        """How hard the environments are to explore; of several goal graphs, the hardest."""
        return analyze(self.sampler.everything[-1], drop_key=self.world.n_actions == 6)

    def reset(self, seed: Seeds = None, envs: NDArray[np.integer] | None = None) -> None:
        """Begin an episode in some environments: the first one of a seed, or without a seed each one's next.

        A curriculum stays in the stage it is in, so that a seed fixes the levels of that stage.

        Args:
            seed: one for all of them, or one or None for each of them.
            envs: [M] which; None: all.
        """
        is_of_all, envs = envs is None, self._everywhere if envs is None else envs
        self.world.reset(seed, envs)
        if is_of_all:
            self.last_step = None
        self.sampler.reset(envs)
        self._begin(envs)

    def _begin(self, envs: NDArray[np.integer]) -> None:
        self.ledger.put(reset_values(self.world.n_actions), envs)
        if self._measure_shortest:
            self._measure(envs)

    def _measure(self, envs: NDArray[np.integer]) -> None:
        state = self.world.state if envs is self._everywhere or len(self) == 1 else self.world.get_state(envs)
        self.ledger.shortest[envs] = shortest_lengths(state)

    def due(self, agent: str) -> NDArray[np.integer]:
        """[M] the environments in which an agent is to act now; the controller follows the meta-controller everywhere.

        Args:
            agent: ``"meta_0"`` or ``"controller_0"``.
        """
        return np.flatnonzero(self.ledger.is_meta_turn) if agent == META else self._everywhere

    def observe(self, agent: str, envs: NDArray[np.integer]) -> Observation:
        """What an agent observes now.

        Args:
            agent: ``"meta_0"`` or ``"controller_0"``.
            envs: [M] the environments; where they are all there are, the next step overwrites the arrays.

        Returns:
            an `Observation`, for the meta-controller a `Situation`.
        """
        return self.situation(envs) if agent == META else self._observation(envs)

    def act(self, agent: str, observation: Observation, actions: ArrayLike) -> None:
        """Take an agent's turn: the meta-controller's goals hold at once, the controller's actions at `advance`.

        Args:
            agent: ``"meta_0"`` or ``"controller_0"``.
            observation: what `observe` gave, of M environments.
            actions: [M] whole numbers; see `choose`.
        """
        if isinstance(observation, Situation):
            self.choose(observation, actions)
        else:
            self._actions[observation.envs] = whole_numbers(actions, len(observation))

    def advance(self) -> dict[str, Transition]:
        """Take the primitive step that the agents' actions ask for; returns the turns that it ended, by agent."""
        step = self.step(self._actions)
        return transitions(step, lambda agent, envs: self.final_observation(agent, step, envs))

    def situation(self, envs: NDArray[np.integer]) -> Situation:
        """What meta-controllers may know of some environments [M]. All arrays are copies; ``masks`` is read-only.

        Where it is the meta-controller's turn, ``masks`` has the goals that the goal mask allows; elsewhere it can only
        wait. `choose` checks the goals by them.
        """
        levels, ledger = self.world.state.levels[envs], self.ledger
        meta_turns = ledger.meta_turns[envs]
        masks = self._goal_mask.masks(levels, ledger.is_meta_turn[envs])
        uniforms = np.empty(masks.shape)
        masks.setflags(write=False)
        turn_uniforms(levels, meta_turns, uniforms)
        tiles, grids = self.world.outcomes["tiles"][envs], self.world.state.grids[envs]
        told = ledger.last_goals[envs], ledger.previous_actions[envs], ledger.last_outcomes[envs]
        return Situation(envs, tiles, levels, *told, masks, grids, meta_turns, uniforms)

    def choose(self, situation: Situation, actions: ArrayLike) -> None:
        """Take the meta-controller's turn; in environments where it is not its turn, nothing happens.

        Args:
            situation: of M environments.
            actions: [M] whole numbers: goal ids, or no goal (13 or -1); one that is not legal counts as no goal, and
                the ledger counts it.
        """
        envs = situation.envs
        goals, is_legal = situation.chosen(actions)
        self.ledger.illegal_goals[envs] += ~is_legal
        is_turn = self.ledger.is_meta_turn[envs]
        self.ledger.begin_options(envs[is_turn], goals[is_turn])

    def choose_everywhere(self, actions: NDArray[np.int64]) -> None:
        """Take the meta-controller's turn in every environment where it has one, without a look at the situation.

        Args:
            actions: [N] int64, goal ids or no goal (13 or -1), as for `choose`.
        """
        self.ledger.choose(self.world.state.levels, self._goal_mask.kind, actions)

    def meta_masks(self) -> NDArray[np.bool_]:
        """[N, 14] the meta-controller's legal actions everywhere; where it has no turn it can only wait."""
        return self._goal_mask.masks(self.world.state.levels, self.ledger.is_meta_turn)

    def ask(self, meta: MetaController) -> None:
        """Let a meta-controller take its turn in every environment where it is due."""
        if type(meta) is NoGoals:
            self.choose_everywhere(self._no_goals)
            return
        due = self.due(META)
        if len(due):
            situation = self.situation(due)
            self.choose(situation, choose_goals(meta, situation))

    def step(self, actions: ArrayLike) -> Step:
        """Take the controller's turn everywhere; where the meta-controller has not chosen there is no goal.

        Args:
            actions: [N] whole numbers; one that does not apply only costs the step.
        """
        if not self.world.has_begun:
            raise InputError("reset the environment before its first step")
        actions = self.world.as_actions(actions)
        had_ended = None if not self._has_stages else self.world.state.levels["has_ended"].copy()
        before = self.world.get_state() if self.reward.needs_states else None
        records, self.n_ended = self.ledger.record(
            actions,
            self._step_world(actions),
            return_ends_with_option=self.reward.ends_with_option,
            subgoal_horizon=self._subgoal_horizon,
            n_actions=self.world.n_actions,
            reward=self._kernel_reward,
            novelty_bonus=self.config.novelty_bonus,
            autoreset=self._autoreset,
        )
        step = Step(records, before, None if before is None else self.world.state_after(before, actions))
        if self._kernel_reward == OWN_REWARD:
            self.reward.write(step)
        if self.n_ended and self._autoreset and self._measure_shortest:
            self._measure(np.flatnonzero(step.episode_ended))
        if had_ended is not None and self.sampler.add(step.episode_ended & ~had_ended, step.terminated & ~had_ended):
            self.world.set_graphs(self.sampler.graphs)
        self.last_step = step
        return step

    def begin_instead(self, envs: NDArray[np.integer]) -> None:
        """Begin the next episode in environments [M] that had ended before the last step, which then tells of none."""
        assert self.last_step is not None
        self.reset(None, envs)
        self.last_step.clear(envs, self.world.n_actions, self.ledger.shortest[envs])

    def final_observation(self, agent: str, step: Step, envs: NDArray[np.integer]) -> Observation:
        """What an agent observes of some environments [M] right after a step, before a reset or the next goal.

        Where the step ended an option it is what either agent observes last in it, with the goal of that option.
        """
        ended, outcomes = step.episode_ended[envs], self.world.outcomes
        if ended.all():
            tiles, levels = outcomes["final_tiles"][envs], self._finals[envs]
        else:
            tiles, levels = outcomes["tiles"][envs], self.world.state.levels[envs]
            tiles[ended], levels[ended] = outcomes["final_tiles"][envs[ended]], self._finals[envs[ended]]
        if agent == META:
            masks = np.zeros((len(envs), N_META_ACTIONS), bool)
            masks[:, NO_GOAL_ACTION] = True
        else:
            masks = self._all_legal[: len(envs)]
        outcomes_seen = np.where(step.option_ended[envs], step.outcomes[envs], self.ledger.last_outcomes[envs])
        return Observation(envs, tiles, levels, step.goals[envs], step.actions[envs], outcomes_seen, masks)

    def observation_space(self, agent: str) -> spaces.Dict:
        """The space of an agent's observations of one environment, as `Observation.as_dict` gives them."""
        if agent == META:
            return spaces.Dict({**observation_spaces(N_META_ACTIONS), "outcome": spaces.Discrete(N_OUTCOMES)})
        return spaces.Dict(observation_spaces(self.world.n_actions))

    def action_space(self, agent: str) -> spaces.Discrete:
        """The actions of an agent."""
        return spaces.Discrete(N_META_ACTIONS if agent == META else self.world.n_actions)

    def get_state(self) -> dict[str, np.ndarray]:
        """Everything that changes, as fresh arrays: the world's state, the ledger's and the curriculum's."""
        state = self.world.get_state()
        return {**self.ledger.get_state(), **self.sampler.get_state(), "grids": state.grids, "levels": state.levels}

    def set_state(self, state: Mapping[str, np.ndarray]) -> None:
        """Go back to a state taken earlier with `get_state`."""
        ledger, sampler = dict(state), self.sampler.get_state()
        if ledger.keys() != {*self.ledger.get_state(), *sampler, "grids", "levels"}:
            raise InputError(f"the state of turns does not hold what get_state gives, but {', '.join(map(str, state))}")
        world_state = State(ledger.pop("grids"), ledger.pop("levels"))
        self.world.check_state(world_state)
        self.sampler.check_state(sampler_state := {name: ledger.pop(name) for name in sampler}, world_state.levels)
        self.ledger.schema(self.world.n_actions).check(ledger, "turns")
        self.world.set_state(world_state)
        self.sampler.set_state(sampler_state)
        self.world.set_graphs(self.sampler.graphs)
        self.ledger.put(ledger)
        self.last_step = None

    @property
    def can_part(self) -> bool:
        """Whether no environment depends on others, by stages of a curriculum or a reward of the user's own."""
        return not self._has_stages and self._kernel_reward != OWN_REWARD

    def part(self, envs: NDArray[np.integer]) -> Turns:
        """A copy of some of these environments [M], where `can_part`; they go on as they would beside the others."""
        part = Turns(self.config, len(envs), autoreset=self._autoreset, measure_shortest=self._measure_shortest)
        state = self.get_state()
        shared = {"curriculum": state.pop("curriculum")}
        part.set_state({name: array[envs] for name, array in state.items()} | shared)
        return part

    def _observation(self, envs: NDArray[np.integer]) -> Observation:
        where = slice(None) if envs is self._everywhere or len(self) == 1 else envs
        ledger, tiles, levels = self.ledger, self.world.outcomes["tiles"][where], self.world.state.levels[where]
        told = ledger.goals[where], ledger.previous_actions[where], ledger.last_outcomes[where]
        return Observation(envs, tiles, levels, *told, self._all_legal[: len(envs)])
