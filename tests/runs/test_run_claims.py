"""Runs started at the same moment: each gets a separate folder, and none writes into another's."""

import multiprocessing
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest
from children import TIMES_QUIET

from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.run_folder import RunFolder, claim_folder
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig

N_PROCESSES, N_ROUNDS = 8, 6
SMALL = TrainConfig(EnvConfig("a", size=11))


def claim(number: int, barrier: Barrier, folder: Path) -> None:
    """In each round claim a folder by the same name, and try to create the one given as `--out`."""
    for n in range(N_ROUNDS):
        barrier.wait()
        run = RunFolder.create(claim_folder(folder / "runs" / f"name{n}"), SMALL.changed(seed=number))
        assert run.config().env == SMALL.env
        for kind in ("new", "empty"):
            barrier.wait()
            try:
                RunFolder.create(folder / kind / str(n), SMALL.changed(seed=number))
                outcome = "won"
            except InputError as error:
                outcome = str(error)
            (folder / "outcomes" / f"{kind}-{n}-{number}").write_text(outcome)


@pytest.mark.slow
def test_eight_processes_never_claim_the_same_folder(tmp_path):
    for n in range(N_ROUNDS):
        (tmp_path / "empty" / str(n)).mkdir(parents=True)
    (tmp_path / "outcomes").mkdir()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["hierroom.runs.folder.run_folder"])  # torch is imported once, not eight times
    barrier = context.Barrier(N_PROCESSES, timeout=TIMES_QUIET * 6)
    processes = [context.Process(target=claim, args=(n, barrier, tmp_path)) for n in range(N_PROCESSES)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(timeout=TIMES_QUIET * 12)
    assert [process.exitcode for process in processes] == [0] * N_PROCESSES
    for n in range(N_ROUNDS):
        names = [f"name{n}", *(f"name{n}-{k}" for k in range(2, N_PROCESSES + 1))]
        assert sorted(path.name for path in tmp_path.glob(f"runs/name{n}*")) == names
        seeds = {RunFolder.open(tmp_path / "runs" / name).config().seed for name in names}
        assert seeds == set(range(N_PROCESSES))
        for kind in ("new", "empty"):
            outcomes = [(tmp_path / "outcomes" / f"{kind}-{n}-{k}").read_text() for k in range(N_PROCESSES)]
            assert outcomes.count("won") == 1
            assert RunFolder.open(tmp_path / kind / str(n)).config().seed == outcomes.index("won")
            refused = f"{tmp_path / kind / str(n)} is not an empty folder; choose another --out, or --resume it"
            assert outcomes.count(refused) == N_PROCESSES - 1


def test_unclaimable_folder_raises_input_error(tmp_path):
    (tmp_path / "runs").write_text("a file")
    with pytest.raises(InputError, match=r"^cannot create the folder .*/runs: File exists$"):
        claim_folder(tmp_path / "runs" / "name")
    with pytest.raises(InputError, match=r"^cannot create the folder .*: File name too long$"):
        claim_folder(tmp_path / ("long" * 100))


def test_claim_folder_keeps_existing_files(tmp_path):
    (tmp_path / "name").write_text("a file")
    (tmp_path / "name-2").symlink_to("nowhere")
    assert claim_folder(tmp_path / "name") == tmp_path / "name-3"
    assert (tmp_path / "name").read_text() == "a file"
