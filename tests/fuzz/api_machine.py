"""A state machine that plays the AEC and the parallel environment side by side, in any order of calls.

Both are given the same seeds and actions, legal or not, are reset, copied, pickled, drawn and closed at any moment;
after each call both must agree, and what PettingZoo and our own docstrings promise must hold.
"""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import note
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import hierroom
from hierroom.support.errors import InputError
from hierroom.turns.records import AGENTS, CONTROLLER, META
from hierroom.worlds.escape_room.oracle import shortest_actions

INFO_KEYS = {"goal_event", "elapsed", "illegal_actions", "success", "length", "shortest_length"}
NO_GOAL_ACTION = 13
GRAPHS = ("a", "b", "c", "d", "e", "f", "g", "rooms:3", ["a", "rooms:7"], hierroom.GoalGraph((0, 1, 1), 3))
CONFIGS = st.fixed_dictionaries(
    {
        "graph": st.sampled_from(GRAPHS),
        "size": st.sampled_from((11, 12, 19)),
        "max_steps": st.sampled_from((1, 2, 7, 30, 200)),
        "drop_key": st.booleans(),
        "reward": st.sampled_from(("extrinsic", "bonus", "intrinsic", "novelty")),
        "subgoal_horizon": st.sampled_from((None, 1, 5)),
        "goal_mask": st.sampled_from(("reachable", "existing", "seen", "none")),
        "levels": st.sampled_from((None, "training", "evaluation")),
        "env_index": st.sampled_from((0, 3)),
        "render_mode": st.sampled_from((None, "ansi", "rgb_array")),
    }
)
SEEDS = st.sampled_from((0, 1, 7, 2**63 - 1, np.int64(5)))
OPTIONS = st.sampled_from((None, {}, {"complexity": True}, {"colour": "mauve"}, {"complexity": False}))
HUGE = (2**31, 2**63 - 1, 2**63, -(2**63), 10**30, np.uint64(2**64 - 1))
CHOICES = st.one_of(st.integers(-2, 15), st.integers(0, 13).map(np.int32), st.sampled_from(HUGE))
ACTIONS = st.one_of(st.integers(0, 5), st.integers(-2, 8), st.integers(0, 5).map(np.int32), st.sampled_from(HUGE))
NOT_ACTIONS = st.sampled_from((None, 0.5, "1", True, [0], np.array([0, 1]), {}, float("nan")))


