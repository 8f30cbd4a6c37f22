"""The learned meta-controller: its turns kept by hand, hindsight, masks, when it learns, resuming, acting."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
import torch
from same_state import equal
from turns_rooms import goal_ids, make

from hierroom import train
from hierroom.agents.player import Agent
from hierroom.agents.ppo_agent import LearnedMeta
from hierroom.errors import InputError
from hierroom.goals import EXIT_GOAL, N_GOALS
from hierroom.gym_env import EscapeRoom
from hierroom.learners.config import PPOConfig
from hierroom.learners.ppo import in_hindsight
from hierroom.options import OTHER, REACHED, TIMED_OUT
from hierroom.training.assembly import make_turns
from hierroom.training.presets import TrainConfig, find_preset
from hierroom.training.run_folder import RunFolder
from hierroom.training.trainer import Trainer
from hierroom.world.oracle import shortest_actions

META_PPO = PPOConfig(sequence_length=4, sequences_per_update=4, minibatches=2, epochs=2, hidden_size=8)
SMALL = replace(
    find_preset("learned"),
    graph="a",
    size=11,
    max_steps=60,
    subgoal_horizon=10,
    rooms=8,
    steps=4096,
    threads=1,
    ppo=PPOConfig(sequence_length=16, minibatches=2, epochs=2, hidden_size=8),
    meta_ppo=META_PPO,
    meta_start_success=0.0,
)
FLAGS = ["--meta", "learned", "--graph", "a", "--size", "11", "--max-steps", "60", "--rooms", "8"]
FLAGS += ["--sequence-length", "16", "--minibatches", "2", "--epochs", "2", "--threads", "1"]


def learned_state(trainer):
    state = trainer.state_dict()
    return {name: state[name] for name in ("learner", "meta", "turns", "rooms", "steps")}


def learning(trainer):
    """A trainer's learned meta-controller."""
    assert isinstance(trainer.meta, LearnedMeta)
    return trainer.meta


class Scripted(LearnedMeta):
    """Gives the goals of a list, whatever its policy draws."""

    goals: list

    def choose(self, observations, legal, situation):
        super().choose(observations, legal, situation)
        return np.array([self.goals.pop(0)])


def way(turns, name):
    """The actions of the shortest way to a goal, ``k1``, ``d1`` or ``x``."""
    return shortest_actions(turns.world.get_state(), *goal_ids(turns, name))


def play(graph, goals, script, **settings):
    """Play one room: give these goals, one after the other, while the controller acts by a script.

    The script names the goals it goes for, or -1 to turn left. Returns the turns, what `Learner.finish` was told of
    each decision ``(reward, elapsed, terminated, truncated, over)``, what it was shown last, and what was relabelled.
    """
    turns = make(graph, goal_mask="existing", **settings)
    config = replace(SMALL, rooms=1, graph=graph, meta_ppo=replace(META_PPO, sequence_length=50))
    meta = cast(Scripted, Scripted.for_training(config))
    meta.goals = [next(iter(goal_ids(turns, goal))) for goal in goals]
    told, shown, relabelled = [], [], []
    finish, relabel = meta._learner.finish, meta._learner.relabel

    def note_finish(rooms, *values):
        if len(rooms):
            told.append(tuple(value[0].item() for value in values[:5]))
            shown.append(values[5][0])
        finish(rooms, *values)

    def note_relabel(rooms, actions):
        relabelled.extend(actions.tolist())
        relabel(rooms, actions)

    meta._learner.finish, meta._learner.relabel = note_finish, note_relabel  # pyright: ignore[reportAttributeAccessIssue]
    for name in script:
        for action in [1] if name == -1 else way(turns, name):
            turns.ask(meta)
            meta.learn(turns.step([action]), turns)
    return turns, told, shown, relabelled


def test_each_decision_is_paid_its_options_reward_and_lasts_its_steps():
    turns = make("a")
    key = len(way(turns, "k1"))
    total = len(shortest_actions(turns.world.get_state()))
    _, told, shown, relabelled = play("a", ["k1", "d1", "x"], ["k1", "d1", "x"])
    door = told[1][1]
    assert told == [
        (0, key, False, False, False),
        (0, door, False, False, False),
        (1, total - key - door, True, False, True),
    ]
    assert relabelled == []
    for codes, name in zip(shown, ["k1", "d1", "x"], strict=True):
        outcomes = codes[N_GOALS:]
        assert outcomes[[*goal_ids(turns, name)]] == REACHED
        assert np.count_nonzero(outcomes) == 1


