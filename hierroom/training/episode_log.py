"""Statistics of the most recent episodes."""

from __future__ import annotations

from collections import deque

import numpy as np

from hierroom.step import Step

WINDOW = 500
"""Number of episodes over which success and length are averaged."""
MILESTONES = (50, 90, 95, 99)
"""Success rates in percent whose first crossing is recorded."""


class EpisodeLog:
    """Success rate and length of the last 500 episodes, and when the success rate first crossed each milestone.

    Attributes:
        episodes: number of episodes that have ended.
        steps_to: for each milestone crossed (in percent), the number of primitive steps until then.
        seconds_to: the same in seconds of training.
    """

    def __init__(self) -> None:
        self.episodes = 0
        self.steps_to: dict[int, int] = {}
        self.seconds_to: dict[int, float] = {}
        self._successes: deque[bool] = deque(maxlen=WINDOW)
        self._lengths: deque[int] = deque(maxlen=WINDOW)

    def add(self, step: Step, steps: int, seconds: float) -> None:
        """Record the episodes that a step ended, in the order of their environments.

        Args:
            step: the outcome of the step.
            steps: number of primitive steps trained so far.
            seconds: seconds trained so far.
        """
        ended = np.flatnonzero(step.episode_ended)
        if not len(ended):
            return
        self.episodes += len(ended)
        self._successes.extend(step.terminated[ended].tolist())
        self._lengths.extend(step.lengths[ended].tolist())
        if len(self._successes) == WINDOW:
            for milestone in MILESTONES:
                if milestone not in self.steps_to and self.success_rate >= milestone / 100:
                    self.steps_to[milestone], self.seconds_to[milestone] = steps, seconds

    @property
    def success_rate(self) -> float:
        """Fraction of the window's episodes that reached the exit; 0 before the first episode ends."""
        return float(np.mean(self._successes)) if self._successes else 0.0

    @property
    def episode_length(self) -> float:
        """Mean length of the window's episodes in primitive steps; NaN before the first episode ends."""
        return float(np.mean(self._lengths)) if self._lengths else float("nan")

    def state_dict(self) -> dict:
        """The complete state as plain types."""
        return {
            "episodes": self.episodes,
            "steps_to": dict(self.steps_to),
            "seconds_to": dict(self.seconds_to),
            "successes": list(self._successes),
            "lengths": list(self._lengths),
        }

    def load_state_dict(self, state: dict) -> None:
        """Restore what `state_dict` returned."""
        self.episodes = state["episodes"]
        self.steps_to, self.seconds_to = dict(state["steps_to"]), dict(state["seconds_to"])
        self._successes = deque(state["successes"], WINDOW)
        self._lengths = deque(state["lengths"], WINDOW)
