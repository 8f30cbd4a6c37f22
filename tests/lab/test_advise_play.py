"""Stages counted by hand, and against the exact mean of random play in a workshop."""

import time
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import hierroom
from hierroom.agents.player import RandomPlayer
from hierroom.lab.advise.costs import measure_costs
from hierroom.lab.advise.stages import DONE, Trials
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig


def test_flow_by_hand():
    """Two stages: 3 steps with key pursued, then door; half of the visits to stage 1 fall back to stage 0."""
    trials = Trials(1, 2)
    one = trials.number_of((1, 0))
    for after in (one, 0, one, DONE):
        kind, steps = (0, 3) if trials.stage[0] == 0 else (1, 5)
        for step in range(steps):
            trials.tick(np.array([kind]), np.array([step == steps - 1 and after != 0]))
        trials.leave(0, after)
    flow = trials.flow()
    # v_0 = 1 + v_1 / 2 and v_1 = v_0, so both are 2; E = 2 x 3 + 2 x 5
    assert flow.visits.tolist() == pytest.approx([2, 2])
    assert flow.steps == pytest.approx(16)
    assert flow.by_kind.tolist() == pytest.approx([6, 10, 0])
    assert flow.reached.tolist() == pytest.approx([2, 1, 0])  # so a door costs 10 random steps


def test_unfinished_trials_count_their_steps():
    trials = Trials(1, 1)
    for n_steps, end in ((2, lambda: trials.leave(0, DONE)), (4, trials.close)):
        for _ in range(n_steps):
            trials.tick(np.array([0]), np.zeros(1, bool))
        end()
    assert trials.flow().steps == 2 + 4  # steps in the stage for one exit


def test_target_that_is_never_reached_costs_infinitely_many_steps():
    trials = Trials(1, 1)
    trials.tick(np.array([0]), np.array([True]))
    trials.leave(0, trials.number_of((1,)))
    trials.close()
    assert trials.flow().steps == np.inf
    assert trials.totals().tolist() == [[1, 0], [1, 0]]


def test_play_finds_the_exact_expected_steps_and_equal_seeds_give_equal_costs():
    config = EnvConfig(task="workshop:4:9")
    costs = measure_costs(config, play_steps=300_000, seed=1)
    assert costs.expected_steps.low < 1761.57 < costs.expected_steps.high  # by benchmarks.study.random_work
    assert sum(goal.share for goal in costs.goals.values()) == pytest.approx(1)
    assert costs.goals[costs.hardest].share == max(goal.share for goal in costs.goals.values())
    assert 0 < costs.random_success.low < costs.random_success.value < costs.random_success.high < 1
    again = measure_costs(config, play_steps=300_000, seed=1)
    assert (again.goals, again.expected_steps, again.episodes) == (costs.goals, costs.expected_steps, costs.episodes)


def test_clock_of_play_does_not_count_what_the_first_step_takes(monkeypatch):
    step, waits = RandomPlayer.step, [1.0]  # as long as kernels compile or load

    def slow_at_first(player, *arguments):
        time.sleep(waits.pop() if waits else 0)
        return step(player, *arguments)

    monkeypatch.setattr(RandomPlayer, "step", slow_at_first)
    costs = measure_costs(EnvConfig(task="workshop:4:9"), seconds=0.5)
    assert costs.steps > 5_000
    assert costs.steps_per_second > 10_000


class Walk(gymnasium.Env):
    """Walk right for 12 steps of three with chance 1 / 2, slowly."""

    observation_space, action_space = gymnasium.spaces.Box(0, 99, (1,)), gymnasium.spaces.Discrete(2)
    steps, seconds = 0, 0.0

    def reset(self, *, seed=None, options=None):
        self.at = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        Walk.steps += 1
        time.sleep(self.seconds)
        self.at = max(0, self.at + 2 * int(action) - 1)
        return np.full(1, self.at, np.float32), 0.0, False, False, {}


def walk_task():
    goals = {f"at {n}": lambda env, info, n=n: env.unwrapped.at >= n for n in (4, 8, 12)}
    return hierroom.Task(make=Walk, goals=goals, target="at 12", max_steps=600, label="walk")


def test_steps_that_go_back_to_a_state_are_few_and_part_of_the_budget(monkeypatch):
    monkeypatch.setattr(Walk, "steps", 0)
    costs = measure_costs(EnvConfig(task=walk_task()), play_steps=8000)
    assert 8000 <= costs.steps < 8200
    assert Walk.steps == pytest.approx(costs.steps, abs=50)
    assert np.isfinite(costs.expected_steps.value)


def test_expected_steps_count_the_episodes_that_a_limit_ends():
    at, steps, limit = np.eye(1, 13)[0], 0.0, 20
    for _ in range(limit):  # the exact walk: at 12 an episode has ended
        steps += at[:12].sum()
        moved = np.zeros(13)
        moved[0], moved[12] = at[0] / 2, at[12]
        moved[1:] += at[:12] / 2
        moved[:11] += at[1:12] / 2
        at = moved
    costs = measure_costs(EnvConfig(task=replace(walk_task(), max_steps=limit)), play_steps=60_000)
    assert costs.expected_steps.low < steps / at[12] < costs.expected_steps.high
    assert steps / at[12] > 2000  # a walk without a limit takes 12 x 13 steps


def test_slow_play_ends_in_time(monkeypatch):
    monkeypatch.setattr(Walk, "seconds", 0.02)
    monkeypatch.setattr(Walk, "steps", 0)
    measure_costs(EnvConfig(task=walk_task()), seconds=0.4)
    assert Walk.steps <= 20 + 16 + 10


def test_limit_of_the_task_or_of_its_environment_applies():
    goals = {"home": lambda env, info: env.unwrapped.s // 4 % 5 == env.unwrapped.s % 4}
    for limit, applies in ((1000, 200), (150, 150)):
        task = hierroom.Task(make="Taxi-v4", goals=goals, target="home", max_steps=limit, label="taxi")
        advice = hierroom.advise(task=task, play_steps=100)
        assert advice.costs.limit == applies
        assert f"episodes of {applies} steps" in str(advice)


@pytest.mark.parametrize("budget", [{"seconds": 0}, {"seconds": float("nan")}, {"play_steps": 0}])
def test_play_needs_a_budget(budget):
    with pytest.raises(InputError, match="play"):
        measure_costs(EnvConfig(graph="a"), **budget)
