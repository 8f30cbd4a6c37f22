"""The file operations of a process below a folder; it is killed right before one."""

import builtins
import io
import os
import signal
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

AUDITED = ("open", "os.rename", "os.remove", "os.mkdir", "os.truncate", "shutil.copyfile")
"""Audit events of Python before it changes a file; writing and syncing are reported by `Places.install`."""


class Places:
    """Counts the file operations below a folder, and kills before one of them.

    These are opening a file to write, writing bytes, syncing, renaming, deleting, truncating, copying and making a
    folder. Text that is written and folders that are deleted are not heard of; hierroom does neither in a run's folder.

    It kills before operation ``at``, counted from 0, and if that is torn, after the first half of what it writes.
    """

    def __init__(self, folder: Path, at: int | None, is_torn: bool = False) -> None:
        self.folder, self.at, self.is_torn, self.n = str(folder), at, is_torn, 0

    def audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in AUDITED and isinstance(arguments[0], (str, os.PathLike)) and self.has(arguments[0]):
            if event == "open" and not (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR):
                return
            self.next()

    def has(self, path: Any) -> bool:
        place = os.path.abspath(os.fspath(path))
        return place == self.folder or place.startswith(self.folder + os.sep)

    def next(self, half: Callable[[], object] = lambda: None) -> None:
        """Before an operation: end here, if it is the one."""
        if self.n == self.at:
            if self.is_torn:
                half()
            os.kill(os.getpid(), signal.SIGKILL)
        self.n += 1

    def install(self) -> None:
        """Report every file operation of this process to this object."""
        write, fsync, open_file = os.write, os.fsync, io.open

        def observed_write(number: int, content: Any) -> int:
            if number > 2 and stat.S_ISREG(os.fstat(number).st_mode):
                self.next(lambda: write(number, bytes(content)[: len(content) // 2]))
            return write(number, content)

        def observed_fsync(number: int) -> None:
            self.next()
            fsync(number)

        def observed_open(file: Any, mode: str = "r", *arguments: Any, **named: Any) -> Any:
            opened = open_file(file, mode, *arguments, **named)
            if "b" in mode and not {*mode}.isdisjoint("wxa") and not isinstance(file, int) and self.has(file):
                return Reported(opened, self)
            return opened

        os.write, os.fsync, io.open, builtins.open = observed_write, observed_fsync, observed_open, observed_open
        sys.addaudithook(self.audit)


class Reported:
    """A file that reports its writes."""

    def __init__(self, file: Any, places: Places) -> None:
        self._file, self._places = file, places

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> "Reported":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def write(self, content: bytes) -> int:
        def half() -> None:
            self._file.write(content[: len(content) // 2])
            self._file.flush()

        self._places.next(half)
        return self._file.write(content)