class Faces(RuleBasedStateMachine):
    """The AEC and the parallel environment of one config."""

    @initialize(config=CONFIGS, is_wrapped=st.booleans(), seed=SEEDS, options=OPTIONS)
    def make(self, config: dict[str, Any], is_wrapped: bool, seed: int, options: dict | None) -> None:
        """Make both, and begin, half the time with PettingZoo's own checks around."""
        self.config = config
        self.aec = (hierroom.env if is_wrapped else hierroom.raw_env)(**config)
        self.parallel = hierroom.parallel_env(**config)
        self.is_wrapped = is_wrapped
        self.left: list[tuple[Any, dict[str, np.ndarray]]] = []
        self.spaces = [env.action_space(agent) for env in (self.aec, self.parallel) for agent in AGENTS]
        with pytest.raises(InputError):
            self.parallel.step(dict.fromkeys(AGENTS, 0))
        self.reset(seed, options)

    @rule(seed=st.none() | SEEDS, options=OPTIONS)
    def reset(self, seed: int | None, options: dict | None) -> None:
        """Begin an episode at any moment: the first one of a seed, or the next one."""
        self.aec.reset(seed=seed, options=options)
        self.observations, infos = self.parallel.reset(seed=seed, options=options)
        extra = {"complexity"} if options and options.get("complexity") else set()
        for agent in AGENTS:
            assert infos[agent].keys() == INFO_KEYS | extra
            assert self.aec.infos[agent] == infos[agent]
        self.n_steps = self.n_option_steps = 0
        self.totals = dict.fromkeys(AGENTS, 0.0)  # of all rewards of the episode
        self.received = dict.fromkeys(AGENTS, 0.0)  # what `last` told on each of the agent's turns
        self.n_illegal = {env: dict.fromkeys(AGENTS, 0) for env in ("aec", "parallel")}

    @property
    def has_ended(self) -> bool:
        """Whether the episode has."""
        return not self.parallel.agents

    @precondition(lambda self: not self.has_ended)
    @rule(choice=CHOICES, off_turn=st.just(NO_GOAL_ACTION) | CHOICES, action=ACTIONS)
    def step(self, choice: int, off_turn: int, action: int) -> None:
        """A primitive step, in the AEC environment with a turn of the meta-controller before it where it has one."""
        is_turn = self.aec.agent_selection == META
        if is_turn:
            self._take_turn(META, choice)
        self._take_turn(CONTROLLER, action)
        given = choice if is_turn else off_turn
        mask = self.observations[META]["action_mask"]
        self.n_illegal["parallel"][META] += not _is_goal_legal(given, mask)
        self.n_illegal["parallel"][CONTROLLER] += not 0 <= action < len(self.observations[CONTROLLER]["action_mask"])
        before = self.parallel.agents
        told = self.parallel.step({CONTROLLER: action, META: given})
        self.observations, self.rewards, terminations, truncations, infos = told
        assert all(set(one) == set(before) for one in told)
        assert self.rewards == self.aec.rewards
        assert (terminations, truncations) == (self.aec.terminations, self.aec.truncations)
        self.n_steps, self.n_option_steps = self.n_steps + 1, self.n_option_steps + 1
        for agent in AGENTS:
            self.totals[agent] += self.rewards[agent]
            info, counted = infos[agent], {"illegal_actions": self.n_illegal["parallel"][agent]}
            assert info.keys() == INFO_KEYS
            assert self.aec.infos[agent] == info | {"illegal_actions": self.n_illegal["aec"][agent]}
            assert info == info | counted | {"length": self.n_steps, "success": terminations[agent]}
            assert info["elapsed"] == (self.n_option_steps if agent == META else 1)
            assert type(terminations[agent]) is type(truncations[agent]) is bool
        assert terminations[META] == terminations[CONTROLLER] == bool(self.rewards[META])
        assert truncations[META] == (self.n_steps == self.config["max_steps"])
        assert self.has_ended == (terminations[META] or truncations[META])
        if self.aec.agent_selection == META:
            self.n_option_steps = 0
        if self.has_ended:
            assert self.aec.agents == list(AGENTS)  # until each was told of the end
        horizon = self.config["subgoal_horizon"]
        assert horizon is None or self.n_option_steps < horizon

    def _take_turn(self, agent: str, action: int) -> None:
        """One turn in the AEC environment; what `last` tells is what was paid since the agent's last one."""
        assert self.aec.agent_selection == agent
        observation, reward, *_ = self.aec.last()
        self.received[agent] += reward
        mask = observation["action_mask"]
        if self.is_wrapped and not self.aec.action_space(agent).contains(action):
            before = _state(self.aec)
            with pytest.raises(AssertionError):  # PettingZoo's own check, before the environment hears of it
                self.aec.step(action)
            _assert_same(_state(self.aec), before)
            self.aec.unwrapped.step(action)
        else:
            self.aec.step(action)
        is_legal = _is_goal_legal(action, mask) if agent == META else 0 <= action < len(mask)
        self.n_illegal["aec"][agent] += not is_legal
        if agent == META:
            assert self.aec.rewards == dict.fromkeys(AGENTS, 0.0)
            goal = int(self.aec.unwrapped.single.turns.goals[0])
            assert goal == (action if is_legal and 0 <= action < NO_GOAL_ACTION else -1)

    @precondition(lambda self: not self.has_ended)
    @rule(n=st.integers(1, 25), rank=st.integers(0, 12))
    def go_on_well(self, n: int, rank: int) -> None:
        """Some steps on a shortest way to the exit."""
        for _ in range(n):
            if not self.has_ended:
                legal = np.flatnonzero(self.observations[META]["action_mask"])
                path = shortest_actions(self.parallel.single.turns.world.get_state())
                self.step(int(legal[rank % len(legal)]), NO_GOAL_ACTION, int(path[0]))

    @precondition(lambda self: not self.has_ended)
    @rule(wrong=NOT_ACTIONS)
    def refuse(self, wrong: object) -> None:
        """What is no action is refused, and nothing happens."""
        before = _state(self.aec), _state(self.parallel)
        if not (wrong is None and self.is_wrapped):
            with pytest.raises((InputError, AssertionError)):
                self.aec.step(wrong)
        for actions in ({META: 0, CONTROLLER: wrong}, {META: wrong, CONTROLLER: 0}, {META: 0}, {}):
            with pytest.raises(InputError):
                self.parallel.step(actions)
        for env, state in zip((self.aec, self.parallel), before, strict=True):
            _assert_same(_state(env), state)

    @precondition(lambda self: self.has_ended)
    @rule(action=ACTIONS)
    def go_on_after_the_end(self, action: int) -> None:
        """PettingZoo's way: each agent is told of the end, and takes the action None; then there is none left."""
        assert self.parallel.step(dict.fromkeys(AGENTS, action)) == ({}, {}, {}, {}, {})
        if not self.aec.agents:
            return
        with pytest.raises((ValueError, AssertionError)):
            self.aec.step(action)
        for n_left in (1, 0):
            agent = self.aec.agent_selection
            _, reward, termination, truncation, info = self.aec.last()
            assert termination or truncation
            assert info.keys() == INFO_KEYS
            self.received[agent] += reward
            self.aec.step(None)
            assert agent not in self.aec.agents
            assert len(self.aec.agents) == n_left
        assert self.received == self.totals  # no reward is lost, none is paid twice

    @rule(of_aec=st.booleans(), how=st.sampled_from((copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)))))
    def go_on_with_a_copy(self, of_aec: bool, how: Any) -> None:
        """The copy goes on as the original would; what it does, the original does not notice."""
        name = "aec" if of_aec else "parallel"
        original = getattr(self, name)
        self.left = [*self.left[-3:], (original, _state(original))]
        setattr(self, name, how(original))
        self.spaces = [env.action_space(agent) for env in (self.aec, self.parallel) for agent in AGENTS]

    @rule()
    def render(self) -> None:
        """Both draw the same."""
        pictures = [env.render() for env in (self.aec.unwrapped, self.parallel)]
        assert [type(picture) for picture in pictures] == 2 * [
            {None: type(None), "ansi": str, "rgb_array": np.ndarray}[self.config["render_mode"]]
        ]
        np.testing.assert_array_equal(*pictures)

    @rule()
    def close(self) -> None:
        """Closing is allowed at any moment, also twice, and nothing that is remembered is lost."""
        before = _state(self.aec), _state(self.parallel)
        self.aec.close()
        self.parallel.close()
        _assert_same(_state(self.aec), before[0])
        _assert_same(_state(self.parallel), before[1])

    @invariant()
    def both_agree(self) -> None:
        """The states, the observations and the global states are the same, of their spaces, and in fresh arrays."""
        if not hasattr(self, "observations"):
            return
        aec, parallel = _state(self.aec), _state(self.parallel)
        aec.pop("illegal_goals")
        assert int(parallel.pop("illegal_goals")[0]) == self.n_illegal["parallel"][META]
        _assert_same(aec, parallel)
        np.testing.assert_array_equal(self.aec.state(), self.parallel.state())
        assert self.parallel.state_space.contains(self.parallel.state())
        for agent in AGENTS:
            space, observation = self.aec.observation_space(agent), self.aec.observe(agent)
            assert space.contains(observation)
            assert space is self.aec.observation_space(agent)
            for name, value in observation.items():
                np.testing.assert_array_equal(value, self.observations[agent][name], err_msg=name, strict=True)
                assert not np.shares_memory(value, self.aec.observe(agent)[name])
        for space, env in zip(self.spaces, (self.aec, self.aec, self.parallel, self.parallel), strict=True):
            assert any(space is env.action_space(agent) for agent in AGENTS)

    @invariant()
    def world_and_ledger_agree(self) -> None:
        """Both count the same steps; the masks are those of the levels; who acts next is who is due."""
        if not hasattr(self, "observations"):
            return
        state = _state(self.parallel)
        level, is_turn = state["levels"][0], bool(state["is_meta_turn"][0])
        assert level["steps"] == self.n_steps
        assert state["option_steps"][0] == self.n_option_steps
        assert bool(level["has_ended"]) == self.has_ended
        assert not (is_turn and self.has_ended)
        if not self.has_ended:
            assert self.aec.agent_selection == (META if is_turn else CONTROLLER)
        mask = self.observations[META]["action_mask"]
        expected = _legal_goals(level, self.config["goal_mask"]) if is_turn else set()
        expected |= {NO_GOAL_ACTION} if not expected or self.config["goal_mask"] == "seen" else set()
        assert set(np.flatnonzero(mask).tolist()) == expected
        assert self.observations[CONTROLLER]["action_mask"].all()
        goal = int(state["goals"][0])
        assert goal == -1 or not is_turn

    @invariant()
    def originals_do_not_notice(self) -> None:
        """Of what was copied, the original stays as it was."""
        for original, state in getattr(self, "left", ()):
            _assert_same(_state(original), state)


