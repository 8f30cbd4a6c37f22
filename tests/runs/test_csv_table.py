"""CSV tables that grow: rows counted and kept, torn rows ignored, columns added, damage refused with its place."""

import codecs
import errno
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hierroom.runs.folder.csv_table import CSVTable
from hierroom.support.errors import InputError
from hierroom.support.files import sync

ROWS = [{"steps": n, "loss": n / 2, "graph": f"g{n}, of {n}"} for n in (10, 20, 30)]


@pytest.fixture
def table(tmp_path):
    table = CSVTable(tmp_path / "metrics.csv")
    table.append(ROWS)
    return table


def steps(table: CSVTable) -> list[int]:
    return [int(row["steps"]) for row in table.read()]


@given(cut=st.integers(1, 90), tail=st.binary(max_size=40))
@settings(max_examples=200, derandomize=True)
def test_torn_row_after_a_crash_is_ignored(tmp_path_factory, cut, tail):
    path = tmp_path_factory.mktemp("torn") / "metrics.csv"
    CSVTable(path).append(ROWS)
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut] + tail.replace(b"\n", b"\0").replace(b"\r", b"\0"))
    torn = CSVTable(path)
    n = len(torn.read())
    assert n == max(0, whole[:-cut].count(b"\n") - 1)
    torn.append(ROWS[n:])
    assert path.read_bytes() == whole
    for n_rows in range(n + 1):
        path.write_bytes(whole[:-cut] + tail.replace(b"\n", b"\0"))
        table = CSVTable(path)
        assert table.keep(n_rows) == n_rows
        table.append(ROWS[n_rows:])
        assert path.read_bytes() == whole


@pytest.mark.parametrize(
    "tail", [b"\0" * 5000, b"\0" * 50 + b"\r\n", b"\r\n\r\n", b"40,1\r\n", b'40,"1\r\n', b"40,\xff,c\n"]
)
def test_keep_deletes_rows_after_the_checkpoint(tail, table):
    whole = table.path.read_bytes()
    table.path.write_bytes(whole + tail)
    torn = CSVTable(table.path)
    if tail.startswith(b"40"):  # a crash leaves no whole line
        with pytest.raises(InputError, match="line 5 "):
            torn.read()
    else:
        assert steps(torn) == [10, 20, 30]
    assert torn.keep(3) == 3
    assert table.path.read_bytes() == whole
    torn.append([{"steps": 40}])
    assert table.path.read_bytes() == whole + b"40,nan,nan\r\n"


def test_keep_counts_rows_written_before_a_new_column(table):
    """A checkpoint counts rows and not bytes, as a new column makes the rows before it longer."""
    n_rows = table.n_rows
    table.append([{"steps": 40, "more": 1}])
    again = CSVTable(table.path)
    assert again.keep(n_rows) == 3
    again.append([{"steps": 40, "more": 2}])
    assert [row["more"] for row in again.read()] == ["nan", "nan", "nan", "2"]


def test_a_long_table_is_not_read_into_memory(tmp_path):
    import tracemalloc

    table = CSVTable(tmp_path / "episodes.csv")
    for n in range(40):
        table.append([{"steps": 1000 * n + k, "goals": "door 1 > key 1 > exit" * 4} for k in range(1000)])
    assert table.path.stat().st_size > 3_000_000
    tracemalloc.start()
    assert table.keep(20_001) == 20_001
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 500_000
    assert len(table.read()) == 20_001


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (b"20,1\r\n", "has not as many entries as the line that names them"),
        (b"\0" * 30 + b"\r\n", "is no row of text"),
        (b'20,"1,c\r\n', "is no row of text"),
        (b"20,1,\xff\r\n", "is no row of text"),
        (b"twenty,1,c\r\n", "begins with 'twenty', not with a number of steps"),
        (b"nan,1,c\r\n", "begins with 'nan', not with a number of steps"),
        (b"-1,1,c\r\n", "begins with '-1', not with a number of steps"),
    ],
)
def test_damaged_row_raises_input_error_without_changes(damage, said, table):
    header, first, _, last = table.path.read_bytes().splitlines(keepends=True)
    table.path.write_bytes(broken := header + first + damage + last)
    for use in (CSVTable.read, lambda table: table.keep(3), lambda table: table.append(ROWS)):
        with pytest.raises(InputError, match=rf"metrics\.csv is broken: line 3 {said}"):
            use(CSVTable(table.path))
    assert table.path.read_bytes() == broken
    assert CSVTable(table.path).keep(1) == 1, "damage after the rows to keep does not matter"


@pytest.mark.parametrize("end", [b"", b"\r\xe840,1,d\r\n", b"\0\0\r\n"])
def test_keep_does_not_count_a_cut_row(end, table):
    """The caller reports the loss: the row was synced before the checkpoint, so no crash of a run cut it."""
    whole = table.path.read_bytes()
    table.path.write_bytes(whole[:-2] + end)
    if end.startswith(b"\r"):
        with pytest.raises(InputError, match="line 4 is no row of text"):
            table.keep(3)
    else:
        assert table.keep(3) == 2
        assert steps(table) == [10, 20]


