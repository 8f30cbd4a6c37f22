"""The study's table of factors, on tables with known answers."""

import sys
from pathlib import Path

import numpy as np
import pytest
from study_tables import measured_rows, run_rows, write_tables

from benchmarks.study import factors, forest, trained
from hierroom.support.errors import InputError

GRAPHS = ("one", "two", "three")
MEASURES = measured_rows(GRAPHS, rooms=(2, 3, 4), goals=(2, 4, 6), settings=(0, 0, 0))
STEPS = {
    "as it is": {"one": [100, 120], "two": [200, 220], "three": [300, 330]},
    "slower": {"one": [200, 240], "two": [400, 440], "three": [900, 990]},
    "never": {"one": [100, 120], "two": [None, None], "three": [None, None]},
}
FIRST_TWICE = {name: {graph: [one, one] for graph, (one, _) in steps.items()} for name, steps in STEPS.items()}


def rows_of(*variants, steps=STEPS):
    return [
        {**row, "variant": name, "steps_to_50": row["steps_to_95"] or "40", "success_rate": success}
        for name in variants
        for row in run_rows(steps[name])
        for success in [str(1.0 if row["steps_to_95"] else 0.25)]
    ]


def options(**changed):
    return factors.Options(Path("runs.csv"), **changed)


def test_ratio_is_a_median_over_graphs_with_interval():
    reference, slower = factors.factors(rows_of("as it is", "slower"), MEASURES, options())
    assert reference.ratio is None
    assert slower.ratio.value == pytest.approx(2.0)
    assert 200 / 120 <= slower.ratio.low < 2.0  # two graphs, whose seeds are 10 to 20% apart, have a ratio of 2
    assert 2.5 < slower.ratio.high <= 990 / 300  # the third has 3
    assert (slower.slower, slower.graphs, slower.works, slower.success) == (3, 3, 3, (1.0, 1.0, 1.0))


@pytest.mark.parametrize("graphs", [("one",), ("one", "two"), GRAPHS])
def test_one_seed_on_few_graphs_gives_no_verdict(graphs):
    rows = [row for row in rows_of("as it is", "slower") if row["graph"] in graphs]
    _, slower = factors.factors(rows, MEASURES, options(seeds=1))
    n = len(graphs)
    assert factors.cells(slower)[1:5] == ["steps to 95%", "2.00", "-", f"{n} of {n}"]


def test_method_below_95_is_compared_by_steps_to_50():
    _, never = factors.factors(rows_of("as it is", "never"), MEASURES, options())
    assert never.outcome == "steps_to_50"
    _, never = factors.factors(rows_of("as it is", "never"), MEASURES, options(outcome="steps_to_95"))
    assert never.ratio.value == float("inf")
    assert (never.slower, never.works, never.success) == (2, 1, (0.25, 0.25, 1.0))


def test_factors_command_prints_the_table(monkeypatch, capsys, tmp_path):
    write_tables(tmp_path, runs=rows_of("slower", "as it is", steps=FIRST_TWICE), measures=MEASURES)
    words = [f"{tmp_path}/runs.csv", "--measures", f"{tmp_path}/measures.csv", "--seeds", "2"]
    monkeypatch.setattr(sys, "argv", ["factors", *words])
    assert factors.main() == 0
    assert capsys.readouterr().out.splitlines() == [
        "| method | compared by | steps / reference's | verdict | slower on | success | above 50% on |",
        "|---|---|---:|---|---:|---:|---:|",
        "| hippo as it is | - | - | - | - | 100.0% | 3 of 3 |",
        "| hippo slower | steps to 95% | 2.00 [2.00, 3.00] | slower | 3 of 3 | 100.0% | 3 of 3 |",
    ]


def test_verdict_depends_on_the_interval_of_the_ratio():
    def verdict(first, second):
        rows, reference = rows_of(first, second, steps=FIRST_TWICE), f"hippo {first}"
        found = factors.factors(rows, MEASURES, options(reference=reference, outcome="steps_to_95"))
        return factors.markdown(found).splitlines()[-1].split(" | ")[2:4]

    assert verdict("as it is", "slower")[1] == "slower"
    assert verdict("slower", "as it is")[1] == "faster"
    assert verdict("as it is", "never") == ["∞ [1.00, ∞]", "no significant difference"]
    assert verdict("never", "as it is") == ["0.00 [0.00, 1.00]", "no significant difference"]


