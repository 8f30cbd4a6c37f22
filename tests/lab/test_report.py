"""The report: what its page holds is what the runs were, and nothing that a run says can be anything but text."""

import json
from types import SimpleNamespace

import evaluated_runs
import numpy as np
import pytest
from report_page import HOSTILE, Page, hostile_run

import hierroom
from hierroom.agents.decision_tape import DecisionTape
from hierroom.agents.recorder import record
from hierroom.commands.report import main
from hierroom.lab.compare.comparison import compare
from hierroom.lab.compare.evaluated_run import read_run, runs_inside
from hierroom.lab.compare.grouping import group_runs
from hierroom.lab.compare.tasks import Tasks
from hierroom.lab.report.curves import RESAMPLES, compare_runs, curve_rows, training_goals
from hierroom.lab.report.page import script_json
from hierroom.lab.report.replay import LETTERS, _chosen, replay
from hierroom.lab.report.runs import read_runs
from hierroom.learners.policy import Decision
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.support.errors import InputError
from hierroom.turns.records import CONTROLLER, META
from hierroom.worlds.env_config import EnvConfig
from hierroom.worlds.escape_room.constants import MARGIN
from hierroom.worlds.escape_room.render import view_of

TINY = {"graph": "a", "size": 11, "max_steps": 60, "num_envs": 16, "minibatches": 2, "steps": 2048}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder of three small runs: two seeds, and another meta-controller that learns."""
    out = tmp_path_factory.mktemp("reported")
    common = {**TINY, "evaluations": 3, "evaluation_episodes": 10}
    for seed in (0, 1):
        hierroom.train(meta="fixed-dfs", seed=seed, out=out / "runs" / f"dfs{seed}", **common)
    hierroom.train(meta="learned", out=out / "runs" / "learned", **common)
    return out


def report(tmp_path, *arguments):
    out = tmp_path / "report.html"
    assert main([*map(str, arguments), "--out", str(out), "--played", "20"]) == 0
    return Page(out)


@pytest.fixture(scope="module")
def page(runs, tmp_path_factory):
    return report(tmp_path_factory.mktemp("page"), runs)


def test_the_page_loads_nothing(page):
    assert not [(tag, name) for tag, names in page.elements for name in names if name in ("src", "srcset", "action")]
    links = [names["href"] for tag, names in page.elements if "href" in names]
    assert links
    assert all(link.startswith("#") for link in links)
    policy = next(names["content"] for tag, names in page.elements if names.get("http-equiv"))
    assert policy.startswith("default-src 'none';")
    assert len(page.source) < 3e6


def test_each_link_and_label_leads_somewhere(page):
    ids = [names["id"] for _, names in page.elements if "id" in names]
    assert len(ids) == len(set(ids))
    assert {names["href"][1:] for _, names in page.elements if "href" in names} <= set(ids)
    assert {names["aria-labelledby"] for _, names in page.elements if "aria-labelledby" in names} <= set(ids)


def test_the_chart_library_is_whole(page):
    from plotly.offline import get_plotlyjs

    assert page.plotly == get_plotlyjs()


def test_the_tables_tell_of_the_runs(page, runs):
    for name in ("dfs0", "dfs1", "learned"):
        assert name in page.text
        rows = RunFolder(runs / "runs" / name).evaluations.read()
        assert f"{float(rows[-1]['success_rate']):.1%}" in page.text
    assert "3 runs in 2 groups: fixed-dfs; learned" in page.text
    assert "meta_ppo.gamma" in page.text
    assert "learning_rate" in page.text


def test_a_single_run_shows_all_its_entries_and_where_it_came_from(runs, tmp_path):
    page = report(tmp_path, runs / "runs" / "dfs0")
    for name, value in (("max_steps", "60"), ("num_envs", "16"), ("meta", "fixed-dfs")):
        assert f"{name}{value}" in "".join(page.text.split())
    assert "meta_ppo" not in page.text  # no learned meta-controller, so nothing of its learner's
    assert "numpy" in page.text
    bold = page.source.split('<tr class="other">')[1:]
    assert [part.split("</th>")[0].removeprefix('<th scope="row">') for part in bold] == [
        "graph", "size", "max_steps", "meta", "minibatches", "steps", "evaluations", "evaluation_episodes", "num_envs",
    ]  # fmt: skip


def test_curves_are_those_of_a_comparison(page, runs):
    groups = group_runs([read_run(path) for path in runs_inside(runs)], ("meta",))
    tasks = Tasks.common(groups)
    for metric in ("success_rate", "length"):
        comparison = compare(groups, tasks, metric, RESAMPLES, 0)
        for summary in comparison.of_graph("a"):
            number = comparison.groups.index(summary.group)
            assert page.data["groups"][number]["label"] == summary.group.label
            (drawn,) = [
                curve
                for curve in page.data["curves"]
                if (curve["group"], curve["graph"], curve["metric"]) == (number, "a", metric)
            ]
            np.testing.assert_allclose(drawn["values"], summary.curve.values, rtol=1e-4)
            lows = np.array([np.nan if low is None else low for low in drawn["lows"]])
            np.testing.assert_allclose(lows, summary.curve.lows, rtol=1e-4)


def test_graphs_that_not_every_group_has_have_curves_too(tmp_path):
    for name, meta, graph in (("one", "fixed-dfs", "a"), ("two", "random", "a"), ("three", "random", "b")):
        evaluated_runs.make_run(tmp_path / name, {graph: evaluated_runs.line(1.0)}, meta=meta)
    curves = compare_runs(read_runs([tmp_path])[0], None)
    found = {(curves.labels[row["group"]], row["graph"], row["n"]) for row in curve_rows(curves)}
    assert found == {("fixed-dfs", "a", 1), ("random", "a", 1), ("random", "b", 1)}


def test_steps_to_a_success_rate_stand_beside_complexity(tmp_path, capsys):
    for graph, end in (("a", 1.0), ("c", 0.4)):
        evaluated_runs.make_run(tmp_path / "in" / graph, {graph: evaluated_runs.line(end)})
    page = report(tmp_path, tmp_path / "in")
    points = {point["graph"]: point["steps_to"] for point in page.data["points"]}
    assert points["a"] == pytest.approx({"50": 500_000, "90": 900_000, "95": 950_000}, rel=1e-4)
    assert points["c"] == {"50": None, "90": None, "95": None}
    measures = {row["name"]: row["measures"] for row in page.data["complexity"]}
    assert measures["c"]["expected_steps"] == pytest.approx(73.8, abs=0.05)
    assert measures["a"]["hitting_time"] == pytest.approx(8.36, abs=0.005)
    said = capsys.readouterr().out
    assert "not played: " in said  # these runs have no checkpoints
    assert "has no checkpoint" in said
    assert page.data["replays"] == []
    assert '<section id="replay"' not in page.source


@pytest.mark.slow
def test_runs_that_cannot_be_played_take_no_place_of_those_that_can(tmp_path, capsys):
    for name in ("one", "two"):
        evaluated_runs.make_run(tmp_path / "in" / name, {"a": evaluated_runs.line(1.0)})
    hierroom.train(**TINY, out=tmp_path / "in" / "whole")
    page = report(tmp_path, tmp_path / "in", "--replays", 1)
    assert [replay["run"] for replay in page.data["replays"]] == ["whole"]
    assert "episodes were played by 1 of 3 runs\n" in capsys.readouterr().out, "there is nothing more to play"
    hierroom.train(**TINY, gamma=0.5, out=tmp_path / "in" / "other")
    report(tmp_path, tmp_path / "in", "--replays", 1)
    assert "episodes were played by 1 of 4 runs; --replays N plays more\n" in capsys.readouterr().out


def test_runs_that_cannot_be_compared_are_shown_one_by_one(tmp_path):
    for name in ("one", "same"):
        evaluated_runs.make_run(tmp_path / "in" / name, {"a": evaluated_runs.line(1.0)})
    page = report(tmp_path, tmp_path / "in", "--replays", 0)
    assert "the runs are shown one by one: " in page.text
    assert [group["label"] for group in page.data["groups"]] == ["one", "same"]
    assert page.data["curves"] == []
    assert len(page.data["runs"]) == 2


def test_graphs_in_which_keys_can_be_dropped_are_points_and_rows_of_their_own(tmp_path):
    for drops, start in ((False, 0.0), (True, 1.0)):
        folder = tmp_path / "in" / f"drops{drops}"
        evaluated_runs.make_run(folder, {"a": evaluated_runs.line(1.0, start)}, drop_key=drops)
    page = report(tmp_path, tmp_path / "in", "--replays", 0)
    measured = {row["label"]: row["measures"]["expected_steps"] for row in page.data["complexity"]}
    assert measured == pytest.approx({"a": 28.007, "a, keys can be dropped": 40.488}, abs=1e-3)
    steps = {point["label"]: point["steps_to"]["95"] for point in page.data["points"]}
    assert steps == {"a": 950_000, "a, keys can be dropped": 0}
    assert "a, keys can be dropped40.49" in "".join(page.text.split("\n")).replace("  ", "")


def test_greedy_actions_are_told(tmp_path):
    hierroom.train(**TINY, evaluations=1, out=tmp_path / "run")
    assert report(tmp_path, tmp_path / "run", "--greedy").data["is_greedy"]
    assert not report(tmp_path, tmp_path / "run").data["is_greedy"]


def test_a_run_without_evaluations_has_no_curve_but_a_replay(tmp_path):
    hierroom.train(**TINY, evaluations=0, out=tmp_path / "run")
    page = report(tmp_path, tmp_path / "run", "--episodes", 2)
    assert "no learning curve: " in page.text
    assert '<section id="learning"' not in page.source
    assert len(page.data["replays"][0]["episodes"]) == 2


def tiles_of(letters):
    return np.array([LETTERS.index(letter) for letter in letters])


def assert_same(told, episode):
    tiles = tiles_of(told["tiles"])
    for step, state in enumerate(episode.states()):
        if step:
            for cell, tile in told["changes"][step - 1]:
                tiles[cell] = tile
        np.testing.assert_array_equal(tiles, state.grids[0, MARGIN:-MARGIN, MARGIN:-MARGIN].ravel())
        np.testing.assert_array_equal(tiles_of(told["views"][step]), view_of(state).ravel())
        level = state.levels[0]
        assert (told["rows"][step], told["cols"][step]) == (level.row - MARGIN, level.col - MARGIN)
        assert told["directions"][step] == level.direction
        assert (told["keys"][step], told["doors"][step]) == (level.keys, level.doors)
        if told["rooms"][step] >= 0:
            top, left, bottom, right = level.rectangles[told["rooms"][step]]
            assert top <= level.row <= bottom
            assert left <= level.col <= right
        else:
            assert (level.row, level.col) in set(map(tuple, level.doors_at.tolist()))
    assert len(told["views"]) == len(episode) + 1
    assert told["goals"] == episode.goals.tolist()


@pytest.mark.parametrize("entries", [{"graph": "f"}, {"graph": "c", "drop_key": True}, {"graph": "b", "size": 11}])
def test_a_replay_has_every_state(entries):
    for player in ("oracle", "random"):
        episode = next(hierroom.rollout(player, EnvConfig(**{"max_steps": 300, **entries}), 1))
        told = json.loads(json.dumps(replay(episode)))
        assert_same(told, episode)
        assert told["controller"] is None
        assert told["success"] is episode.success
        assert {told["names"][str(goal)] for goal in told["achieved"] if goal >= 0} == {e.name for e in episode.events}


@pytest.mark.parametrize("greedy", [False, True])
def test_a_replay_has_what_the_agents_computed(runs, greedy):
    agent = hierroom.load(runs / "runs" / "learned", greedy=greedy)
    tape = DecisionTape(agent.pair(4, seed=5))
    for env, episode in enumerate(record(agent.turns(4, seed=5), tape, 4)):
        decisions = tape.of_first_episode(CONTROLLER, env, len(episode))
        assert decisions.steps.tolist() == list(range(len(episode)))
        np.testing.assert_allclose(decisions.probabilities.sum(axis=1), 1, rtol=1e-5)
        taken = decisions.probabilities[np.arange(len(episode)), episode.actions]
        assert (taken > 0).all()
        if greedy:
            np.testing.assert_array_equal(taken, decisions.probabilities.max(axis=1))
        told = tape.of_first_episode(META, env, len(episode))
        starts = [subgoal.first_step - 1 for subgoal in episode.subgoals]
        if told is not None:  # it may be warming up still
            assert told.steps.tolist() == starts
            assert told.probabilities.shape == (len(starts), 14)
            goals = [subgoal.goal for subgoal in episode.subgoals]
            assert (told.probabilities[np.arange(len(goals)), goals] > 0).all()  # 13, the last, is no goal, as is -1
        assert_same(replay(episode, decisions, told), episode)


def test_an_escape_and_a_failure_of_each_graph_are_shown_first():
    played = [SimpleNamespace(success=letter.isupper(), variant=letter.lower()) for letter in "aaAbABBa"]
    assert _chosen(played, 8) == [2, 0, 5, 3, 1, 4, 6, 7]
    assert _chosen(played, 3) == [2, 0, 5]
    assert _chosen(played[:2], 3) == [0, 1]


def test_each_played_run_has_episodes_with_what_was_computed(page):
    assert {replay["run"] for replay in page.data["replays"]} == {"dfs0", "learned"}  # the first of each group
    for told in page.data["replays"]:
        assert len(told["episodes"]) == 3
        for one in told["episodes"]:
            assert len(one["controller"]["values"]) == len(one["actions"]) == len(one["views"]) - 1


def test_probabilities_are_over_legal_actions():
    logits, masks = np.log([[1.0, 2.0, 5.0], [3.0, 1.0, 1.0]]), np.array([[True, True, False], [True, True, True]])
    decision = Decision(np.arange(2), logits, masks, np.zeros(2))
    np.testing.assert_allclose(decision.probabilities, [[1 / 3, 2 / 3, 0], [0.6, 0.2, 0.2]])


def test_steps_per_goal_are_those_of_an_evaluation(page, runs):
    from hierroom.runs.evaluation import evaluate

    agent = hierroom.load(runs / "runs" / "dfs0")
    expected = evaluate(agent.pair(20, seed=0), agent.turns(20, seed=0), 20)
    (row,) = [row for row in page.data["goals"] if row["run"] == "dfs0"]
    assert row["success"] == expected.success_rate
    assert {goal["name"]: goal["share"] for goal in row["goals"]} == {
        name: steps.fraction for name, steps in expected.steps_to_goals.items()
    }


def test_goals_while_training(tmp_path):
    folder = RunFolder.create(tmp_path / "run", hierroom.TrainConfig())
    goals = ["", "key 1", "key 1 > door 1", "key 1 > door 1 > exit"] * 200
    columns = {"env": 0, "graph": "a", "success": 0, "length": 5, "return": 0.0}
    folder.episodes.append([{"steps": 10 * n, **columns, "goals": goal} for n, goal in enumerate(goals)])
    found = training_goals(folder)
    assert list(found["shares"]) == ["key 1", "door 1", "exit"]
    assert found["steps"][:2] == [95, 295]  # 40 bins of 20 episodes
    assert found["shares"] == {"key 1": [0.75] * 40, "door 1": [0.5] * 40, "exit": [0.25] * 40}
    few = RunFolder.create(tmp_path / "few", hierroom.TrainConfig())
    few.episodes.append([{"steps": n, **columns, "goals": "key 1" if n > 10 else ""} for n in range(25)])
    assert training_goals(few)["shares"] == {"key 1": [0.15385, 1]}
    assert training_goals(RunFolder(tmp_path / "none")) is None
    few.episodes.path.write_text("steps,graph\n1,a\n")
    with pytest.raises(InputError, match=r"episodes\.csv is broken: 'goals'"):
        training_goals(few)


def test_what_a_run_says_is_text(tmp_path, capsys):
    page = report(tmp_path, hostile_run(tmp_path))
    tags = [tag for tag, _ in page.elements]
    assert tags.count("script") == 4
    assert "img" not in tags
    assert "b" not in tags
    assert not [names for _, names in page.elements if any(name.startswith("on") for name in names)]
    assert HOSTILE in page.text
    assert "</script><script>alert(2)</script>" in page.text
    assert "</dd></dl><script>alert(4)</script>" in page.text
    assert "<script>alert" not in page.source
    assert page.data["runs"][0]["name"] == HOSTILE
    assert "{{7*7}}" in page.text  # nothing is a template but the templates


def test_json_in_a_script_cannot_end_it():
    value = {"</script>": ["<!--", "\u2028\u2029&amp;", float("nan"), float("inf")]}
    text = script_json(value)
    assert not set("<>&\u2028\u2029") & set(text)
    assert json.loads(text) == {"</script>": ["<!--", "\u2028\u2029&amp;", None, None]}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give the folders of the runs"),
        (["{run}", "--out", "report.pdf"], "a report is an .html file, not report.pdf"),
        (["{run}", "--out", "no/report.html"], "cannot write no/report.html: there is no folder no"),
        (["{run}", "--episodes", "0"], "episodes must be at least 1, not 0"),
        (["{run}", "--by", "gama"], "is it gamma?"),
    ],
)
def test_what_cannot_be_used_is_one_line(arguments, message, runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = [argument.replace("{run}", str(runs / "runs" / "dfs0")) for argument in arguments]
    with pytest.raises(InputError) as caught:
        main(given)
    assert message in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_broken_run_among_others_is_left_out(runs, tmp_path, capsys):
    bad = tmp_path / "bad"
    bad.mkdir()
    (bad / "config.json").write_text("{")
    deep = evaluated_runs.make_run(tmp_path / "deep", {"a": evaluated_runs.line(1.0)})
    (deep / "provenance.json").write_text("[" * 100_000 + "]" * 100_000)
    page = report(tmp_path, bad, deep, runs / "runs" / "dfs0", "--replays", 0)
    for path in (bad / "config.json", deep / "provenance.json"):
        assert f"left out: cannot read {path}: " in page.text
    with pytest.raises(InputError, match="cannot read"):
        main([str(bad), "--out", str(tmp_path / "b.html")])


def test_code_of_ones_own_is_not_run_without_trust(tmp_path, capsys):
    evaluated_runs.make_run(tmp_path / "run", {"a": evaluated_runs.line(1.0)}, meta="os:abort")
    page = report(tmp_path, tmp_path / "run")
    assert "names code that does not ship with hierroom: meta 'os:abort'" in page.text
