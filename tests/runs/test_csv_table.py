"""A table that grows: torn tails heal, columns are added, damage is told of and never loses what can be read."""

import errno
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hierroom.runs.folder.csv_table import CSVTable
from hierroom.support.errors import InputError

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
def test_whatever_a_crash_left_of_the_last_rows_heals(tmp_path_factory, cut, tail):
    """Anything after some whole rows that is not a row: it is not read, and the next rows replace it."""
    path = tmp_path_factory.mktemp("torn") / "metrics.csv"
    CSVTable(path).append(ROWS)
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut] + tail.replace(b"\n", b"\0").replace(b"\r", b"\0"))
    torn = CSVTable(path)
    n = len(torn.read())
    assert n == max(0, whole[:-cut].count(b"\n") - 1)
    torn.append(ROWS[n:])
    assert path.read_bytes() == whole
    for keep in (10, -1):
        path.write_bytes(whole[:-cut] + tail.replace(b"\n", b"\0"))
        assert CSVTable(path).drop_after(keep) is None or keep == 10
        CSVTable(path).append(ROWS[0 if keep < 0 else len(CSVTable(path).read()) :])
        assert path.read_bytes() == whole


@pytest.mark.parametrize(
    "tail", [b"\0" * 5000, b"\0" * 50 + b"\r\n", b"\r\n\r\n", b"40,1\r\n", b'40,"1\r\n', b"40,\xff,c\n"]
)
def test_each_kind_of_torn_tail_heals(tail, table):
    whole = table.path.read_bytes()
    for heal in (lambda torn: torn.drop_after(30), lambda torn: torn.append([{"steps": 40}])):
        table.path.write_bytes(whole + tail)
        torn = CSVTable(table.path)
        if tail.startswith(b"40"):  # a whole line is not what a crash leaves, but no row of those to keep either
            with pytest.raises(InputError, match="line 5 "):
                torn.read()
        else:
            assert steps(torn) == [10, 20, 30]
        heal(torn)
        assert table.path.read_bytes() in (whole, whole + b"40,nan,nan\r\n")


def test_dropped_rows_leave_the_others_byte_for_byte(table):
    lines = table.path.read_bytes().splitlines(keepends=True)
    assert CSVTable(table.path).drop_after(20) is None
    assert table.path.read_bytes() == b"".join(lines[:3])
    assert table.drop_after(-1) is None
    assert table.path.read_bytes() == lines[0]
    table.append(ROWS)
    assert table.path.read_bytes() == b"".join(lines)
    assert CSVTable(table.path.with_name("none.csv")).drop_after(20) is None


def test_a_long_table_is_not_read_into_memory(tmp_path):
    import tracemalloc

    table = CSVTable(tmp_path / "episodes.csv")
    for n in range(40):
        table.append([{"steps": 1000 * n + k, "goals": "door 1 > key 1 > exit" * 4} for k in range(1000)])
    assert table.path.stat().st_size > 3_000_000
    tracemalloc.start()
    table.drop_after(20_000)
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
def test_damage_before_a_row_is_refused_by_readers_and_told_of_when_a_run_goes_on(damage, said, table):
    header, first, _, last = table.path.read_bytes().splitlines(keepends=True)
    table.path.write_bytes(broken := header + first + damage + last)
    with pytest.raises(InputError, match=rf"metrics\.csv is broken: line 3 {said}"):
        table.read()
    assert "was damaged: what can be read of it is kept, and metrics.csv.damaged is" in table.drop_after(30)
    assert table.path.read_bytes() == header + first + last
    assert table.path.with_name("metrics.csv.damaged").read_bytes() == broken
    assert table.drop_after(30) is None


@pytest.mark.parametrize("end", [b"", b"\r\xe840,1,d\r\n", b"\0\0\r\n"])
def test_a_row_to_keep_that_lost_its_end_is_set_aside(end, table):
    """It was synced before the checkpoint, so that no crash of ours cut it."""
    whole = table.path.read_bytes()
    table.path.write_bytes(broken := whole[:-2] + end)
    assert table.drop_after(20) is None, "the last row was not to be kept"
    table.path.write_bytes(broken)
    assert "damaged" in table.drop_after(30)
    assert steps(table) == [10, 20]
    assert table.path.with_name("metrics.csv.damaged").read_bytes() == broken