def test_a_horizon_and_the_time_limit_cut_returns_and_end_no_episode_for_good():
    _, told, shown, _ = play("a", ["x", "x"], [-1] * 5, subgoal_horizon=3, max_steps=5)
    assert told == [(0, 3, False, False, False), (0, 2, False, True, True)]
    assert [codes[N_GOALS + EXIT_GOAL] for codes in shown] == [TIMED_OUT, OTHER]  # the last from before the reset


def test_a_goal_in_vain_is_relabelled_with_the_goal_achieved_first():
    turns = make("d")
    steps = len(way(turns, "k2"))
    _, told, _, relabelled = play("d", ["x"], ["k2", -1], subgoal_horizon=steps + 1)
    assert told == [(0, steps + 1, False, False, False)]
    assert relabelled == [*goal_ids(turns, "k2")]
    _, told, _, relabelled = play("d", ["k1", "x"], ["k2", "k1", -1], subgoal_horizon=100)
    assert len(told) == 1  # that the other key was picked up first does not matter: the goal was reached
    assert relabelled == []
    _, told, _, relabelled = play("d", ["k2", "d2", "d1"], ["k2", "d2", "x"])
    assert told[-1][2:] == (True, False, True)
    assert relabelled == [EXIT_GOAL]


def test_only_better_than_expected_turns_are_learned_from_in_hindsight():
    config = replace(SMALL, meta_ppo=META_PPO)
    learner = LearnedMeta.for_training(config)._learner
    codes, masks = np.zeros((8, 26), np.uint8), np.ones((8, 14), bool)
    masks[3, 5] = False
    rooms, done = np.arange(8), np.ones(8, bool)
    learner.act(rooms, codes, masks)
    learner.relabel(np.array([1, 2, 3]), np.array([7, 4, 5]))
    slots = learner._rollout.slots
    assert slots.hindsight_actions[0, :8].tolist() == [-1, 7, 4, -1, -1, -1, -1, -1]  # 5 was not legal in room 3
    expected = torch.log_softmax(torch.from_numpy(learner._logits[1]), -1)[7]
    np.testing.assert_allclose(slots.hindsight_log_probs[0, 1], expected, atol=1e-6)
    learner.finish(rooms, np.zeros(8), np.ones(8, int), done, ~done, done, codes)
    batch = replace(slots)
    advantages = np.full(batch.actions.shape, -1.0)
    advantages[0, 1] = 0.5
    seen = in_hindsight(batch, advantages)
    assert seen.actions[0, 1] == 7
    assert seen.log_probs[0, 1] == batch.hindsight_log_probs[0, 1]
    np.testing.assert_array_equal(seen.actions[0, 2:8], batch.actions[0, 2:8])
    learner.act(rooms, codes, masks)
    assert (slots.hindsight_actions[1, :8] == -1).all()  # a new turn knows nothing of the last


@pytest.mark.parametrize("mask", ["existing", "seen", "none", "reachable"])
@pytest.mark.parametrize("start_success", [0.0, 1.0], ids=["learning", "at random"])
def test_no_masked_goal_is_ever_chosen(mask, start_success):
    trainer = Trainer(replace(SMALL, goal_mask=mask, graph="d", meta_start_success=start_success))
    assert learning(trainer).is_learning == (start_success == 0)
    for _ in range(4):
        trainer.advance()
        assert not trainer.turns.ledger.illegal_goals.any()


def test_goals_are_drawn_at_random_until_enough_episodes_escape():
    trainer = Trainer(replace(SMALL, meta_start_success=0.02))
    meta, turns = learning(trainer), trainer.turns
    before = meta.state_dict()["learner"]["backend"]["network"]
    step = turns.step(np.ones(8, int))
    episode_ended = np.ones(8, bool)
    lost = replace(step, terminated=~episode_ended, truncated=episode_ended, option_ended=episode_ended)
    for _ in range(12):
        meta.learn(lost, turns)
    meta.learn(replace(lost, terminated=episode_ended, truncated=~episode_ended), turns)  # 8 of 104 escaped
    assert meta.is_learning
    assert meta.statistics["is_learning"] == 1
    meta.learn(lost, turns)  # goals given before are none of its turns
    turns.ask(meta)
    while not meta._updated:
        meta.learn(turns.step(np.ones(8, int)), turns)
        turns.ask(meta)
    after = meta.state_dict()["learner"]["backend"]["network"]
    assert not equal(dict(before), dict(after))


