"""Cells of CSV tables: numbers, texts, and errors that name line and column."""

import pytest

from hierroom.runs.folder.csv_table import CSVTable
from hierroom.support.errors import InputError

CELLS = {"steps": 0.0, "graph": None, "success_rate": 0.0, "length": None}


@pytest.fixture
def checked(tmp_path):
    table = CSVTable(tmp_path / "evaluations.csv", CELLS, texts=("graph",))
    table.append([{"steps": n, "graph": "=c", "success_rate": n / 100, "length": float("nan")} for n in (10, 20, 30)])
    return table


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ((b",0.2,", b",abc,"), "line 3: success_rate is a number from 0 to 1, not 'abc'"),
        ((b",0.2,", b",7,"), "line 3: success_rate is a number from 0 to 1, not '7'"),
        ((b",0.2,", b",,"), "line 3: success_rate is a number from 0 to 1, not ''"),
        ((b",0.2,nan", b",0.2,inf"), "line 3: length is a number of at most .*, not 'inf'"),
        ((b"success_rate", b"success"), "line 1 has no column success_rate"),
    ],
)
def test_invalid_cell_error_names_line_and_column(change, said, checked):
    broken = checked.path.read_bytes().replace(*change)
    checked.path.write_bytes(broken)
    for use in (CSVTable.read, CSVTable.measure, CSVTable.keep):
        with pytest.raises(InputError, match=rf"evaluations\.csv is broken: {said}"):
            use(CSVTable(checked.path, CELLS, texts=("graph",)))
    assert checked.path.read_bytes() == broken


def test_empty_number_cell_is_read_as_nan(checked):
    checked.path.write_bytes(checked.path.read_bytes().replace(b",nan", b","))
    assert [row["length"] for row in checked.read()] == ["nan"] * 3


def test_formula_like_graph_name_is_written_as_text(checked):
    assert b"\r\n10,'=c,0.1,nan\r\n" in checked.path.read_bytes()
    checked.append([{"steps": 40, "graph": "=c", "success_rate": 1, "more": 5}])
    assert [row["graph"] for row in checked.read()] == ["=c"] * 4


def test_row_with_line_breaks_is_written_as_one_line(tmp_path):
    table = CSVTable(tmp_path / "episodes.csv")
    table.append([{"steps": 1, "graph": 'a\r\nb,"c"\x85d'}, {"steps": 2, "graph": "\udcff"}])
    assert [row["graph"] for row in table.read()] == ['a b,"c" d', "\\udcff"]


@pytest.mark.parametrize("letter", ["a", '"', "\udcff", "\N{GRINNING FACE}"])
def test_a_cell_of_any_length_can_be_read_back(letter, tmp_path):
    table = CSVTable(tmp_path / "episodes.csv")
    table.append([{"steps": 1, "graph": letter, "goals": letter * 2**18}, {"steps": 2, "graph": letter}])
    assert CSVTable(table.path).n_rows == 2
    assert {row["graph"] for row in table.read()} == {letter.encode(errors="backslashreplace").decode()}