def test_rows_to_keep_after_one_to_drop_are_kept_and_told_of(table):
    whole = table.path.read_bytes()
    table.path.write_bytes(broken := whole.replace(b"\n20,", b"\n920,"))
    assert "metrics.csv.damaged is" in table.drop_after(30)
    assert steps(table) == [10, 30]
    table.path.write_bytes(again := whole.replace(b"\n10,", b"\n910,"))
    assert "metrics.csv.damaged-2 is" in table.drop_after(30)
    assert steps(table) == [20, 30]
    assert table.path.with_name("metrics.csv.damaged").read_bytes() == broken
    assert table.path.with_name("metrics.csv.damaged-2").read_bytes() == again


def test_a_blank_line_is_no_damage(table):
    header, *rows = table.path.read_bytes().splitlines(keepends=True)
    table.path.write_bytes(b"\r\n" + header + b"\r\n".join(rows))
    assert steps(table) == [10, 20, 30]
    assert table.drop_after(20) is None
    assert steps(table) == [10, 20]


def test_a_table_without_its_header_is_set_aside(table):
    without = b"".join(table.path.read_bytes().splitlines(keepends=True)[1:])
    table.path.write_bytes(without)
    with pytest.raises(InputError, match="line 1 does not name the columns"):
        table.read()
    assert table.drop_after(-1) is None, "nothing of it was to be kept"
    table.path.write_bytes(without)
    assert "damaged" in table.drop_after(20)
    assert table.path.with_name("metrics.csv.damaged").read_bytes() == without
    table.append(ROWS)
    assert steps(table) == [10, 20, 30]


def test_columns_may_grow(table):
    table.append([{"steps": 40, "gain": 1.5, "loss": 2}])
    CSVTable(table.path).append([{"steps": 50, "more": "x"}])
    rows = table.read()
    assert [*rows[0]] == ["steps", "loss", "graph", "gain", "more"]
    assert [row["gain"] for row in rows] == ["nan", "nan", "nan", "1.5", "nan"]
    assert [row["more"] for row in rows] == [*["nan"] * 4, "x"]
    assert rows[1]["graph"] == "g20, of 20"
    assert [row["loss"] for row in rows] == ["5.0", "10.0", "15.0", "2", "nan"]
    assert [path.name for path in table.path.parent.iterdir()] == ["metrics.csv"]


def test_a_row_is_one_line_whatever_a_name_holds(tmp_path):
    table = CSVTable(tmp_path / "episodes.csv")
    table.append([{"steps": 1, "graph": 'a\r\nb,"c"\x85d'}, {"steps": 2, "graph": "\udcff"}])
    assert [row["graph"] for row in table.read()] == ['a b,"c" d', "\\udcff"]


def test_numbers(table):
    with pytest.raises(InputError, match="is broken: could not convert string to float: 'g10, of 10'"):
        table.numbers()
    table.drop_after(-1)
    table.append([{"steps": 1, "loss": float("inf")}])
    assert np.isnan(table.numbers()[0]["graph"])
    assert table.numbers()[0]["loss"] == np.inf


def test_rows_stay_when_the_disk_is_full(table, monkeypatch):
    """A disk that takes a part of a row, and then nothing more."""
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


def test_a_link_in_the_place_of_a_table_is_not_followed(tmp_path):
    (tmp_path / "mine").write_text("")
    table = CSVTable(tmp_path / "metrics.csv")
    table.path.symlink_to(tmp_path / "mine")
    with pytest.raises(InputError, match="cannot write"):
        table.append(ROWS)
    assert (tmp_path / "mine").read_text() == ""


def test_a_table_that_was_deleted_begins_anew(table):
    table.path.unlink()
    table.append(ROWS[1:])
    assert steps(table) == [20, 30]
