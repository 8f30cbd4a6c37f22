"""Cells of tables: numbers within their range, texts that no spreadsheet reads as formulas, and narrow terminals."""

import io
import math

import pytest
from rich.console import Console
from rich.table import Table

from hierroom.support.cells import has_range, plain_cell, read_number, text_of_cell
from hierroom.support.errors import InputError
from hierroom.support.tables import csv_text, print_table


@pytest.mark.parametrize(
    ("column", "cell", "said"),
    [
        ("success_rate", "7", "success_rate is a number from 0 to 1, not '7'"),
        ("success_rate", "0,95", "a number from 0 to 1, not '0,95'"),
        ("length", "-5", r"length is a number of at least 0, not '-5'"),
        ("steps_to_95", "inf", r"a number of at most 4\.6e\+18, not 'inf'"),
        ("episodes", "2.5", "episodes is a whole number of at least 0, not '2.5'"),
        ("return", "-inf", r"return is a number of at least -4\.6e\+18, not '-inf'"),
        ("return", "abc", "return is a number, not 'abc'"),
    ],
)
def test_invalid_number_cell_raises_input_error(column, cell, said):
    with pytest.raises(InputError, match=said):
        read_number(cell, column)


def test_read_number_reads_valid_cells():
    read = {"success_rate": "1", "length": "0", "return": "-3.5", "loss": "inf", "steps": "1.2E+09"}
    assert [read_number(cell, column) for column, cell in read.items()] == [1, 0, -3.5, math.inf, 1.2e9]
    assert math.isnan(read_number("", "success_rate"))
    assert math.isnan(read_number("nan", "length"))
    for cell in ("", "nan"):
        with pytest.raises(InputError, match="success_rate is a number from 0 to 1, not"):
            read_number(cell, "success_rate", 0)
    with pytest.raises(InputError, match=r"episodes is a whole number of at least 1, not '0'"):
        read_number("0", "episodes", 1)
    assert [name for name in ("x:Y_success_rate", "seconds", "method", "success", "notes") if has_range(name)] == [
        "x:Y_success_rate",
        "seconds",
    ]


@pytest.mark.parametrize("text", ["=cmd|' /C calc'!A0", "@SUM(1)", "+1 room", "-x", "\tx", "'=x", "''-x"])
def test_formula_like_text_is_quoted_and_read_back(text):
    cell = plain_cell(text)
    assert cell == f"'{text}"
    assert text_of_cell(cell) == text
    assert csv_text([{"name": text, "n": -1.5}]).splitlines()[1].lstrip('"').startswith("'")


@pytest.mark.parametrize("text", ["-0.5", "+3", "a=b", "'quoted'", "it's", ""])
def test_plain_cell_keeps_numbers_and_other_texts(text):
    assert plain_cell(text) == text_of_cell(text) == text


def printed(width: int) -> str:
    table = Table(title="what an agent did")
    table.add_column("mixing\ntime", no_wrap=True)
    table.add_column("what it did")
    table.add_column("hitting time", justify="right")
    for name, text, number in (("keys-0-1-2-3-exit-4", "reached the exit in time", "[b]1,234.5[/b]"), ("a", "", "8")):
        table.add_row(name, text, number)
    stream = io.StringIO()
    print_table(table, Console(file=stream, width=width))
    return stream.getvalue()


@pytest.mark.parametrize("width", [1, 20, 40, 80, 200])
def test_unwrapped_columns_are_whole_at_any_width(width):
    text = printed(width)
    assert "keys-0-1-2-3-exit-4" in text
    assert "1,234.5" in text
    assert "mixing" in text
    assert "…" not in text
    lines = {len(line) for line in text.splitlines()[1:]}
    assert max(lines) <= max(width, 60)
