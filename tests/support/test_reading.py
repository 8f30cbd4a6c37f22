"""Files are read quickly and within limits, or refused in one line."""

import codecs
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from hierroom.goals import GoalGraph, Rules
from hierroom.lab.sweep.plan import read_plan
from hierroom.runs.folder.config_file import read_config
from hierroom.support import files
from hierroom.support.errors import InputError
from hierroom.support.files import read_bytes, read_csv, read_json, read_text, read_toml

READERS = (read_bytes, read_text, read_json, read_csv, lambda path: read_toml(path, "config"))


def sparse(path: Path, size: int) -> None:
    path.touch()
    os.truncate(path, size)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize(
    ("plant", "said"),
    [
        (os.mkfifo, "it is no regular file"),
        (lambda path: path.symlink_to("/dev/zero"), "it is no regular file"),
        (Path.mkdir, "it is no regular file"),
        (lambda path: sparse(path, 2**40), "it is larger than [0-9,]+ MiB"),
        (lambda path: path.symlink_to(path), "Too many levels of symbolic links"),
        (lambda path: None, "No such file or directory"),
        (lambda path: path.symlink_to("/proc/self/pagemap"), "it is larger than 1 MiB"),  # it has no known size
    ],
)
@pytest.mark.parametrize("read", READERS)
def test_unreadable_or_too_large_file_raises_input_error(read, plant, said, tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MOST_TABLE", 2**20)
    monkeypatch.setattr(read_bytes, "__defaults__", (2**20, ""))
    monkeypatch.setattr(read_text, "__defaults__", (2**20, ""))
    plant(path := tmp_path / "there")
    with pytest.raises(InputError, match=f"^cannot read .*there: {said}$"):
        read(path)


def test_link_to_a_file_is_read(tmp_path):
    (tmp_path / "cached").write_text("{}")  # as model hubs and data versioning keep files
    (tmp_path / "config.json").symlink_to("cached")
    assert read_json(tmp_path / "config.json") == {}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("read", [read_config, Rules.from_toml, read_plan])
def test_file_named_by_the_user_may_be_a_pipe(read, tmp_path):
    path = tmp_path / "file"
    text = {read_config: "steps = 512", read_plan: "seeds = 2"}.get(read, GoalGraph.named("a").rules().to_toml())
    path.write_text(text)
    value = read(path)
    path.unlink()
    os.mkfifo(path)
    with ThreadPoolExecutor(1) as pool:
        pool.submit(path.write_text, text)
        assert read(path) == value
    with pytest.raises(InputError, match="it is larger than 64 MiB"):
        read(Path("/dev/zero"))


@pytest.mark.parametrize("read", [read_json, read_csv, lambda path: read_toml(path, "config")])
def test_readers_take_only_utf_8_text(read, tmp_path):
    path = tmp_path / "file"
    text = {read_json: '{"ü": 1}', read_csv: "ü\n1\n"}.get(read, '"ü" = 1')
    path.write_text(text, encoding="utf-8")
    value = read(path)
    for n_marks in (1, 2):  # two: one tool took the mark of another for text
        path.write_bytes(codecs.BOM_UTF8 * n_marks + text.encode())
        assert read(path) == value
    for encoding in ("utf-16", "latin-1"):
        path.write_text(text, encoding=encoding)
        with pytest.raises(InputError, match=r"cannot read .*file: it is no text in UTF-8"):
            read(path)


@pytest.mark.parametrize("text", ["[" * 100_000 + "]" * 100_000, "[" * 60 + "]" * 60, '{"a":' * 400 + "1" + "}" * 400])
def test_too_deep_json_raises_input_error(text, tmp_path):
    (tmp_path / "deep.json").write_text(text)
    with pytest.raises(InputError, match=r"^cannot read .*deep\.json: "):
        read_json(tmp_path / "deep.json")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1\n", "line 2 has not as many entries"),
        ("a,b\n1,2\n1,2,3\n", "line 3 has not as many entries"),
        ("a,b,a\n1,2,3\n", "line 1 names a column twice"),
        ('a,b\n1,"2\n', "unexpected end of data"),
    ],
)
def test_broken_csv_table_raises_input_error(text, said, tmp_path):
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(InputError, match=said):
        read_csv(tmp_path / "table.csv")


@pytest.mark.parametrize(
    ("kind", "text"),
    [(GoalGraph, "key_rooms = [0]\nexit_room = 1\n"), (Rules, 'target = "a"\n[rules.a]\ngives = "a"\n')],
)
def test_graph_and_rules_labels_are_their_file_name_in_any_locale(kind, text, tmp_path):
    (tmp_path / "Grün.toml").write_text(text)
    for name in ("Grün.toml", "Gr\udcc3\udcbcn.toml"):  # the latter is how Python reads it where only ASCII is known
        assert kind.from_toml(tmp_path / name).label == "Grün"