def _state(env: Any) -> dict[str, np.ndarray]:
    return env.unwrapped.single.turns.get_state()


def _assert_same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> None:
    assert one.keys() == other.keys()
    for name in one:
        if not np.array_equal(one[name], other[name]):
            note(f"{name}: {one[name]} is not {other[name]}")
            raise AssertionError(f"{name} differs")


def _is_goal_legal(choice: int, mask: np.ndarray) -> bool:
    place = NO_GOAL_ACTION if choice == -1 else int(choice)
    return 0 <= place <= NO_GOAL_ACTION and bool(mask[place])


def _legal_goals(level: Any, goal_mask: str) -> set[int]:
    """The legal goals of a level on the meta-controller's turn, one rule a line."""
    if goal_mask == "none":
        return set(range(13))
    goals = set()
    for branch in range(level["n_rooms"] - 1):
        colour, home = int(level["colours"][branch]), int(level["key_rooms"][branch])
        is_held, is_open = level["keys"] >> branch & 1, level["doors"] >> branch & 1
        is_in_reach = home == 0 or level["doors"] >> (home - 1) & 1
        if not is_open and not is_held and (goal_mask != "reachable" or is_in_reach):
            goals.add(colour)
        if not is_open and (goal_mask != "reachable" or is_held):
            goals.add(6 + colour)
    if goal_mask != "reachable" or level["doors"] >> (level["exit_room"] - 1) & 1:
        goals.add(12)
    return {goal for goal in goals if goal_mask != "seen" or level["seen"] >> goal & 1}
