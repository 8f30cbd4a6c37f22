"""The lock of a run's folder: one process at a time works on a run."""

from __future__ import annotations

from pathlib import Path

from filelock import FileLock, Timeout

from hierroom.support.errors import InputError
from hierroom.support.files import refuse_foreign


class RunLockedError(InputError):
    """Another process trains the run."""


class RunLock:
    """The lock of a process that trains a run. The system releases it when the process ends; readers need no lock."""

    FILE = ".lock"

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock = folder, FileLock(folder / self.FILE, timeout=0)

    def acquire(self) -> None:
        """Take the lock, unless this object has it already."""
        try:
            if not self._lock.is_locked:
                refuse_foreign(changed=[self._folder / self.FILE])
                self._lock.acquire()
        except Timeout:
            busy = f"{self._folder} is being trained by another process; wait until that ends, or stop it"
            raise RunLockedError(busy) from None
        except (OSError, NotImplementedError) as error:
            raise InputError(f"cannot lock the run folder {self._folder}: {error}") from error

    @property
    def is_held(self) -> bool:
        """Return whether another process has the lock."""
        try:
            self.acquire()
        except RunLockedError:
            return True
        self.release()
        return False

    def release(self) -> None:
        """Give the lock back."""
        self._lock.release(force=True)

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()
