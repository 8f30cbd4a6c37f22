"""Comparisons of methods that a file names, on tables with known answers."""

import sys

import pytest
from study_tables import measured_rows, run_rows, write_tables

from benchmarks.study import comparisons
from hierroom.support.errors import InputError

GRAPHS = ("one", "two", "three")
MEASURES = measured_rows(GRAPHS, rooms=(2, 3, 4), goals=(2, 4, 6), settings=(0, 0, 0))
STEPS = {"slow": (200, 400, 900), "fast": (100, 100, 100), "between": (100, 200, 300)}
FILE = """
[[comparisons]]
method = "slow"
reference = "fast"
[[comparisons]]
method = "fast"
reference = "between"
outcome = "steps_to_50"
"""


def rows() -> list[dict[str, str]]:
    return [
        {**row, "steps_to_50": str(int(row["steps_to_95"]) ** 2), "success_rate": "1.0"}
        for name, steps in STEPS.items()
        for row in run_rows({graph: [n, 3 * n] for graph, n in zip(GRAPHS, steps, strict=True)}, name)
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "takes only comparisons, each beginning with"),
        (FILE + "[[comparison]]", "takes only comparisons, .*, and holds comparison"),
        ("comparisons = [3]", "comparison 1 has a method, a reference and, if need be, an outcome, not 3"),
        ("[[comparisons]]\nmethod = ['slow']\nreference = 'fast'", "the name of a method is text, not"),
        (FILE.replace("between", "fast"), "comparison 2: 'fast' is compared with itself"),
        (FILE.replace("to_50", "to_60"), "comparison 2: a milestone must be one of steps_to_50, .*, not 'steps_to_60'"),
        ("[[comparisons", "is not a TOML file"),
    ],
)
def test_invalid_comparison_files_raise_input_error(tmp_path, text, message):
    (tmp_path / "compared.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        comparisons.read_comparisons(tmp_path / "compared.toml")


def test_comparisons_command_prints_the_table(tmp_path, monkeypatch, capsys):
    write_tables(tmp_path, runs=rows(), measures=MEASURES)
    (tmp_path / "compared.toml").write_text(FILE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        sys, "argv", ["comparisons", "runs.csv", "compared.toml", "--measures", "measures.csv", "--seeds", "1"]
    )
    assert comparisons.main() == 0
    header, _, first, second = capsys.readouterr().out.splitlines()
    assert header == "| method | reference | compared by | steps / reference's | verdict | slower on |"
    assert first == "| slow | fast | steps to 95% | 4.00 | - | 3 of 3 |"  # three graphs are too few for one seed
    assert second.startswith("| fast | between | steps to 50% | 0.25 | - |")
    (tmp_path / "compared.toml").write_text(FILE.replace('= "fast"', '= "nobody"'))
    with pytest.raises(InputError, match="there is no 'nobody'"):
        comparisons.main()
    (tmp_path / "compared.toml").unlink()
    with pytest.raises(InputError, match=r"^cannot read the comparisons compared\.toml: No such file or directory$"):
        comparisons.main()
