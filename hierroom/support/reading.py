"""Read untrusted files as text, JSON, TOML or CSV; only regular files of limited size are read."""

from __future__ import annotations

import csv
import errno
import io
import json
import os
import tomllib
from pathlib import Path
from typing import Any

from hierroom.support.errors import InputError
from hierroom.support.files import open_regular

MOST_TEXT, MOST_TABLE, MOST_STATE = 2**26, 2**30, 2**34
"""The most bytes of a text file, a table and a checkpoint."""
_AT_ONCE = 2**24
_DEEPEST = 50  # levels of nested lists and objects; much deeper ones could not be written


def read_bytes(path: Path, most: int = MOST_TEXT, what: str = "", *, or_any: bool = False) -> bytes:
    """Return the content of a regular file of at most ``most`` bytes; see `open_regular`."""
    content = bytearray()
    with open_regular(path, what=what, or_any=or_any) as number:
        size = os.fstat(number).st_size
        while size <= most and (piece := os.read(number, _AT_ONCE)):  # some system files report no size
            content += piece
            size = len(content)
        if size > most:
            raise OSError(errno.EFBIG, f"it is larger than {most // 2**20:,} MiB")
    return bytes(content)


def read_text(path: Path, most: int = MOST_TEXT, what: str = "", *, or_any: bool = False) -> str:
    """Return the text of a regular file in UTF-8, without byte order marks; see `open_regular`."""
    try:
        return read_bytes(path, most, what, or_any=or_any).decode().lstrip("\ufeff")
    except UnicodeDecodeError as error:
        raise InputError(f"cannot read {what}{path}: it is no text in UTF-8: {error}") from error


def read_json(path: Path) -> Any:
    """Return the content of a JSON file."""
    text = read_text(path)
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    level = [value]
    for _ in range(_DEEPEST):
        level = [
            entry
            for one in level
            if isinstance(one, (dict, list))
            for entry in (one.values() if isinstance(one, dict) else one)
        ]
    if level:
        raise InputError(f"cannot read {path}: it has more than {_DEEPEST} lists and objects in each other")
    return value


def read_toml(path: Path, kind: str, *, or_any: bool = False) -> dict[str, Any]:
    """Return the table in a TOML file; ``kind``, such as ``config``, is for messages; see `open_regular`."""
    try:
        return tomllib.loads(read_text(path, what=f"the {kind} ", or_any=or_any))
    except (ValueError, RecursionError) as error:  # TOMLDecodeError is a ValueError
        raise InputError(f"{path} is not a TOML file: {error}") from error


def as_utf8(path: Path) -> Path:
    """Return a path with its bytes decoded as UTF-8, if possible, so that a file has the same name in every locale."""
    try:
        return Path(os.fsencode(path).decode())
    except UnicodeError:
        return path


def read_csv(path: Path) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Return the names of a table's columns, and its rows, each after the number of its last line in the file."""
    reader = csv.DictReader(io.StringIO(read_text(path, MOST_TABLE, "the table "), newline=""), strict=True)
    try:
        rows = [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise InputError(f"cannot read the table {path}: {error}") from error
    names = [*(reader.fieldnames or ())]
    if len({*names}) < len(names):
        raise InputError(f"{path} is broken: line 1 names a column twice")
    for number, row in rows:
        if None in row or None in row.values():
            raise InputError(f"{path} is broken: line {number} has not as many entries as the line that names them")
    return names, rows
