"""Writing files atomically, reading TOML, and JSON without infinities and NaNs."""

from __future__ import annotations

import json
import math
import os
import re
import secrets
import tomllib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from hierroom.support.errors import InputError

_UNFINISHED = re.compile(r"\.[0-9a-f]{16}\.part")


def write_atomically(path: str | Path, content: bytes | Iterable[bytes]) -> None:
    """Write a file so that it always holds either the old content or the new one, even after a crash.

    Args:
        path: the file; its folder must exist.
        content: the new content, in one piece or in several.
    """
    path = Path(path)
    # Nobody can know the name beforehand, and a file or link that has it nevertheless is not opened ("x").
    unfinished = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with unfinished.open("xb") as file:
            for piece in [content] if isinstance(content, bytes) else content:
                file.write(piece)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, path)
        sync_folder(path.parent)
    except BaseException as error:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise InputError(f"cannot write {path}: {error.strerror}") from error
        raise


def read_toml(path: Path, kind: str) -> dict[str, Any]:
    """The table in a TOML file, with or without a byte order mark.

    Args:
        path: the file.
        kind: what it holds, for the message where it cannot be read, such as ``"config"``.
    """
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"cannot read the {kind} {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # TOMLDecodeError and UnicodeDecodeError among them
        raise InputError(f"{path} is not a TOML file: {error}") from error


def append_whole(path: Path, content: bytes) -> None:
    """Append to a file all of some content or, where that fails, nothing. No link in its place is followed.

    Args:
        path: the file, which is created if it is not there.
        content: what to append.
    """
    # Whoever planted a link would choose what is written to.
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    try:
        file = os.open(path, flags, 0o666)
        try:
            size = os.fstat(file).st_size
            try:
                while content:  # a disk that is nearly full takes a part of it
                    content = content[os.write(file, content) :]
            except OSError:
                with suppress(OSError):
                    os.ftruncate(file, size)
                raise
        finally:
            os.close(file)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error


def sync(path: Path) -> None:
    """Have what was appended to a file, if it is there, outlive a loss of power."""
    try:
        with suppress(FileNotFoundError), path.open("rb+") as file:
            os.fsync(file.fileno())
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error


def sync_folder(folder: Path) -> None:
    """Have the names of a folder's files outlive a loss of power, where the file system can do that."""
    with suppress(OSError):  # Windows opens no folders, and some file systems do not sync them
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def remove_unfinished(folder: Path) -> None:
    """Delete the files in a folder and below it that `write_atomically` had begun when its process was killed."""
    try:
        for path in [*folder.rglob(".*.part")]:
            if is_unfinished(path):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"cannot tidy {folder}: {error.strerror}") from error


def is_unfinished(path: Path) -> bool:
    """Whether a path is called like a file that `write_atomically` has begun."""
    return _UNFINISHED.fullmatch(path.name) is not None


def to_json(value: Any, *, indent: int | None = 2) -> str:
    """Plain types as JSON text; infinities and NaNs, which JSON cannot represent, become null.

    A named tuple becomes an object with its names, so that nobody has to know the order of its entries.

    Args:
        value: the plain types.
        indent: of the lines; None: all on one line and without spaces.
    """

    def finite(value: Any) -> Any:
        value = getattr(value, "_asdict", lambda: value)()
        if isinstance(value, Mapping):
            return {name: finite(entry) for name, entry in value.items()}
        if isinstance(value, (list, tuple)):
            return [finite(entry) for entry in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    separators = (",", ":") if indent is None else None
    return json.dumps(finite(value), indent=indent, separators=separators, allow_nan=False)
