"""Curricula: the graphs become harder if the agent escapes, and easier if it does not."""

import numpy as np
import pytest
from turns_helpers import make

from hierroom.agents.player import OraclePlayer
from hierroom.complexity import Curriculum, GraphSet
from hierroom.support.errors import InputError
from hierroom.worlds.escape_room.constants import LEFT
from hierroom.worlds.escape_room.graph_sampler import EPISODES_PER_STAGE, GraphSampler
from hierroom.worlds.escape_room.layout import LEVEL

INTERVAL = "hitting_time:8..16"
N_ENVS = 25
SETTINGS = {"curriculum_stages": 2, "max_steps": 120}


@pytest.fixture(scope="module")
def stages():
    easy, hard = map(set, GraphSet(INTERVAL).stages(2))
    assert not easy & hard
    return easy, hard


def stage_of(turns):
    return int(turns.get_state()["curriculum"][0])


def graphs_of(turns, envs):
    situation = turns.situation(envs)
    return {situation.graph(m) for m in range(len(envs))}


def play_to_the_next_stage(turns, step):
    """Return the goal graphs drawn before the stage changed, how many episodes ended, and how many escaped."""
    before, drawn, ended, escaped = stage_of(turns), set(), 0, 0
    while stage_of(turns) == before:
        done = step(turns)
        drawn |= graphs_of(turns, np.flatnonzero(done.episode_ended))  # also of episodes that began in the last step
        ended, escaped = ended + done.episode_ended.sum(), escaped + done.terminated.sum()
    return drawn, ended, escaped


def turn_left(turns):
    return turns.step(np.full(len(turns), LEFT))


def play_on(turns, step, until=2):
    """Take steps until each environment has begun ``until`` episodes; return the goal graphs of the last of them."""
    first = turns.world.state.levels["episode"].copy()
    while (turns.world.state.levels["episode"] - first < until).any():
        step(turns)
    return graphs_of(turns, np.arange(len(turns)))


def test_stage_rises_with_escapes_and_falls_without(stages):
    easy, hard = stages
    turns = make(INTERVAL, N_ENVS, seed=4, **SETTINGS)
    assert graphs_of(turns, np.arange(N_ENVS)) <= easy
    drawn, ended, escaped = play_to_the_next_stage(turns, OraclePlayer().step)
    assert drawn == easy
    assert ended == escaped >= EPISODES_PER_STAGE
    assert stage_of(turns) == 1
    assert graphs_of(turns, np.arange(N_ENVS)) <= easy  # running episodes continue, but do not count for the next stage
    drawn, ended, escaped = play_to_the_next_stage(turns, turn_left)
    assert drawn == hard
    assert ended >= EPISODES_PER_STAGE + N_ENVS
    assert escaped == 0
    assert stage_of(turns) == 0
    assert play_on(turns, turn_left) <= easy


def test_one_stage_draws_from_the_whole_interval(stages):
    turns = make(INTERVAL, 1000, seed=4)
    assert graphs_of(turns, np.arange(1000)) == stages[0] | stages[1]


def test_manual_reset_draws_from_the_next_stage(stages):
    turns, oracle = make(INTERVAL, seed=4, autoreset=False, **SETTINGS), OraclePlayer()
    only = np.array([0])
    for _ in range(EPISODES_PER_STAGE):
        assert stage_of(turns) == 0
        assert graphs_of(turns, only) <= stages[0]
        while not oracle.step(turns).terminated[0]:
            pass
        turns.reset()
    assert stage_of(turns) == 1
    assert graphs_of(turns, only) <= stages[1]


def test_set_state_restores_the_stage(stages):
    turns = make(INTERVAL, N_ENVS, seed=4, **SETTINGS)
    play_to_the_next_stage(turns, OraclePlayer().step)
    play_on(turns, turn_left, until=3)  # the middle of the second stage
    state = turns.get_state()

    def play_and_note(turns):
        observed = []
        for _ in range(9 * SETTINGS["max_steps"]):  # until well after the return to the easy stage
            step = turn_left(turns)
            observed.append(
                (stage_of(turns), step.lengths.tolist(), step.goals.tolist(), turns.world.state.levels.tobytes())
            )
        return observed

    first = play_and_note(turns)
    assert {stage for stage, *_ in first} == {0, 1}
    elsewhere = make(INTERVAL, N_ENVS, seed=1, **SETTINGS)
    for other in (turns, elsewhere):
        other.set_state(state)
        assert stage_of(other) == 1
        assert play_and_note(other) == first
        other.set_state(state)
        assert play_on(other, OraclePlayer().step) <= stages[1]


def test_an_unknown_stage_raises_input_error():
    turns = make(INTERVAL, N_ENVS, seed=4, **SETTINGS)
    state = turns.get_state()
    state["curriculum"][0] = 2
    with pytest.raises(InputError, match=r"^the stages are 0 to 1; there is no stage 2$"):
        turns.set_state(state)


