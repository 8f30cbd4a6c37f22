"""Open regular files, write files atomically, and make JSON without infinities and NaNs."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import secrets
import stat
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
        sync_folder(path.parent)
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
            if not or_any and (reason := (_why_foreign if is_read else _why_shared)(os.fstat(number))):
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
    for paths, why in ((replaced, _why_foreign), (changed, _why_shared), (folders, _why_no_folder)):
        for path in paths:
            try:
                reason = why(path.lstat())
            except FileNotFoundError:
                continue
            except OSError as error:
                reason = error.strerror
            if reason:
                raise InputError(f"cannot write {path}: {reason}")


def _why_foreign(status: os.stat_result) -> str:
    return "" if stat.S_ISREG(status.st_mode) else _LINK if stat.S_ISLNK(status.st_mode) else _SPECIAL


def _why_shared(status: os.stat_result) -> str:
    return _why_foreign(status) or ("" if status.st_nlink < 2 else _SHARED)


def _why_no_folder(status: os.stat_result) -> str:
    return "" if stat.S_ISDIR(status.st_mode) else _LINK if stat.S_ISLNK(status.st_mode) else "it is no folder"


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


def sync_folder(folder: Path) -> None:
    """Make the names of a folder's files survive a loss of power, if the file system can do that."""
    with suppress(OSError):  # Windows cannot open folders, and some file systems cannot sync them
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


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
