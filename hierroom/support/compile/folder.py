"""A folder for compiled kernels where Numba finds none, in which nobody else can write: what is read there is run."""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import tempfile
from pathlib import Path


def private_folder() -> str | None:
    """The user's own folder for compiled kernels among the temporary files, the same in each process.

    Where something else has its name, or others may write into it, it is a new folder that is removed at the end of
    this process. None: there is no place for temporary files.
    """
    try:
        if hasattr(os, "getuid"):  # elsewhere temporary files are each user's own, and modes say little
            path = Path(tempfile.gettempdir()).absolute() / f"hierroom-kernels-{os.getuid()}"
            path.mkdir(mode=0o700, exist_ok=True)
            if _is_private(path):
                return str(path)
    except OSError:
        pass
    try:
        path = tempfile.mkdtemp(prefix="hierroom-kernels-")
    except OSError:
        return None
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


def _is_private(path: Path) -> bool:
    """Whether it is a folder, not a link to one, that belongs to this user, who alone may read or write in it."""
    status = path.lstat()
    is_own = stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o077
    return is_own and os.access(path, os.W_OK | os.X_OK)
