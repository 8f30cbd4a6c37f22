"""Child processes of tests. Each may take ten times as long as on a quiet machine."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

TIMES_QUIET = 10


def run_child(
    words: Iterable[str | Path], *, quiet_seconds: float = 30, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, and keep its output as text.

    `quiet_seconds` is at least its time on a quiet machine; options are those of `subprocess.run`.
    """
    usual = {"text": True, "check": False, "capture_output": not {"stdout", "stderr"} & {*options}}
    return subprocess.run([*map(str, words)], timeout=TIMES_QUIET * quiet_seconds, **usual | options)


def run_python(*arguments: str | Path, quiet_seconds: float = 30, **options: Any) -> subprocess.CompletedProcess[str]:
    return run_child([sys.executable, *arguments], quiet_seconds=quiet_seconds, **options)