def test_keep_refuses_a_row_beyond_the_steps_taken(table):
    table.path.write_bytes(table.path.read_bytes().replace(b"\n20,", b"\n920,"))
    with pytest.raises(InputError, match=r"line 3 begins with '920', not with a number of steps up to 30"):
        table.keep(3, 30)


def test_missing_header_is_refused_unless_no_row_is_kept(table):
    without = b"".join(table.path.read_bytes().splitlines(keepends=True)[1:])
    table.path.write_bytes(without)
    for use in (table.read, lambda: table.keep(2)):
        with pytest.raises(InputError, match="line 1 does not name the columns"):
            use()
    assert table.keep(0) == 0
    table.append(ROWS)
    assert steps(table) == [10, 20, 30]


@pytest.mark.parametrize(
    "save",
    [
        lambda text: text.decode().encode("utf-16"),
        lambda text: text.decode().encode("utf-16-le"),
        lambda text: text.replace(b"\r\n", b"\n").decode().encode("utf-16-be"),
        lambda text: text.replace(b"\r\n", b"\r"),
        lambda text: text.replace(b",", b";"),
        lambda text: b"\0" + text,
        lambda text: codecs.BOM_UTF8 + b"\r\n" + text,
        lambda text: b"\xff" + text,
    ],
)
def test_unreadable_header_raises_input_error_without_changes(save, table):
    table.path.write_bytes(saved := save(table.path.read_bytes()))
    for use in (CSVTable.read, CSVTable.keep, lambda table: table.keep(3), lambda table: table.append(ROWS)):
        with pytest.raises(InputError, match=r"line 1 (is no row of text|does not name the columns)"):
            use(CSVTable(table.path))
    assert table.path.read_bytes() == saved


def test_endless_line_raises_input_error(table, monkeypatch):
    monkeypatch.setattr("hierroom.runs.folder.csv_table.MOST_TEXT", 2**22)
    os.truncate(table.path, 2**23)
    with pytest.raises(InputError, match="line 5 is no row of text"):
        table.read()


def test_append_adds_new_columns(table):
    table.append([{"steps": 40, "gain": 1.5, "loss": 2}])
    CSVTable(table.path).append([{"steps": 50, "more": "x"}])
    rows = table.read()
    assert [*rows[0]] == ["steps", "loss", "graph", "gain", "more"]
    assert [row["gain"] for row in rows] == ["nan", "nan", "nan", "1.5", "nan"]
    assert [row["more"] for row in rows] == [*["nan"] * 4, "x"]
    assert rows[1]["graph"] == "g20, of 20"
    assert [row["loss"] for row in rows] == ["5.0", "10.0", "15.0", "2", "nan"]
    assert [path.name for path in table.path.parent.iterdir()] == ["metrics.csv"]


@pytest.mark.parametrize("name", ["two\nlines", "nul\0", "half\udce9", "x" * 70_000])
def test_table_with_an_unwritable_column_name_is_appended_to(name, tmp_path):
    for steps in (1, 2):
        table = CSVTable(tmp_path / "metrics.csv")
        for more in (0, 0.5):
            table.append([{"steps": steps + more, name: steps}])
    (_, column) = table.read()[0]
    assert [row[column] for row in table.read()] == ["1", "1", "2", "2"]


def test_numbers_gives_floats_and_refuses_text(table):
    with pytest.raises(InputError, match="is broken: could not convert string to float: 'g10, of 10'"):
        table.numbers()
    table.keep(1)
    table.path.write_bytes(table.path.read_bytes().replace(b"g10, of 10", b"nan"))
    table.append([{"steps": 1, "loss": float("inf")}])
    assert np.isnan(table.numbers()[1]["graph"])
    assert table.numbers()[1]["loss"] == np.inf


def test_rows_stay_when_the_disk_is_full(table, monkeypatch):
    write, before = os.write, table.path.read_bytes()

    def nearly_full(number, content):
        if len(content) < 10:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(number, content[: len(content) // 2])

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", nearly_full)
        with pytest.raises(InputError, match=r"metrics\.csv: No space left on device"):
            table.append([{"steps": 40, "loss": 1, "graph": "a" * 50}])
    assert table.path.read_bytes() == before
    table.append([{"steps": 40}])
    assert steps(table) == [10, 20, 30, 40]


def test_link_in_place_of_table_is_not_followed(table):
    mine = table.path.rename(table.path.with_name("mine"))
    before = mine.read_bytes()
    table.path.symlink_to(mine)
    for write in (lambda table: table.append(ROWS), lambda table: table.keep(1), lambda table: sync(table.path)):
        with pytest.raises(InputError, match="cannot write"):
            write(CSVTable(table.path))
    assert mine.read_bytes() == before


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
