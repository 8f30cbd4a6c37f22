"""The jobs of a sweep on many machines, with Ray: each run is trained on a free core, and its folder is sent back."""

from __future__ import annotations

import io
import socket
import tarfile
from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from hierroom.lab.sweep.job import MAX_TRIES, Event, Job
from hierroom.support.errors import InputError, in_one_line
from hierroom.support.interrupt import Interrupt


def work_on_cluster(jobs: Sequence[Job], address: str, interrupt: Interrupt) -> Generator[Event, None, None]:
    """Do jobs on the machines of a Ray cluster, one core each, and yield their events.

    If its machine is lost, a run begins again on another one. Its folder is sent back when it is done; a request to
    stop keeps only folders that were sent back.
    """
    try:
        import ray  # pyright: ignore[reportMissingImports] - an extra
    except ImportError as error:
        raise InputError("--ray needs Ray: pip install 'hierroom[ray]'") from error
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if colon and port.isdecimal():
        try:  # without a server Ray would try to connect for many minutes
            socket.create_connection((host.strip("[]"), int(port)), timeout=10).close()
        except (OSError, OverflowError) as error:
            raise InputError(f"there is no Ray cluster at {address!r}: {error}") from error
    try:
        ray.init(address=address, ignore_reinit_error=True, logging_level="error", log_to_driver=False)
    except Exception as error:  # Ray raises errors of many types
        raise InputError(f"there is no Ray cluster at {address!r}: {error}") from error
    remote = ray.remote(num_cpus=1, max_retries=MAX_TRIES - 1)(_work_elsewhere)
    waiting = {}
    try:
        for job in jobs:
            try:
                job.check_folder()
            except InputError as error:
                yield Event("failed", job, str(error))
            else:
                waiting[remote.remote(job)] = job
        while waiting and not interrupt.is_requested:
            done, _ = ray.wait([*waiting], timeout=0.5)
            for reference in done:
                job = waiting.pop(reference)
                try:
                    numbers, content = ray.get(reference)
                    _unpack(content, job.folder)
                except Exception as error:  # of the run or its folder, or a machine lost too often
                    yield Event("failed", job, in_one_line(getattr(error, "cause", None) or error))
                else:
                    yield Event("progressed", job, (job.run.config.steps, ""))
                    yield Event("finished", job, numbers)
    finally:
        for reference in waiting:
            ray.cancel(reference, force=True)
        ray.shutdown()


def _work_elsewhere(job: Job) -> tuple[dict[str, object], bytes]:
    with TemporaryDirectory() as place:
        folder = Path(place, job.folder.name)
        numbers = replace(job, folder=folder).work(lambda steps, words: None)
        if numbers is None:
            raise InterruptedError("it was asked to stop")
        return numbers, _pack(folder)


def _pack(folder: Path) -> bytes:
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w:gz") as archive:
        archive.add(folder, arcname=".")
    return content.getvalue()


def _unpack(content: bytes, folder: Path) -> None:
    """Write or replace the folder of a run, whole or not at all, and never a file outside of it."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as place:
        whole = Path(place, "whole")
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:gz") as archive:
            archive.extractall(whole, filter="data")
        part = Path(place, "part")
        if folder.exists():
            folder.rename(part)
        try:
            whole.rename(folder)
        except OSError:
            if part.exists():
                part.rename(folder)
            raise
