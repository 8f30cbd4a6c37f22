"""A run that is asked to stop at a given moment."""

import os

import pytest

from hierroom.runs.trainer import Trainer


def stop_at_update(monkeypatch: pytest.MonkeyPatch, number: int, at: int) -> None:
    """Have update ``at``, counted over all sessions from 1, send this process the signal ``number``."""
    advance, calls = Trainer.advance, []

    def stopped(self):
        calls.append(1)
        if len(calls) == at:
            os.kill(os.getpid(), number)
        advance(self)

    monkeypatch.setattr(Trainer, "advance", stopped)
