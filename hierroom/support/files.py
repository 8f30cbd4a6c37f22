"""Read untrusted files, write files atomically, and make JSON without infinities and NaNs."""

from __future__ import annotations

import csv
import errno
import io
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
_LINK, _SPECIAL = "it is a link, which is not followed", "it is no regular file"
_SHARED = "it is another file too (a hard link), which would change with it; make a copy of its own"


def usable_path(path: str | Path) -> Path:
    """Return a path of the user, whether or not it exists; refuse one that the system cannot look up."""
    try:
        os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as error:  # too long a name, or no permission
        raise InputError(f"{error.strerror}: {shown(os.fspath(path))}") from error
    except ValueError as error:  # a character that paths cannot have
        raise InputError(f"{shown(os.fspath(path))} cannot be a path: {error}") from error
    return Path(path)


def write_atomically(path: str | Path, content: str | bytes | Iterable[bytes]) -> None:
    """Write a file in an existing folder so that it has either the old or the new content, even after a crash.

    Text is written as UTF-8. If the path is a link, the link is replaced, not followed; a device or pipe is refused.
    """
    path = usable_path(path)
    content = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    # The name cannot be guessed beforehand; if a file or link has it nevertheless, "x" does not open that.
    unfinished = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with unfinished.open("xb") as file:
            for piece in [content] if isinstance(content, bytes) else content:
                file.write(piece)
            file.flush()
            os.fsync(file.fileno())
        if path.exists() and not (path.is_file() or path.is_dir() or path.is_symlink()):  # os.replace refuses a folder
            raise OSError(errno.EINVAL, _SPECIAL)
        os.replace(unfinished, path)
        with suppress(OSError):  # Windows cannot open folders, and some file systems cannot sync their names
            number = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(number)
            finally:
                os.close(number)
    except BaseException as error:
        with suppress(OSError):
            delete(unfinished)
        if isinstance(error, OSError):
            raise InputError(f"cannot write {path}: {error.strerror}") from error
        raise


@contextmanager
def open_regular(path: Path, flags: int = os.O_RDONLY, what: str = "", *, or_any: bool = False) -> Iterator[int]:
    """Open a regular file and yield its descriptor; ``what``, such as ``the config ``, is for messages.

    A file to write must not be a link or have a hard link: whoever made that could choose the file that changes. With
    ``or_any``, a file to read may also be a pipe or a device; use it if the user has typed the name (``<(command)``).
    """
    is_read = flags & (os.O_WRONLY | os.O_RDWR) == 0
    names = ("O_BINARY", "" if or_any else "O_NONBLOCK", "" if is_read else "O_NOFOLLOW")
    plain = sum(getattr(os, name, 0) for name in names)
    try:
        if not is_read:
            refuse_foreign(changed=[path])  # for systems without O_NOFOLLOW, and for better messages
        number = os.open(path, flags | plain, 0o666)
        try:
            if not or_any and (reason := _why_foreign(os.fstat(number), may_share=is_read)):
                raise OSError(errno.EINVAL, reason)
            yield number
        finally:
            os.close(number)
    except OSError as error:
        raise InputError(f"cannot {'read' if is_read else 'write'} {what}{path}: {error.strerror}") from error


def refuse_foreign(
    *, replaced: Iterable[Path] = (), changed: Iterable[Path] = (), folders: Iterable[Path] = ()
) -> None:
    """Refuse links and special files at the paths of our files and folders, before anything is written.

    A file that is ``changed``, instead of ``replaced`` as a whole, must also have no hard link.
    """
    for paths, kind in ((replaced, {"may_share": True}), (changed, {}), (folders, {"is_folder": True})):
        for path in paths:
            try:
                reason = _why_foreign(path.lstat(), **kind)
            except FileNotFoundError:
                continue
            except OSError as error:
                reason = error.strerror
            if reason:
                raise InputError(f"cannot write {path}: {reason}")


def _why_foreign(status: os.stat_result, *, may_share: bool = False, is_folder: bool = False) -> str:
    if stat.S_ISDIR(status.st_mode) if is_folder else stat.S_ISREG(status.st_mode):
        return "" if is_folder or may_share or status.st_nlink < 2 else _SHARED
    return _LINK if stat.S_ISLNK(status.st_mode) else "it is no folder" if is_folder else _SPECIAL


def append_whole(path: Path, content: bytes) -> None:
    """Append some content to a file, which may be new; if that fails, append nothing."""
    with open_regular(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT) as file:
        size = os.fstat(file).st_size
        try:
            while content:  # a disk that is nearly full accepts only a part
                content = content[os.write(file, content) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(file, size)
            raise


def truncate(path: Path, size: int) -> None:
    """Delete everything after the first ``size`` bytes of a file."""
    with open_regular(path, os.O_WRONLY) as file:
        os.ftruncate(file, size)


def delete(path: Path) -> None:
    """Delete a regular file, if there is one; keep a link or a folder of that name."""
    with suppress(FileNotFoundError):
        if stat.S_ISREG(path.lstat().st_mode):
            path.unlink()


def sync(path: Path) -> None:
    """Make the content of a file, if it exists, survive a loss of power."""
    if path.exists():
        with open_regular(path, os.O_WRONLY) as file:
            os.fsync(file)


def remove_unfinished(folder: Path) -> None:
    """Delete the unfinished files below a folder that a killed process left in `write_atomically`."""
    try:
        for path in [*folder.rglob(".*.part")]:
            if is_unfinished(path):
                delete(path)
    except OSError as error:
        raise InputError(f"cannot tidy {folder}: {error.strerror}") from error


def is_unfinished(path: Path) -> bool:
    """Return whether a path has the name of an unfinished file of `write_atomically`."""
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
