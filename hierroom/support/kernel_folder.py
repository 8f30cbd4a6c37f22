"""The folder of compiled kernels, with the digest of all their source in its name, so that none is outdated.

Numba keeps compiled code while the kernel's own file is unchanged, but kernels call kernels of other files.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import shutil
import stat
import tempfile
import time
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path

from numba.core import config

PACKAGE = Path(__file__).parents[1]
CONSTANTS = ("constants.py", "ids.py")  # files of numbers that kernels use
_DAY = 24 * 60 * 60


@cache
def kernel_folder() -> str | None:
    """Return the first folder that can be written: in NUMBA_CACHE_DIR, the package, the user's cache, temporary files.

    Return None if there is none. Warn if it is the temporary folder or None.
    """
    chosen = config.CACHE_DIR  # pyright: ignore[reportAttributeAccessIssue] - Numba sets it at run time
    installation = hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:8]
    name = Path("hierroom", f"{installation}-{digest_of_kernels(PACKAGE)[:16]}")
    cache_home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    for place in (chosen and os.path.abspath(chosen), PACKAGE / "__pycache__", cache_home):
        if os.path.isabs(place) and _can_write(folder := place / name):
            _remove_old({*folder.parent.glob(f"{installation}-*")} - {folder})
            return str(folder)
    folder = _private_folder()
    kept = f"is kept in {folder}" if folder else "is lost at the end of each process, so the next compiles it again"
    if multiprocessing.parent_process() is None:
        reason = f"neither the package nor the user's cache folder can be written: the compiled code of kernels {kept}"
        advice = "set NUMBA_CACHE_DIR to a folder of your own to keep it elsewhere"
        warnings.warn(f"{reason}; {advice}", RuntimeWarning, stacklevel=2)
    return folder and str(folder / name)


def _remove_old(folders: set[Path]) -> None:
    """Remove folders of earlier source, unless they changed within a day, as a process may still write there."""
    for folder in folders:
        with suppress(OSError):  # another process has removed it
            if time.time() - folder.stat().st_mtime > _DAY:
                shutil.rmtree(folder)


def digest_of_kernels(folder: Path) -> str:
    """Return the SHA-256 of all files in a folder that define kernels, or constants that are compiled into them."""
    contents = {path: path.read_bytes() for path in sorted(folder.rglob("*.py"))}
    of_kernels = (content for path, content in contents.items() if path.name in CONSTANTS or b"njit(" in content)
    return hashlib.sha256(b"".join(of_kernels)).hexdigest()


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _private_folder() -> Path | None:
    """Return a temporary folder that only this user can write, because code in it is run; None if there is none."""
    try:
        path = Path(tempfile.gettempdir()).absolute() / f"hierroom-{os.getuid()}"
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.lstat()
    except (OSError, AttributeError):  # Windows has no user ids, and its cache folders can be written
        return None
    is_private = stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077
    return path if is_private and _can_write(path) else None
