"""Advice before training: predictions by hand, what lies outside, rules compared with play, and invalid input."""

import json
import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import hierroom
from hierroom.__main__ import main
from hierroom.lab.advise.check import check
from hierroom.lab.advise.costs import measure_costs
from hierroom.lab.advise.measures import MEASURES, Known
from hierroom.lab.advise.model import Fit, Model, read_model
from hierroom.lab.advise.outside import outside, world_of
from hierroom.lab.advise.prediction import best_of, predict, similar
from hierroom.lab.advise.rule_check import check_rules, complete
from hierroom.runs.folder.predicted import Steps, in_short
from hierroom.support.errors import InputError
from hierroom.worlds.make import name_in_module

KNOWN = Known(1000.0, 600.0, 3, 5, 8.0, 5, 400)
BOUNDS = {"expected_steps": (500.0, 5000.0), "goals": (2.0, 10.0), "limit": (400.0, 1000.0)}
FIT = Fit("hippo", "steps_to_50", "workshop", "W x kinds", math.log(2), 1.0, 0.5, 0.25, 4.0, 60, 300)
FITS = {("hippo", "steps_to_50", world): FIT for world in ("workshop", "other")}
MODEL = Model("0 hand", 2, 50_000, BOUNDS, FITS, {"far": (9e4, math.inf), "near": (8e3, 2e4), "next": (4e3, 3e3)})


def test_measures_by_hand():
    assert {name: measure(KNOWN) for name, measure in MEASURES.items()} == {
        "W x kinds": 9000.0,
        "W": 3000.0,
    }


def test_prediction_by_hand():
    found, reason = predict(KNOWN, "workshop", MODEL)
    one = found["hippo"]
    assert reason is None
    assert one.steps_to_50 == pytest.approx(18_000)  # 2 x 600 x 5 x 3
    assert (one.steps_to_50.low, one.steps_to_50.high) == (pytest.approx(4500), math.inf)  # 72,000 is beyond
    assert one.steps_to_95 is None
    assert one.chance_to_50 == pytest.approx(0.8873, abs=1e-3)  # normal of log(50 / 18) / (log(4) / 1.645)
    assert best_of(found) == ("hippo", 36_000)  # twice the median
    assert similar(KNOWN, MODEL, 2) == [("near", 2e4), ("next", 3e3)]


@pytest.mark.parametrize("median", [1.0, 40_000.0, 90_000.0, 10.0**9])
@pytest.mark.parametrize("high", [1.0, 4.0, math.inf])
def test_ends_of_intervals_are_in_order(median, high):
    steps = Steps.within(median, 0.5, high, 50_000)
    assert 0 < steps.low <= steps <= steps.high
    assert steps.high <= 50_000 or steps.high == math.inf


@pytest.mark.parametrize(
    ("entries", "why"),
    [
        ({}, None),
        ({"expected_steps": math.inf}, "did not reach the target"),
        ({"expected_steps": 249.0}, "random steps to the target: 249"),
        ({"expected_steps": 10_001.0}, "random steps"),
        ({"limit": 199}, "steps of an episode"),
        ({"goals": 21}, "21 goals"),
        ({"random_success": 0.5}, None),
        ({"random_success": 0.57}, "succeeds in 57%"),
        ({"fewest": math.nan}, "rules are unknown"),
    ],
)
def test_rule_of_what_lies_outside(entries, why):
    known = replace(KNOWN, **entries)
    found = outside(known, MEASURES["W x kinds"](known), BOUNDS)
    assert (found is None) == (why is None)
    assert why is None or why in found
    assert (predict(known, "workshop", MODEL)[0] == {}) == (why is not None)


def test_only_environments_like_those_of_the_runs_have_the_narrow_interval():
    config = hierroom.EnvConfig
    assert world_of(config("f")) == "escape_room"
    assert world_of(config(task="workshop:6:3:deep", max_steps=400)) == "workshop"
    others = config("f", size=25), config("f", drop_key=True), config(["a", "b"]), config("f", max_steps=300)
    assert {world_of(one) for one in (*others, config(task="workshop:6"))} == {"other"}


RULES = hierroom.Rules(
    {
        "wood": {"gives": "wood"},
        "axe": {"uses": "wood", "gives": "axe"},
        "house": {"needs": ["wood", "axe"], "gives": "house"},
    },
    target="house",
)