def test_graph_with_equal_runs_has_no_ratio():
    def runs_of(variant, area):
        """Return runs of a variant that equal those of "as it is" on two of the graphs."""
        rows = zip(rows_of("as it is"), rows_of(variant), strict=True)
        chosen = (other if other["graph"] == "three" else {**one, "variant": variant} for one, other in rows)
        return [{**row, "area_under_curve": area, "length": "60", "greedy_length": "9"} for row in chosen]

    rows = runs_of("as it is", "0.5") + runs_of("slower", "0.5")
    _, slower = factors.factors(rows, MEASURES, options())
    assert (slower.slower, slower.compared, slower.graphs, slower.works) == (1, 1, 3, 3)
    assert slower.ratio.value == pytest.approx(3)
    assert factors.markdown([slower]).splitlines()[-1].endswith("| slower | 1 of 1 | 100.0% | 3 of 3 |")
    _, slower = factors.factors(runs_of("as it is", "0") + runs_of("slower", "0"), MEASURES, options())
    assert slower.compared == 3, "runs that learn nothing may end alike by chance"
    second = [{**row, "length": row["variant"]} if row["seed"] == "1" else row for row in rows]
    assert {row["seed"] for row in rows} == {"0", "1"}
    _, slower = factors.factors(second, MEASURES, options())
    assert slower.compared == 1, "one seed is enough: equal runs of different processors differ by rounding"
    other = [{**row, "achieved_key_1": "0.5" if row["variant"] == "slower" else "0.6"} for row in rows]
    _, slower = factors.factors(other, MEASURES, options())
    assert slower.compared == 3, "one lucky episode can give equal areas, and all others the greatest length"
    same = [row for row in rows if row["graph"] != "three"]
    with pytest.raises(InputError, match="the runs of hippo slower and of hippo as it is are the same on every goal"):
        factors.factors(same, MEASURES, options())


def test_success_of_50_percent_is_not_above_50():
    rows = [{**row, "success_rate": "0.5"} for row in rows_of("as it is", "slower")]
    assert [one.works for one in factors.factors(rows, MEASURES, options())] == [0, 0]


def test_unknown_reference_raises_input_error():
    with pytest.raises(InputError, match="the table's methods are hippo as it is, hippo slower; there is no 'ppo'"):
        factors.factors(rows_of("as it is", "slower"), MEASURES, options(reference="ppo"))


def test_runs_of_different_lengths_raise_input_error():
    rows = [{**row, "steps": "1" if row["variant"] == "slower" else "2"} for row in rows_of("as it is", "slower")]
    with pytest.raises(InputError, match="the two methods were trained with different steps: 1, 2"):
        factors.factors(rows, MEASURES, options())


def test_ambiguous_method_names_raise_input_error():
    rows = [
        {"method": "hippo", "variant": "", "meta": "random"},
        {"method": "hippo", "variant": "", "meta": "fixed-dfs"},
        {"method": "hippo", "variant": "random", "meta": "fixed-dfs"},
    ]
    with pytest.raises(InputError, match="are both called hippo random"):
        trained.method_names(rows)
    with pytest.raises(InputError, match="each row of a table of training runs needs a method"):
        trained.method_names([{"graph": "a"}])
    with pytest.raises(InputError, match="the table holds no training runs"):
        trained.method_names([])


def test_forest_draws_a_line_per_method_and_arrows():
    found = factors.factors(rows_of("as it is", "slower", "never"), MEASURES, options(outcome="steps_to_95"))
    (axes,) = forest.draw(found).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["hippo slower", "hippo never"]
    assert axes.yaxis_inverted()
    lines = {(line.get_marker(), *np.ravel(line.get_xydata()).round(3).tolist()) for line in axes.lines[1:]}
    _, slower, never = (one.ratio for one in found)
    edge = forest.MARGIN * max(slower.high, never.low)
    assert lines == {
        ("None", round(slower.low, 3), 0, round(slower.high, 3), 0),
        ("o", 2, 0),
        ("None", round(never.low, 3), 1, round(edge, 3), 1),
        (">", round(edge, 3), 1),
        ("o", round(edge / forest.BESIDE, 3), 1),
    }
    with pytest.raises(InputError, match="there is no method besides hippo"):
        forest.draw(found[:1])


def test_forest_command_draws_a_picture(monkeypatch, capsys, tmp_path):
    write_tables(tmp_path, runs=rows_of("as it is", "slower"), measures=MEASURES)
    words = [f"{tmp_path}/runs.csv", "--measures", f"{tmp_path}/measures.csv", "--out", f"{tmp_path}/new/f.png"]
    monkeypatch.setattr(sys, "argv", ["forest", *words])
    assert forest.main() == 0
    assert (tmp_path / "new" / "f.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().out == f"drawn: {tmp_path}/new/f.png\n"
