"""Pairs of methods that a file names, on tables whose answers are known."""

import sys
from pathlib import Path

import pytest
from study_tables import measured_rows, run_rows, write_tables

from hierroom.errors import InputError

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.study import pairs  # noqa: E402

GRAPHS = ("one", "two", "three")
MEASURES = measured_rows(GRAPHS, rooms=(2, 3, 4), goals=(2, 4, 6), settings=(0, 0, 0))
STEPS = {"slow": (200, 400, 900), "fast": (100, 100, 100), "between": (100, 200, 300)}
FILE = """
[[pairs]]
method = "slow"
reference = "fast"
[[pairs]]
method = "fast"
reference = "between"
outcome = "steps_to_50"
"""


def rows() -> list[dict[str, str]]:
    return [
        {**row, "steps_to_50": str(int(row["steps_to_95"]) ** 2), "success_rate": "1.0"}
        for name, steps in STEPS.items()
        for row in run_rows({graph: [n] for graph, n in zip(GRAPHS, steps, strict=True)}, name)
    ]


def test_each_pair_has_its_own_reference_and_milestone(tmp_path):
    (tmp_path / "pairs.toml").write_text(FILE)
    named = pairs.read_pairs(tmp_path / "pairs.toml")
    found = pairs.compare(rows(), MEASURES, named, pairs.Options(Path("t.csv"), Path("p.toml")))
    assert [(one.method, one.outcome, one.ratio.value) for one in found] == [
        ("slow", "steps_to_95", pytest.approx(4)),
        ("fast", "steps_to_50", pytest.approx(0.25)),
    ]
    header, _, *lines = pairs.markdown(named, found).splitlines()
    assert header == "| method | reference | compared by | steps / reference's | verdict | slower on |"
    assert lines[0] == "| slow | fast | steps to 95% | 4.00 [2.00, 9.00] | slower | 3 of 3 |"
    assert lines[1].startswith("| fast | between | steps to 50% | 0.25 [")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "names no pairs"),
        ("pairs = 3", "names no pairs"),
        ("pairs = [3]", "has a method, a reference and, if need be, an outcome, not 3"),
        ("[[pairs]]\nmethod = 'slow'", "a reference"),
        (FILE + "seeds = 3", "an outcome, not"),
        ("[[pairs]]\nmethod = ['slow']\nreference = 'fast'", "the name of a method is text, not"),
        (FILE.replace("to_50", "to_60"), "an outcome must be one of steps_to_50, .*, not 'steps_to_60'"),
        ("[[pairs", "cannot read the pairs"),
    ],
)
def test_a_file_that_names_no_pairs_is_refused(tmp_path, text, message):
    (tmp_path / "pairs.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        pairs.read_pairs(tmp_path / "pairs.toml")


def test_the_command_prints_the_table(tmp_path, monkeypatch, capsys):
    write_tables(tmp_path, runs=rows(), measures=MEASURES)
    (tmp_path / "pairs.toml").write_text(FILE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["pairs", "runs.csv", "pairs.toml", "--measures", "measures.csv", "--seeds", "1"])
    assert pairs.main() == 0
    assert len(capsys.readouterr().out.splitlines()) == 4
    (tmp_path / "pairs.toml").write_text(FILE.replace('= "fast"', '= "nobody"'))
    with pytest.raises(InputError, match="there is no 'nobody'"):
        pairs.main()
