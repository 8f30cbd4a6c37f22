"""What a logger is: it shows a run's numbers while it trains, beside the tables that every run has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

Plain = bool | int | float | str


class Logger(Protocol):
    """Shows the numbers of a run somewhere. Whatever it raises, training goes on without it."""

    label: str
    """What it is called in a warning."""

    def add(self, scalars: Mapping[str, float], steps: int) -> None:
        """Show numbers, by tags such as ``eval/success_rate``, after so many primitive steps."""
        ...

    def add_results(self, hyperparameters: Mapping[str, Plain], results: Mapping[str, float], steps: int) -> None:
        """Show what the run was trained with beside how it ended."""
        ...

    def sync(self) -> None:
        """Have what was shown outlive a loss of power, as far as that is in the logger's hands."""
        ...

    def close(self, *, is_done: bool) -> None:
        """End a session.

        Args:
            is_done: whether the run has taken all of its steps; else it may be resumed.
        """
        ...