def test_ended_episode_counts_once():
    turns = make("hitting_time:8..16", curriculum_stages=2, autoreset=False, max_steps=100)
    oracle = OraclePlayer()
    while not oracle.step(turns).terminated[0]:
        pass
    for _ in range(10):
        turns.step([LEFT])
    assert turns.get_state()["curriculum"].tolist() == [0, 1]
    assert turns.get_state()["n_ended"].tolist() == [1]


def test_reset_episode_belongs_to_the_current_stage():
    """After a reset in the middle of an episode, the new episode belongs to the current stage."""
    turns = make("hitting_time:8..16", 25, curriculum_stages=2, max_steps=100)
    oracle = OraclePlayer()
    while not turns.get_state()["curriculum"][0]:
        oracle.step(turns)
    assert turns.get_state()["n_ended"].tolist() == [-1] * 25
    turns.reset()
    assert turns.get_state()["n_ended"].tolist() == [0] * 25


EASY = GraphSet("rooms:3")
OF_SAMPLER = 8


def test_curriculum_promotes_and_demotes_by_success_rate():
    curriculum = Curriculum(GraphSet("hitting_time:8..50"), n_stages=3, promote_at=0.8, demote_at=0.2)
    assert [curriculum.advance(0, rate) for rate in (0.0, 0.5, 0.8, 1.0)] == [0, 0, 1, 1]
    assert [curriculum.advance(1, rate) for rate in (0.0, 0.19, 0.2, 0.79, 0.8)] == [0, 0, 1, 1, 2]
    assert curriculum.advance(2, 1.0) == 2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Curriculum(EASY, n_stages=0), "the number of stages must be at least 1, not 0"),
        (lambda: Curriculum(EASY, n_stages=2.5), "the number of stages must be a whole number, not 2.5"),
        (lambda: Curriculum(EASY, promote_at=0.1), "demote_at < promote_at"),
        (lambda: Curriculum(EASY).advance(5, 0.5), "there is no stage 5"),
        (lambda: Curriculum(EASY).advance(0, 1.5), "a success rate must be in 0..1"),
        (lambda: GraphSampler("g", (), False, 2, n_stages=3), "of 3 stages needs several graphs.*not g alone"),
    ],
)
def test_invalid_curriculum_raises_input_error(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def end(sampler, is_escape, envs=range(OF_SAMPLER)):
    ended = np.isin(np.arange(OF_SAMPLER), envs)
    return sampler.add(ended, ended & is_escape)


def test_episodes_begun_in_another_stage_do_not_count():
    sampler = GraphSampler("hitting_time:8..50", (), False, OF_SAMPLER, n_stages=3)
    first, quota = sampler.graphs, EPISODES_PER_STAGE // OF_SAMPLER
    moves = [end(sampler, True) for _ in range(quota)]
    assert moves == [False] * (len(moves) - 1) + [True]
    second = sampler.graphs
    assert second != first
    assert not end(sampler, True, [0, 1])  # begun in the first stage, as the six below
    for _ in range(quota):
        assert not end(sampler, False, [0, 1])
    again = GraphSampler("hitting_time:8..50", (), False, OF_SAMPLER, n_stages=3)
    again.set_state(sampler.get_state(), np.zeros(0, LEVEL))
    for each in (sampler, again):
        assert not end(each, True, range(2, OF_SAMPLER))
        for _ in range(quota - 1):
            assert not end(each, False, range(2, OF_SAMPLER))
        assert each.graphs == second
        assert end(each, False, range(2, OF_SAMPLER))  # 200 of this stage, none of them an escape
        assert each.graphs == first


@pytest.mark.parametrize("n_envs", [16, 64, 256])
def test_short_episodes_count_no_more_than_long_ones(n_envs):
    """An agent that escapes in 70% of episodes, after 6 steps, and else fails after 100, is not promoted at 80%."""
    sampler, random = GraphSampler("hitting_time:8..50", (), False, n_envs, n_stages=3), np.random.default_rng(0)
    escapes, age = random.random(n_envs) < 0.7, random.integers(0, 6, n_envs)
    for _ in range(4000):
        age += 1
        ended = age == np.where(escapes, 6, 100)
        assert not sampler.add(ended, ended & escapes)
        escapes, age = np.where(ended, random.random(n_envs) < 0.7, escapes), np.where(ended, 0, age)


def test_episodes_beyond_an_environments_share_do_not_count():
    sampler = GraphSampler("hitting_time:8..50", (), False, OF_SAMPLER, n_stages=3)
    quota = EPISODES_PER_STAGE // OF_SAMPLER
    for _ in range(10 * quota):
        assert not end(sampler, True, [0])
    moves = [end(sampler, False, range(1, OF_SAMPLER)) for _ in range(quota)]
    assert not any(moves)  # 25 of 200, and not below a fifth were the others counted
    assert sampler.get_state()["curriculum"].tolist() == [0, 0]
    assert sampler.get_state()["n_ended"].tolist() == [-1] * OF_SAMPLER


def test_one_graph_has_no_stages():
    sampler = GraphSampler("c", (), False, OF_SAMPLER)
    assert not any(end(sampler, True) for _ in range(EPISODES_PER_STAGE))
    assert sampler.graphs == sampler.everything
