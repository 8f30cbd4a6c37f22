"""Runs every client of the package that is installed, and prints docs/clients.md's table: versions, and whether it ran.

``python benchmarks/clients.py`` runs those of this Python. Some libraries pin others, so that no environment has all of
them. ``--python PATH`` names further Pythons, in which each client is looked for in turn. ``--out docs/clients.md``
writes the table into the page.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import tyro

from hierroom.support.files import write_atomically

ROOT = Path(__file__).resolve().parents[1]
MARKS = "<!-- table: python benchmarks/clients.py -->\n", "<!-- end of table -->\n"


@dataclass(frozen=True)
class Client:
    """A library, and the example that shows how it is used.

    Args:
        name: for the table.
        packages: the distributions that it needs, the first one its own.
        example: file in examples/.
        view: what it is given.
    """

    name: str
    packages: tuple[str, ...]
    example: str
    view: str


CLIENTS = (
    Client("TorchRL", ("torchrl", "tensordict"), "clients/torchrl_ppo.py", "AEC, box views"),
    Client("BenchMARL", ("benchmarl", "torchrl"), "clients/benchmarl_mappo.py", "box view, parallel"),
    Client("Tianshou", ("tianshou",), "clients/tianshou_dqn.py", "box view, AEC"),
    Client(
        "PettingZoo's tutorial with MaskablePPO",
        ("sb3-contrib", "pettingzoo"),
        "clients/sb3_maskable_turns.py",
        "box view, AEC",
    ),
    Client("MaskablePPO", ("sb3-contrib",), "clients/sb3_maskable_ppo.py", "Gymnasium"),
    Client("Stable-Baselines3", ("stable-baselines3",), "clients/sb3_ppo.py", "`sb3_view`, Gymnasium vector"),
    Client("SuperSuit", ("SuperSuit", "stable-baselines3"), "supersuit_sb3.py", "box view, parallel"),
    Client("CleanRL's loop, Gymnasium's vector wrappers", ("gymnasium",), "clients/cleanrl_ppo.py", "Gymnasium vector"),
    Client("RLlib", ("ray", "gymnasium"), "clients/rllib_ppo.py", "box view, AEC"),
    Client("AgileRL", ("agilerl", "pettingzoo"), "clients/agilerl_ippo.py", "box view, parallel"),
    Client("MiniGrid's wrappers", ("minigrid",), "clients/minigrid_wrappers.py", "`minigrid_view`, Gymnasium"),
    Client("Gymnasium's tools", ("gymnasium",), "clients/gymnasium_tools.py", "Gymnasium"),
    Client("Optuna", ("optuna",), "clients/optuna_pruning.py", "a callback of `hierroom.train`"),
    Client("Minari", ("minari", "h5py"), "clients/minari_data.py", "`minari_dataset`"),
    Client("ONNX Runtime", ("onnxruntime", "onnxscript"), "clients/onnx_controller.py", "`agent.network`"),
    Client("Jupyter", ("ipython",), "clients/notebook.py", "goal graphs, reports"),
)


@dataclass(frozen=True)
class Arguments:
    """Run every client that is installed.

    Args:
        python: further Pythons in which clients are looked for.
        out: page into which the table is written, or nowhere.
        only: names of the clients to run; all of them by default.
    """

    python: tuple[Path, ...] = ()
    out: Path | None = None
    only: tuple[str, ...] = ()


def versions(python: Path, packages: tuple[str, ...]) -> dict[str, str] | None:
    """Return the versions of some distributions that a Python has, or None if it lacks one."""
    code = (
        "import importlib.metadata as m, json, sys\n"
        "try: print(json.dumps({name: m.version(name) for name in sys.argv[1:]}))\n"
        "except m.PackageNotFoundError: print('null')"
    )
    done = subprocess.run([python, "-c", code, *packages], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def run(python: Path, example: str) -> subprocess.CompletedProcess[str]:
    """Run an example in an empty folder, with this copy of the package."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore", "SDL_VIDEODRIVER": "dummy"}
        command = [str(python), str(ROOT / "examples" / example)]
        return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600)


def row(client: Client, pythons: tuple[Path, ...]) -> str:
    """Return a line of the table."""
    example = f"[{Path(client.example).name}](../examples/{client.example})"
    for python in pythons:
        found = versions(python, client.packages)
        if found is not None:
            started = time.perf_counter()
            done = run(python, client.example)
            if done.returncode:
                print(done.stderr[-2000:], file=sys.stderr)
            said = f"ran in {time.perf_counter() - started:.0f} s" if done.returncode == 0 else "**failed**"
            named = ", ".join(f"{name} {version}" for name, version in found.items())
            return f"| {client.name} | {named} | {client.view} | {example} | {said} |"
    return f"| {client.name} | not installed | {client.view} | {example} | not run |"


def main(arguments: Arguments) -> None:
    """Run the clients and print the table."""
    pythons = (Path(sys.executable), *arguments.python)
    chosen = [client for client in CLIENTS if not arguments.only or client.name in arguments.only]
    lines = ["| client | versions | what it is given | example | |", "|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    for client in chosen:
        lines.append(row(client, pythons))
        print(lines[-1], flush=True)
    if arguments.out is not None:
        page = arguments.out.read_text(encoding="utf-8")
        table = "\n".join(lines) + "\n"
        new = re.sub(f"{MARKS[0]}.*{MARKS[1]}", lambda _: MARKS[0] + table + MARKS[1], page, flags=re.DOTALL)
        write_atomically(arguments.out, new.encode())


if __name__ == "__main__":
    main(tyro.cli(Arguments))
