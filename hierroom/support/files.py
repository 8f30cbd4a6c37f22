"""Writing files atomically, reading TOML, and JSON without infinities and NaNs."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import secrets
import stat
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from hierroom.support.errors import InputError, shown

_UNFINISHED = re.compile(r"\.[0-9a-f]{16}\.part")


def usable_path(path: str | Path) -> Path:
    """Return a path of the user, whether or not there is anything; refuse one that the system does not look up."""
    try:
        os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as error:  # a name that is too long, a folder without permission
        raise InputError(f"{error.strerror}: {shown(os.fspath(path))}") from error
    except ValueError as error:  # a character that no path has
        raise InputError(f"{shown(os.fspath(path))} cannot be a path: {error}") from error
    return Path(path)


def write_atomically(path: str | Path, content: bytes | Iterable[bytes]) -> None:
    """Write a file in an existing folder so that it holds the old or the new content, even after a crash."""
    path = usable_path(path)
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
    """Return the table in a TOML file; ``kind``, such as ``config``, is for messages."""
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"cannot read the {kind} {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # TOMLDecodeError and UnicodeDecodeError among them
        raise InputError(f"{path} is not a TOML file: {error}") from error


@contextmanager
def _open_to_write(path: Path, flags: int = 0) -> Iterator[int]:
    """Open a regular file, by its number; follow no link, as whoever planted it would choose the file."""
    plain = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    try:
        number = os.open(path, os.O_WRONLY | plain | flags, 0o666)
        try:
            if not stat.S_ISREG(os.fstat(number).st_mode):
                raise OSError(errno.EINVAL, "it is no regular file")
            yield number
        finally:
            os.close(number)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error


def append_whole(path: Path, content: bytes) -> None:
    """Append all of some content to a file, which may be new, or nothing where that fails."""
    with _open_to_write(path, os.O_APPEND | os.O_CREAT) as file:
        size = os.fstat(file).st_size
        try:
            while content:  # a disk that is nearly full takes a part of it
                content = content[os.write(file, content) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(file, size)
            raise


def truncate(path: Path, size: int) -> None:
    """Delete all that follows the first ``size`` bytes of a file."""
    with _open_to_write(path) as file:
        os.ftruncate(file, size)


def sync(path: Path) -> None:
    """Make the content of a file, if it exists, outlive a loss of power."""
    if path.exists():
        with _open_to_write(path) as file:
            os.fsync(file)


def sync_folder(folder: Path) -> None:
    """Make the names of a folder's files outlive a loss of power, where the file system can do that."""
    with suppress(OSError):  # Windows opens no folders, and some file systems do not sync them
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def remove_unfinished(folder: Path) -> None:
    """Delete the files below a folder that `write_atomically` had begun when its process was killed."""
    try:
        for path in [*folder.rglob(".*.part")]:
            if is_unfinished(path):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"cannot tidy {folder}: {error.strerror}") from error


def is_unfinished(path: Path) -> bool:
    """Return whether a path has the name of a file that `write_atomically` has begun."""
    return _UNFINISHED.fullmatch(path.name) is not None


def to_json(value: Any, *, indent: int | None = 2) -> str:
    """Return plain types as JSON, with named tuples as objects and infinities and NaNs as null."""

    def finite(value: Any) -> Any:
        value = getattr(value, "_asdict", lambda: value)()
        if isinstance(value, Mapping):
            return {name: finite(entry) for name, entry in value.items()}
        if isinstance(value, (list, tuple)):
            return [finite(entry) for entry in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    separators = (",", ":") if indent is None else None
    return json.dumps(finite(value), indent=indent, separators=separators, allow_nan=False)
