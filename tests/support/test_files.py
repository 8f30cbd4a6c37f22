"""Files are written whole or not at all, and nobody else chooses which file that is."""

import os

import pytest

from hierroom.support.errors import InputError
from hierroom.support.files import append_whole, is_unfinished, remove_unfinished, write_atomically


def test_a_planted_link_is_not_followed(tmp_path, monkeypatch):
    (tmp_path / "mine").write_text("precious")
    (tmp_path / "config.json.part").symlink_to(tmp_path / "mine")
    write_atomically(tmp_path / "config.json", b"new")
    assert (tmp_path / "mine").read_text() == "precious"
    monkeypatch.setattr("secrets.token_hex", lambda n: "0" * 2 * n)  # as if somebody had guessed it
    (tmp_path / f".{'0' * 16}.part").symlink_to(tmp_path / "mine")
    with pytest.raises(InputError, match=r"cannot write .*: File exists"):
        write_atomically(tmp_path / "config.json", b"newer")
    assert (tmp_path / "mine").read_text() == "precious"
    assert (tmp_path / "config.json").read_bytes() == b"new"
    with pytest.raises(InputError, match="cannot write"):
        append_whole(tmp_path / "config.json.part", b"more")
    assert (tmp_path / "mine").read_text() == "precious"


def test_a_link_in_the_place_of_the_file_is_replaced(tmp_path):
    (tmp_path / "mine").write_text("precious")
    (tmp_path / "summary.json").symlink_to(tmp_path / "mine")
    write_atomically(tmp_path / "summary.json", b"new")
    assert (tmp_path / "mine").read_text() == "precious"
    assert not (tmp_path / "summary.json").is_symlink()


def test_files_are_made_for_whom_the_user_wants(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "a", b"")
        append_whole(tmp_path / "b", b"")
    finally:
        os.umask(before)
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in "ab"] == [0o640, 0o640]


def test_whatever_ends_the_writing_nothing_is_left(tmp_path):
    def pieces():
        yield b"one"
        raise KeyboardInterrupt

    write_atomically(tmp_path / "a", iter([b"1", b"2"]))
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a", pieces())
    assert (tmp_path / "a").read_bytes() == b"12"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_only_a_killed_process_s_unfinished_files_are_deleted(tmp_path):
    (tmp_path / "checkpoints").mkdir()
    left = [tmp_path / f".{'0a' * 8}.part", tmp_path / "checkpoints" / f".{'12' * 8}.part"]
    others = [tmp_path / "mine.part", tmp_path / ".mine.part", tmp_path / f".{'0a' * 8}.parts"]
    for path in left + others:
        path.write_text("")
    assert all(map(is_unfinished, left))
    remove_unfinished(tmp_path)
    assert not any(path.exists() for path in left)
    assert all(path.exists() for path in others)
