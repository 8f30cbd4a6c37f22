"""Every client of docs/clients.md with an installed library runs its example unchanged."""

import re
import sys
from pathlib import Path

import pytest

from benchmarks.clients import CLIENTS, run, versions

ROOT = Path(__file__).parents[2]

SAID = {
    "TorchRL": r"240 steps, \d+ episodes ended, loss ",
    "BenchMARL": r"480 steps in 2 iterations",
    "Tianshou": r"800 turns, \d+ episodes, 20 updates",
    "PettingZoo's tutorial with MaskablePPO": r"1024 turns, the last episode of \d+",
    "MaskablePPO": r"1024 steps, \d+ episodes",
    "Stable-Baselines3": r"8192 steps, \d+ episodes, \d+ escapes",
    "SuperSuit": r"2048 turns of both agents in 4 environments",
    "CleanRL's loop, Gymnasium's vector wrappers": r"8192 steps, \d+ episodes, return \d\.\d\d",
    "RLlib": r"800 turns, losses \{'meta_0': ",
    "AgileRL": r"[1-9]\d* of \d+ weights changed",
    "MiniGrid's wrappers": r"256 steps on the whole grid",
    "Gymnasium's tools": r"two other processes: \(2, 7, 7, 3\)",
    "Optuna": r"best learning rate \d\.\de-0\d; \d of 5 runs pruned",
    "Minari": r"\d+ steps in 20 episodes, \d+ escapes",
    "ONNX Runtime": r"^(\d+) of \1 actions are the agent's",
    "Jupyter": r"GoalGraph: .*image/svg\+xml",
}


@pytest.mark.slow
@pytest.mark.parametrize("client", CLIENTS, ids=lambda client: client.name)
def test_client_example_runs(client):
    if versions(Path(sys.executable), client.packages) is None:
        pytest.skip(f"{', '.join(client.packages)} not installed: see the extras clients, ray, benchmarl and agilerl")
    done = run(Path(sys.executable), client.example)
    assert done.returncode == 0, done.stderr
    assert re.search(SAID[client.name], done.stdout), done.stdout


def test_every_example_belongs_to_a_client():
    examples = {path.relative_to(ROOT / "examples").as_posix() for path in (ROOT / "examples/clients").glob("*.py")}
    assert examples <= {client.example for client in CLIENTS}
    assert {client.name for client in CLIENTS} == set(SAID)
