"""Lists of reports as CSV, LaTeX and Markdown."""

import pytest

from hierroom.commands.complexity import main
from hierroom.complexity import analyze
from hierroom.complexity.tables import COLUMNS, list_text
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError
from hierroom.support.tables import latex_table

REPORTS = [
    analyze("a"),
    analyze(GoalGraph((0, 1), 2, label="my_50%"), True),
    analyze(GoalGraph(tuple(range(9)), 9), True),
]


def test_latex_has_a_line_for_each_graph_and_escapes_names():
    lines = list_text(REPORTS, "latex").splitlines()
    assert lines[0].startswith(r"\begin{tabular}{lrrrrrrr}")
    assert [line for line in lines if line.endswith("rule")] == [r"\toprule", r"\midrule", r"\bottomrule"]
    assert lines[4] == r"a & 2 & 1 & 5 & 5 & 8.36 & 28.0 & 20.3 \\"
    assert lines[5].startswith(r"my\_50\% & ")
    assert all(line.count("&") == 7 for line in lines if line.endswith(r"\\"))
    assert "e+06" not in lines[6]  # seven digits are written out
    signs = latex_table(["graph", "random"], [["a", "<0.004"], ["b|c", ">7.2"]]).splitlines()
    assert signs[4] == r"a & \textless{}0.004 \\"
    assert signs[5] == r"b\textbar{}c & \textgreater{}7.2 \\"


def test_markdown_columns_and_csv_precision_of_reports():
    assert list_text(REPORTS, "csv").splitlines()[1].split(",")[-2] == repr(REPORTS[0].expected_steps)
    lines = list_text(REPORTS, "markdown").splitlines()
    assert {line.count("|") for line in lines} == {len(COLUMNS) + 1}
    assert lines[2] == "| a | 2 | 1 | 5 | 5 | 8.36 | 28.0 | 20.3 |"


def test_walk_option_changes_the_report(capsys):
    main(["--graph", "c", "--walk", "0.5", "0.4", "0.1", "--markdown"])
    assert "| c | 4 | 1 | 9 | 14 | 10.61 | 60.8 | 53.2 |" in capsys.readouterr().out
    with pytest.raises(InputError, match=r"must sum to 1, not 1\.3"):
        main(["--walk", "0.5", "0.4", "0.4"])
