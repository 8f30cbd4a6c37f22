"""Short runs of tasks without a target."""

from pathlib import Path

from hierroom.train import main as train

SMALL = ["--num-envs", "4", "--sequence-length", "16", "--minibatches", "2", "--epochs", "1", "--hidden-size", "8"]
SMALL += ["--steps", "512", "--evaluations", "2", "--evaluation-episodes", "8", "--threads", "1", "--log", "none"]
AGENTS = {"balance": [], "camp": ["--meta", "learned"]}
"""Options by task: balance has no goals, camp has some and no target."""


def trained(task: str, folder: Path, code: int = 0) -> Path:
    out = folder / task
    assert train(["--task", f"chest_task:{task}", *SMALL, *AGENTS[task], "--out", str(out)]) == code
    return out