def test_the_controllers_steps_leave_the_recurrent_state_as_it_is():
    turns = make("c", n=8, goal_mask="existing")
    meta = LearnedMeta.for_training(SMALL)
    turns.ask(meta)
    before = meta.state_dict()["learner"]["states"]
    assert before.any()
    for _ in range(10):
        meta.learn(turns.step(np.ones(8, int)), turns)
        turns.ask(meta)
    assert torch.equal(before, meta.state_dict()["learner"]["states"])


@pytest.mark.parametrize("start_success", [0.0, 0.02])
def test_resumed_equals_uninterrupted_and_the_checkpoint_is_plain(start_success, tmp_path):
    config = replace(SMALL, meta_start_success=start_success)
    through, before, other = Trainer(config), Trainer(config), Trainer(replace(config, seed=1))
    for _ in range(8):
        through.advance()
        other.advance()
    for _ in range(4):
        before.advance()
    folder = RunFolder.create(tmp_path / "run", config)
    folder.save_checkpoint(before.state_dict())  # read with weights_only=True
    assert folder.config() == config
    after = Trainer(config)
    after.load_state_dict(folder.load_checkpoint())
    for _ in range(4):
        after.advance()
    assert equal(learned_state(through), learned_state(after))
    assert not equal(learned_state(through), learned_state(other))


def test_what_was_learned_acts_in_other_rooms_and_learns_nothing(tmp_path):
    trainer = Trainer(SMALL)
    for _ in range(4):
        trainer.advance()
    folder = RunFolder.create(tmp_path / "run", SMALL)
    folder.save_checkpoint(trainer.state_dict())
    before = learned_state(trainer)

    def goals(agent):
        turns, given = make_turns(SMALL, 3, 5), []
        for _ in range(80):
            agent.step(turns)
            given.append(turns.goals.tolist())
        return given

    assert not hasattr(Agent.load(folder, 3).meta, "learn")
    assert goals(Agent.load(folder, 3, seed=2)) == goals(Agent.of(trainer, 3, seed=2))
    assert goals(Agent.load(folder, 3, seed=2)) != goals(Agent.load(folder, 3, seed=3))
    assert equal(before, learned_state(trainer))


def test_one_command_trains_it_with_the_settings_it_needs(tmp_path):
    out = tmp_path / "run"
    assert train.main([*FLAGS, "--steps", "2048", "--meta-start-success", "0", "--out", str(out)]) == 0
    config = RunFolder.open(out).config()
    preset = find_preset("learned")
    for name in ("goal_mask", "subgoal_horizon", "meta_ppo", "meta_inputs"):
        assert getattr(config, name) == getattr(preset, name)
    assert config.ppo.entropy_weight == preset.ppo.entropy_weight
    assert train.parse(["--meta", "learned", "--meta-ppo.gamma", "0.9"]).config.meta_ppo.gamma == 0.9
    assert train.parse(["--meta", "learned", "--preset", "default"]).config.goal_mask == TrainConfig().goal_mask
    rows = RunFolder.open(out).metrics()
    assert rows[-1]["meta_is_learning"] == 1


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--meta-inputs", "view"], "meta-inputs have one column for each of 13 goals, not 49 in all"),
        (["--meta-inputs", "smell"], "inputs are"),
        (["--meta-start-success", "2"], "meta_start_success must be from 0 to 1, not 2.0"),
    ],
)
def test_wrong_settings_are_one_clear_line(flags, said):
    with pytest.raises(InputError, match=said) as caught:
        train.main([*FLAGS, *flags])
    assert "\n" not in str(caught.value)


def test_outside_training_there_is_nothing_to_choose_with():
    with pytest.raises(InputError, match="'learned' is made in training"):
        EscapeRoom(meta="learned")


class Counting:
    """A user's own learning meta-controller: gives any legal goal, counts those reached."""

    reached = asked = 0

    def choose(self, observations, legal, situation):
        self.asked += len(legal)
        return legal.argmax(axis=1)

    def learn(self, step, turns):
        self.reached += int(step.reached.sum())

    def state_dict(self):
        return {"reached": self.reached, "asked": self.asked}

    def load_state_dict(self, state):
        vars(self).update(state)


def test_a_users_own_learning_meta_controller_is_told_of_every_step_and_saved():
    config = replace(SMALL, meta="test_learned_meta:Counting", goal_mask="reachable")
    trainer, again = Trainer(config), Trainer(config)
    counts = vars(trainer.meta)
    while "reached" not in counts or not counts["reached"]:
        trainer.advance()
    again.load_state_dict(trainer.state_dict())
    assert vars(again.meta) == counts