def test_rules_that_hold_and_rules_that_do_not():
    def check(*episodes):
        timed = [(None, [*enumerate(episode)]) for episode in episodes]
        return check_rules(RULES, timed, RULES.names, "house")

    holds = check(["wood", "axe", "wood", "house"])
    assert str(holds) == "hold in all of 4 achievements"
    assert complete(holds) is RULES
    reversed_need = check(["axe", "wood", "house"])
    assert reversed_need.broken == {"axe": (1, ("wood",))}
    assert "axe: 1 of 1 times achieved without wood; in play it came after nothing" in str(reversed_need)
    assert complete(reversed_need).to_dict()["rules"]["axe"] != RULES.to_dict()["rules"]["axe"]
    kept = check(["wood", "axe", "house"])  # the axe did not use the wood up
    assert (kept.broken, kept.unused) == ({}, {"house": 1})
    never = check(*[["wood"]] * 100)
    assert never.never == {"axe": 100}


def test_achievements_of_one_step_may_come_in_any_order():
    assert not check_rules(RULES, [(None, [(1, "axe"), (1, "wood")])], RULES.names, "house").broken


class Line(gymnasium.Env):
    """Walk right for two steps; ``error`` raises in a step."""

    observation_space, action_space = gymnasium.spaces.Box(0, 9, (1,)), gymnasium.spaces.Discrete(2)

    def __init__(self, error=False):
        self.at, self.error = 0, error

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.at, self.taken = 0, 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.at, self.taken = max(0, self.at + 2 * int(action) - 1), self.taken + 1
        if self.error and self.taken > 20:
            raise ValueError("out of paint")
        return np.full(1, self.at % 10, np.float32), 0.0, False, False, {}


def line(error=False, **changes):
    goals = {name: lambda env, info, n=n: env.unwrapped.at >= n for n, name in enumerate(("one", "two"), start=1)}
    entries = {"goals": goals, "rules": {"one": {}, "two": {"needs": "one"}}, "target": "two", "max_steps": 200}
    return hierroom.Task(make=lambda: Line(error), **entries | {"label": "line"} | changes)


def test_task_that_was_not_measured_gets_costs_and_the_reason():
    advice = hierroom.advise(task=line(), play_steps=4000)
    # from 0: two fair coins on average until a step right; from 1: E = 1 + E_back / 2 with E_back = 2 + E
    assert advice.costs.goals["one"].steps.value == pytest.approx(2, rel=0.1)
    assert advice.costs.expected_steps.low < 6 < advice.costs.expected_steps.high
    assert (advice.outside, advice.predictions, advice.method) == (True, {}, None)
    assert "random steps to the target: 6" in advice.reason
    assert str(advice.rules).startswith("hold in all")
    again = hierroom.advise(task=line(), play_steps=4000)
    assert again.costs.goals == advice.costs.goals


def test_rules_that_are_missing_are_measured_and_unreachable_goals_named():
    advice = hierroom.advise(task=line(rules=None), play_steps=4000)
    assert "none declared; measured from" in str(advice)
    far = {"one": lambda env, info: env.unwrapped.at >= 1, "two": lambda env, info: False}
    advice = hierroom.advise(task=line(goals=far), play_steps=20_000)
    assert advice.costs.goals["two"].reached == 0
    assert "not reached      two, in " in str(advice)
    assert "random play did not reach the target" in advice.reason


@pytest.mark.parametrize(
    ("entries", "why"),
    [
        ({}, "exactly one of"),
        ({"graph": "a", "task": "workshop:4"}, "exactly one of"),
        ({"graph": "a", "seconds": 0}, "seconds of play must be above 0"),
        ({"task": line(error=True), "play_steps": 4000}, "out of paint"),
        ({"task": line(goals={}, rules=None, target=None)}, "has no target"),
    ],
)
def test_invalid_input_is_one_line(entries, why):
    with pytest.raises(InputError, match=why) as raised:
        hierroom.advise(**entries)
    assert "\n" not in str(raised.value)


