"""Files are written whole or not at all, and links do not redirect them to other files."""

import os

import pytest

from hierroom.support.errors import InputError
from hierroom.support.files import (
    append_whole,
    delete,
    is_unfinished,
    remove_unfinished,
    sync,
    truncate,
    write_atomically,
)


def test_planted_link_is_not_followed(tmp_path, monkeypatch):
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


def test_link_in_place_of_the_file_is_replaced(tmp_path):
    (tmp_path / "mine").write_text("precious")
    (tmp_path / "summary.json").symlink_to(tmp_path / "mine")
    write_atomically(tmp_path / "summary.json", b"new")
    assert (tmp_path / "mine").read_text() == "precious"
    assert not (tmp_path / "summary.json").is_symlink()


def test_new_files_respect_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "a", b"")
        append_whole(tmp_path / "b", b"")
    finally:
        os.umask(before)
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in "ab"] == [0o640, 0o640]


def test_interrupted_write_keeps_the_old_file(tmp_path):
    def pieces():
        yield b"one"
        raise KeyboardInterrupt

    write_atomically(tmp_path / "a", iter([b"1", b"2"]))
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a", pieces())
    assert (tmp_path / "a").read_bytes() == b"12"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_remove_unfinished_deletes_only_unfinished_files(tmp_path):
    (tmp_path / "checkpoints").mkdir()
    left = [tmp_path / f".{'0a' * 8}.part", tmp_path / "checkpoints" / f".{'12' * 8}.part"]
    others = [tmp_path / "mine.part", tmp_path / ".mine.part", tmp_path / f".{'0a' * 8}.parts"]
    for path in left + others:
        path.write_text("")
    assert all(map(is_unfinished, left))
    remove_unfinished(tmp_path)
    assert not any(path.exists() for path in left)
    assert all(path.exists() for path in others)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_write_atomically_does_not_replace_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=r"cannot write .*pipe: it is no regular file"):
        write_atomically(tmp_path / "pipe", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]
    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_append_truncate_and_delete_spare_linked_files(tmp_path):
    (tmp_path / "mine").write_text("precious")
    os.link(tmp_path / "mine", tmp_path / "hard")
    (tmp_path / "soft").symlink_to("mine")
    os.mkfifo(tmp_path / "pipe")
    for name in ("hard", "soft", "pipe"):
        for change in (lambda path: append_whole(path, b"more"), lambda path: truncate(path, 0), sync):
            with pytest.raises(InputError, match=rf"cannot write .*{name}: it is (another file too|a link|no regular)"):
                change(tmp_path / name)
    delete(tmp_path / "soft")
    delete(tmp_path / "none")
    assert (tmp_path / "soft").read_text() == "precious"
    delete(tmp_path / "hard")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "pipe", "soft"]


def test_text_is_written_as_utf_8_with_escapes(tmp_path):
    write_atomically(tmp_path / "a", "Grün \udcff")
    assert (tmp_path / "a").read_bytes() == "Grün \\udcff".encode()
