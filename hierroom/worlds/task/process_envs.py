"""N environments of a task in several processes."""

from __future__ import annotations

from collections.abc import Sequence
from multiprocessing.util import Finalize
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierroom.support.errors import InputError, RunError
from hierroom.worlds.task.local_envs import Taken
from hierroom.worlds.task.parts import TaskParts
from hierroom.worlds.task.worker import Worker


class ProcessEnvs:
    """N environments in several processes, with the interface of `LocalEnvs`."""

    def __init__(self, task: TaskParts, num_envs: int, render_mode: str | None = None) -> None:
        self._share = -(-num_envs // min(task.processes, num_envs))
        shares = [range(first, min(first + self._share, num_envs)) for first in range(0, num_envs, self._share)]
        self.workers: list[Worker] = []
        self._end = Finalize(self, Worker.end, (self.workers,), exitpriority=1)  # before Python joins the processes
        try:
            for number, envs in enumerate(shares, 1):
                self.workers.append(Worker(task, envs, number, len(shares), render_mode))
            self._answers(range(len(shares)))
        except BaseException:
            self.close()
            raise

    def __reduce__(self) -> Any:
        """Refuse copies, which would share and close the pipes of the original."""
        raise InputError("environments in other processes cannot be copied; make the task with processes=0")

    def reset(self, envs: Sequence[int], seeds: Sequence[int]) -> tuple[list[Any], NDArray]:
        """Begin an episode in some environments; return their observations and goal values [M, G]."""
        answers, order = self._call("reset", envs, seeds)
        observations, totals = zip(*answers, strict=True)
        return _joined(observations, order), np.concatenate(totals)[order]

    def step(self, envs: Sequence[int], actions: Sequence[Any]) -> Taken:
        """Act in some environments."""
        answers, order = self._call("step", envs, actions)
        observations, *results = zip(*answers, strict=True)
        return Taken(_joined(observations, order), *(np.concatenate(parts)[order] for parts in results))

    def _call(self, method: str, envs: Sequence[int], values: Sequence[Any]) -> tuple[list[Any], NDArray[np.intp]]:
        """Return the workers' answers, and the place of each environment in the joined answers."""
        places = np.argsort(np.array(envs) // self._share, kind="stable")
        shares: dict[int, tuple[list[int], list[Any]]] = {}
        for place in places.tolist():
            worker, env = divmod(envs[place], self._share)
            own_envs, own_values = shares.setdefault(worker, ([], []))
            own_envs.append(env)
            own_values.append(values[place])
        for worker, share in shares.items():
            self.workers[worker].call(method, *share)
        return self._answers([*shares]), np.argsort(places)

    def _answers(self, workers: Sequence[int]) -> list[Any]:
        answers, errors = [], []
        for worker in workers:
            try:
                answers.append(self.workers[worker].answer())
            except (InputError, RunError) as error:
                errors.append(error)
        for error in errors:
            raise error
        return answers

    def render(self, env: int) -> NDArray[np.uint8]:
        """Return an environment's picture [H, W, 3]."""
        worker, place = divmod(env, self._share)
        self.workers[worker].call("render", place)
        return self.workers[worker].answer()

    def close(self) -> None:
        """End the processes."""
        self._end()


def _joined(parts: Sequence[list[Any]], order: NDArray[np.intp]) -> list[Any]:
    joined = [one for part in parts for one in part]
    return [joined[place] for place in order.tolist()]
