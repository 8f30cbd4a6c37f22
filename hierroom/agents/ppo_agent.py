"""The learning agent: recurrent PPO on its own turns, as controller or meta-controller."""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.agents.curiosity import Curiosity
from hierroom.agents.features import Features
from hierroom.agents.scripted_agent import WarmUp
from hierroom.controller import Observation
from hierroom.learners.policy import Decision, Policy
from hierroom.learners.ppo import UPDATE_STATISTICS, Learner
from hierroom.support.cells import join_names
from hierroom.support.errors import InputError, shown, warn_once
from hierroom.support.schema import ANY_MAPPING, Exactly, Real, Table
from hierroom.turns.records import Step
from hierroom.turns.situation import Situation
from hierroom.turns.turns import Turns

_BY_NUMBER = {"symbol", "goal-status", "goal-outcome"}
"""Features that know the goals of a task by their numbers only."""


class PPOAgent:
    r"""Acts by recurrent PPO, and learns from its own turns.

    A controller's turn is one primitive step; a meta-controller's is an option, which may last many. A turn of k steps
    that began at step t is rewarded (for the meta-controller, with the environment's own reward f)

    .. math::  F_t = \sum_{i=0}^{k-1} f_{t+i}

    and later rewards are discounted by :math:`\gamma^k`. The recurrent state changes only at the agent's own turns. So
    for a meta-controller "this key was tried in vain" is a few turns ago, not hundreds of steps.

    Args:
        features: the features that its network reads.
        learner: the learner of its policy, with the same number of environments.
        network: the name of its network; a warm start checks with it that weights fit.
        warm_up: chooses actions until it ends; None: the agent learns from the first turn on.
        curiosity: adds its rewards to the controller's; None: no such rewards.
    """

    def __init__(
        self,
        features: Features,
        learner: Learner,
        *,
        network: str,
        warm_up: WarmUp | None = None,
        curiosity: Curiosity | None = None,
    ) -> None:
        self.features = features
        self.learner = learner
        self.curiosity = curiosity
        self._network = network
        self._warm_up = warm_up
        self._updated = dict.fromkeys((*UPDATE_STATISTICS, *(curiosity.STATISTICS if curiosity else ())), float("nan"))

    @property
    def is_learning(self) -> bool:
        """Return whether its warm-up, if it has one, has ended."""
        return self._warm_up is None or self._warm_up.has_ended

    @property
    def ready(self) -> bool:
        """Return whether it has taken enough turns for an `update`."""
        return self.learner.ready

    def act(self, observation: Observation) -> NDArray:
        """Begin turns: return legal actions [M, ...] in the environments of an observation."""
        if self._warm_up is not None and not self.is_learning:
            assert isinstance(observation, Situation)  # only meta-controllers warm up
            return self._warm_up.choose(observation)
        drawn = self.learner.act(observation.envs, self.features.encode(observation), observation.masks)
        return self.features.actions.of_policy(drawn)

    def record(self, step: Step, turns: Turns) -> None:
        """Record the turns that a primitive step ended."""
        if self._warm_up is not None and not self.is_learning:
            self._warm_up.add(step)
            return
        agent = self.features.agent
        envs, rewards, elapsed, terminated, truncated = step.ended_turns(agent)
        if self.curiosity is not None:
            rewards = rewards + self.curiosity.weighted(turns.final_observation(agent, step, envs))
        ours = np.flatnonzero(self.learner.has_begun[envs])  # turns begun in the warm-up are not the learner's
        envs, truncated = envs[ours], truncated[ours]
        last = self.features.encode(turns.final_observation(agent, step, envs[truncated])) if truncated.any() else None
        ended = step.episode_ended[envs]
        self.learner.finish(envs, rewards[ours], elapsed[ours], terminated[ours], truncated, ended, last)

    def update(self, observation: Observation, progress: float) -> None:
        """Learn from the turns taken, given the observation of the next turn and the progress of training, 0 to 1."""
        self.learner.bootstrap(observation.envs, self.features.encode(observation))
        was_inside, self._updated = not self.learner.outside, self.learner.update(progress)
        if was_inside and self.learner.outside:
            column, value = self.learner.outside
            name, world = self.features.name_at(column), self.features.world.config.task
            warn_once(f"the observations of {world} leave the bounds of {name!r}, with {value:g}")
        if self.curiosity is not None:
            self._updated |= self.curiosity.learn()

    @property
    def statistics(self) -> dict[str, float]:
        """Numbers for the metrics: those of the last update, and with a warm-up whether it has ended."""
        learning = {} if self._warm_up is None else {"is_learning": float(self._warm_up.has_ended)}
        return {**learning, **self._updated}

    def frozen(self, num_envs: int, *, seed: int, is_greedy: bool = False) -> FrozenAgent:
        """Return the trained agent for other environments, where it does not learn: see `FrozenAgent`."""
        return FrozenAgent(self.features, self.learner.policy(num_envs, seed=seed), is_greedy=is_greedy)

    @property
    def weights(self) -> dict[str, Any]:
        """The part of its `state_dict` that `take_weights` uses, in copies."""
        network = {name: tensor.detach().clone() for name, tensor in self.learner.network.state_dict().items()}
        return {"description": self._description, "learner": {"backend": {"network": network}}}

    def take_weights(self, state: dict[str, Any]) -> None:
        """Load only the weights from another agent's `state_dict`."""
        for name in ("description", "learner"):
            ANY_MAPPING.check(state.get(name), name)
        for what, ours in self._description.items():
            theirs = state["description"].get(what)
            if ours != theirs:
                found = " ".join(theirs.split()) if isinstance(theirs, str) else shown(theirs)
                raise InputError(f"these weights belong to another agent, with {what} {found}, not {ours}")
        self.learner.take_weights(state["learner"])

    @property
    def _description(self) -> dict[str, str | int]:
        description = {
            "network": self._network,
            "hidden_size": self.learner.config.hidden_size,
            "number of actions": self.learner.space.n_actions,
            "features": join_names(self.features.names, " "),
        }
        if (actions := self.features.actions).kind != "discrete":
            description["actions"] = " ".join(map(str, (actions.kind, *actions.sizes)))
        world = self.features.world
        if world.config.task is None or not _BY_NUMBER & {*self.features.names}:
            return description
        return {**description, "goals": join_names(world.goals.names, ", ")}

    def state_dict(self) -> dict[str, Any]:
        """Return the complete state, as tensors and plain types."""
        known = {name: float(value) for name, value in self._updated.items() if not isnan(value)}
        state: dict[str, Any] = {"description": self._description, "learner": self.learner.state_dict()}
        state["statistics"] = known  # rows are also written between two updates of a meta-controller
        if self._warm_up is not None:
            state["warm_up"] = self._warm_up.state_dict()
        if self.curiosity is not None:
            state["curiosity"] = self.curiosity.state_dict()
        return state

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        parts = {"learner": self.learner, "warm_up": self._warm_up, "curiosity": self.curiosity}
        restored = {name: part for name, part in parts.items() if part is not None}
        description = Table({what: Exactly(ours) for what, ours in self._description.items()})
        statistics = Table(dict.fromkeys(self._updated, Real()), optional=self._updated)
        rest = dict.fromkeys(restored, ANY_MAPPING)
        Table({"description": description, "statistics": statistics, **rest}).check(state, "agent")
        for name, part in restored.items():
            part.load_state_dict(state[name])
        if not self.is_learning and self.learner.has_begun.any():
            raise InputError("the learner cannot be in a turn before its warm-up has ended")
        self._updated = dict.fromkeys(self._updated, float("nan")) | state["statistics"]


