"""Lists of reports as CSV and Markdown."""

import pytest

from hierroom.commands.complexity import main
from hierroom.complexity import analyze
from hierroom.complexity.tables import COLUMNS, list_text
from hierroom.goals import GoalGraph
from hierroom.support.errors import InputError

REPORTS = [
    analyze("a"),
    analyze(GoalGraph((0, 1), 2, label="my_50%"), True),
    analyze(GoalGraph(tuple(range(9)), 9), True),
]


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