def test_rules_alone_give_the_chain_and_no_predictions(tmp_path):
    RULES.to_toml(tmp_path / "f.toml")
    advice = hierroom.advise(rules=tmp_path / "f.toml")
    assert (advice.predictions, advice.costs) == ({}, None)
    assert advice.chain["fewest goals"] == 4
    assert advice.chain["bottleneck"] in RULES.names
    assert "rules alone have nothing to play" in str(advice)


def test_model_predicts_three_methods_in_every_world():
    model = read_model()
    assert {method for method, _, _ in model.fits} == {"hippo", "ppo-bonus", "ppo"}
    assert len(model.tasks) > 130
    assert {world for method, _, world in model.fits if method == "hippo"} == {"escape_room", "workshop", "other"}
    for fit in model.fits.values():
        assert 0 < fit.low < 1 < fit.high
        if fit.world == "other":
            assert fit.low <= 0.25
            assert fit.high >= 4


def test_goal_that_is_true_at_reset_gives_its_fact_from_the_start():
    goals = {f"at {n}": lambda env, info, n=n: env.unwrapped.at == n for n in range(3)}
    task = line(goals=goals, rules={"at 0": {}, "at 1": {"needs": "at 0"}, "at 2": {"needs": "at 1"}}, target="at 2")
    assert hierroom.advise(task=task, play_steps=2000).rules.broken == {}


class Luck(Line):
    """Do the other action at times that no seed determines."""

    chance = np.random.default_rng()

    def step(self, action):
        return super().step(action if self.chance.random() < 0.5 else 1 - action)


LUCK = replace(line(), make=Luck)


def test_check_tells_whether_episodes_and_runs_repeat():
    config = hierroom.find_preset("task").changed(num_envs=2, sequence_length=8, minibatches=1, epochs=1)
    steady = check(config.changed(graph="a", size=11))
    assert (steady["episodes"], steady["resume"]) == ("repeat", "exact")
    assert steady["observations"].startswith("observation uint8 [7, 7, 3]")
    assert "weights, reads view" in steady["controller_0"]
    lucky = check(config.changed(task=name_in_module(LUCK)))
    assert lucky["episodes"].startswith("do not repeat")
    assert lucky["resume"].startswith("not exact: ")


def test_task_of_a_module_has_the_name_that_its_runs_have():
    assert hierroom.advise(task=LUCK, play_steps=2000).name == hierroom.EnvConfig(task=name_in_module(LUCK)).key


def test_advice_stays_if_the_training_for_its_speed_is_interrupted(monkeypatch):
    def interrupted(config):
        raise KeyboardInterrupt

    monkeypatch.setattr("hierroom.lab.advise.advise.training_speed", interrupted)
    advice = hierroom.advise("a", play_steps=100_000)
    assert (advice.training_speed, advice.method) == (None, "hippo")


def test_speed_of_training_is_not_measured_in_slow_tasks(monkeypatch):
    slow = replace(measure_costs(hierroom.EnvConfig("a"), play_steps=100_000), steps_per_second=100.0)
    monkeypatch.setattr("hierroom.lab.advise.advise.measure_costs", lambda *_: slow)
    monkeypatch.setattr("hierroom.lab.advise.advise.training_speed", lambda config: pytest.fail("it trained"))
    advice = hierroom.advise("a")
    assert (advice.training_speed, advice.method) == (None, "hippo")


def test_command_prints_advice_and_writes_repaired_rules(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["advise", "a", "--play-steps", "100000"]) == 0
    text = capsys.readouterr().out
    for part in (
        "a: 10",
        "random play",
        "hardest goal",
        "HiPPO (script)",
        "PPO+Bonus",
        "train --graph a --steps",
        "seconds\n",
        "similar tasks    ",
    ):
        assert part in text
    path = tmp_path / "rules.toml"
    words = ["advise", "--task", "workshop:4:9", "--play-steps", "60000", "--json", "--write", str(path)]
    assert main(words) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["predictions"]) == {"hippo", "ppo-bonus", "ppo"}
    assert hierroom.Rules.from_toml(path).target == "masterpiece"
    with pytest.raises(InputError, match="is there already"):
        main(words)


def test_steps_in_short():
    texts = [in_short(one) for one in (45, 994, 996, 1240, 9960, 210_000, 999_000, 1.24e6, math.inf)]
    assert texts == ["45", "994", "1.0k", "1.2k", "10k", "210k", "1.0M", "1.2M", "beyond"]
