"""The jobs of a sweep on this machine: a process for each core, which is replaced if it is killed."""

from __future__ import annotations

import gc
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from hierroom.lab.sweep.job import MAX_TRIES, Event, Job
from hierroom.runs.folder.provenance import version_of_code
from hierroom.runs.folder.run_lock import RunLockedError
from hierroom.support.errors import in_one_line
from hierroom.support.interrupt import Interrupt, awaited, blocked

_SPAWN = get_context("spawn")  # a forked process would share torch's threads and the kernels' cache locks
_SAVING_SECONDS, _ENDING_SECONDS = 60.0, 10.0  # time for processes to save their runs when the sweep stops, and to end


@dataclass
class _Worker:
    process: BaseProcess
    connection: Connection
    job: Job | None = None

    @classmethod
    def start(cls) -> _Worker:
        ours, theirs = _SPAWN.Pipe()
        process = _SPAWN.Process(target=_work, args=(theirs, sys.orig_argv))  # no daemon, as tasks have processes
        if hasattr(signal, "pthread_sigmask"):
            resource_tracker.ensure_running()  # else the first process would start it, and it unblocks Ctrl-C
        with blocked([signal.SIGINT]):  # else Ctrl-C would end the process while it imports modules
            process.start()
        theirs.close()  # so that our end closes when the process ends
        return cls(process, ours)


def work_here(
    jobs: Sequence[Job], processes: int, interrupt: Interrupt, is_done: Callable[[Job], bool]
) -> Generator[Event, None, None]:
    """Do jobs on this machine in order, and yield their events; a request to stop saves the active runs.

    A job is skipped if another process has done it or is doing it. Close the iterator, which ends the processes.
    """
    waiting, tries = deque(jobs), dict.fromkeys((job.run.digest for job in jobs), 1)
    workers: list[_Worker] = []
    try:
        workers += (_Worker.start() for _ in range(min(processes, len(jobs))))
        while not interrupt.is_requested and (waiting or any(worker.job for worker in workers)):
            for n, worker in enumerate(workers):
                if not worker.process.is_alive() and worker.job is None:
                    workers[n] = worker = _Worker.start()
                while worker.job is None and waiting:
                    if is_done(waiting[0]):
                        yield Event("done elsewhere", waiting.popleft())
                        continue
                    worker.job = waiting.popleft()
                    with suppress(OSError):  # if it was just killed, `_heard` notices that
                        worker.connection.send(worker.job)
            for event in _heard(workers, 0.2):
                job = event.job
                if event.kind == "interrupted" and not interrupt.is_requested:
                    event = Event("retried", job)  # only its process was stopped, not the sweep
                if event.kind == "retried":
                    if tries[job.run.digest] == MAX_TRIES:
                        event = Event("failed", job, f"its process was killed or stopped {MAX_TRIES} times")
                    else:
                        tries[job.run.digest] += 1
                        waiting.appendleft(job)
                yield event
        yield from _stopped(workers)
    finally:
        for worker in workers:
            worker.connection.close()  # an idle process ends, and ends those of its task
        for worker in workers:
            worker.process.join(_ENDING_SECONDS if worker.job is None else 0)
            worker.process.kill()
            worker.process.join()


def _stopped(workers: list[_Worker]) -> Iterator[Event]:
    for worker in workers:
        if worker.job is not None:
            worker.process.terminate()
    last = time.monotonic() + _SAVING_SECONDS
    while names := [worker.job.run.name for worker in workers if worker.job is not None]:
        with awaited(f"{', '.join(names)} to be saved"):
            if (seconds := last - time.monotonic()) <= 0:
                break
            events = [*_heard(workers, seconds)]
        for event in events:
            # Before and after training there is nothing to save, and SIGTERM simply ends the process.
            yield Event("interrupted", event.job) if event.kind == "retried" else event
    for worker in workers:
        if worker.job is not None:
            yield Event("unsaved", worker.job)


def _heard(workers: list[_Worker], timeout: float) -> Iterator[Event]:
    ready = wait([worker.connection for worker in workers if worker.job is not None], timeout)
    for worker in workers:
        job = worker.job
        if job is None or worker.connection not in ready:
            continue
        try:
            kind, content = worker.connection.recv()
        except (EOFError, OSError):
            worker.process.join()
            kind, content = "retried", None
        if kind != "progressed":
            worker.job = None
        yield Event(kind, job, content)


def _work(connection: Connection, command: list[str]) -> None:
    sys.orig_argv = command  # runs record this, instead of multiprocessing's command
    version_of_code()  # before a later commit could change it
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches this process too, but the sweep stops it by SIGTERM
    while True:
        try:
            job = connection.recv()
        except (EOFError, OSError):  # the sweep has ended or was killed
            gc.freeze()  # else Python collects garbage at exit, for seconds on a busy machine
            return
        try:
            numbers = job.work(lambda steps, words: connection.send(("progressed", (steps, words))))
        except BrokenPipeError:  # the sweep was killed; saved files stay
            return
        except RunLockedError:
            connection.send(("busy", None))
        except Exception as error:
            connection.send(("failed", in_one_line(error)))
        else:
            connection.send(("finished" if numbers is not None else "interrupted", numbers))
