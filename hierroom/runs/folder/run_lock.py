"""The lock of a folder: one process at a time works on a run, or writes the tables of a sweep."""

from __future__ import annotations

from pathlib import Path

from filelock import FileLock, Timeout

from hierroom.support.errors import InputError
from hierroom.support.files import refuse_foreign


class RunLockedError(InputError):
    """Another process trains the run."""


class RunLock:
    """A lock in a folder. The system releases it when the process ends; readers need no lock.

    ``timeout`` is the number of seconds to wait for another process; -1: until it ends.
    """

    FILE = ".lock"

    def __init__(self, folder: Path, file: str = FILE, timeout: float = 0) -> None:
        self._folder, self.path = folder, folder / file
        self._lock = FileLock(self.path, timeout=timeout)

    def acquire(self) -> None:
        """Take the lock, unless this object has it already."""
        try:
            if not self._lock.is_locked:
                refuse_foreign(changed=[self.path])
                self._lock.acquire()
        except Timeout:
            busy = f"{self._folder} is being trained by another process; wait until that ends, or stop it"
            raise RunLockedError(busy) from None
        except (OSError, NotImplementedError) as error:  # the latter where a file system knows no locks
            raise InputError(f"cannot lock the folder {self._folder}: {error}") from error

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

    __enter__ = acquire

    def __exit__(self, *_: object) -> None:
        self.release()
