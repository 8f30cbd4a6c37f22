"""The lock of a run's folder: one process at a time works on a run."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

from filelock import FileLock, Timeout

from hierroom.support.errors import InputError


class RunLock:
    """Held by the process that trains a run; reading a run needs no lock.

    The operating system holds it, so it ends with the process, however that ends, and no stale one can be left. The
    file stays in the folder: whether it is there says nothing.

    Args:
        folder: of the run.
    """

    FILE = ".lock"

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = FileLock(folder / self.FILE, timeout=0)

    def acquire(self) -> None:
        """Hold the lock from now on."""
        if not self.try_acquire():
            raise InputError(f"{self._folder} is being trained by another process; wait until that ends, or stop it")

    def try_acquire(self) -> bool:
        """Try to hold the lock from now on; returns whether this object holds it."""
        try:
            if not self._lock.is_locked:
                self._lock.acquire()
            return True
        except Timeout:
            return False
        except (OSError, NotImplementedError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise InputError(f"cannot lock the run folder {self._folder}: {reason}") from error

    def release(self) -> None:
        """Hold it no longer."""
        self._lock.release(force=True)

    def __enter__(self) -> RunLock:
        self.acquire()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.release()