class FrozenAgent:
    """Acts with a policy and does not learn.

    If ``is_greedy``, it takes its most probable action instead of sampling. A policy that always escapes when it
    samples may then turn on the spot for ever.
    """

    def __init__(self, features: Features, policy: Policy, *, is_greedy: bool = False) -> None:
        self.features = features
        self._policy, self._is_greedy = policy, is_greedy
        self._act = policy.act_greedily if is_greedy else policy.act

    @property
    def decision(self) -> Decision | None:
        """Return the policy's outputs for the last turn; None before the first."""
        return self._policy.decision

    def act(self, observation: Observation) -> NDArray:
        """Return legal actions [M, ...] in the environments of an observation."""
        drawn = self._act(observation.envs, self.features.encode(observation), observation.masks)
        return self.features.actions.of_policy(drawn)

    def record(self, step: Step, turns: Turns) -> None:
        """Reset the recurrent states where a primitive step ended an episode."""
        if turns.n_ended:
            self.forget(np.flatnonzero(step.episode_ended))

    def forget(self, envs: NDArray[np.integer]) -> None:
        """Reset the recurrent states of environments [M]."""
        self._policy.reset(envs)

    def subset(self, envs: NDArray[np.integer]) -> FrozenAgent:
        """Return the agent for some of its environments [M], to use instead of this one; see `Policy.subset`."""
        return FrozenAgent(self.features, self._policy.subset(envs), is_greedy=self._is_greedy)
