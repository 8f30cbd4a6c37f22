"""A trained agent in one small file: config, weights and a digest, as safetensors, which runs no code."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError, shown
from hierroom.support.files import to_json, usable_path, write_atomically

SUFFIX = ".safetensors"
FOLDER = Path(__file__).parents[2] / "weights"
SHIPPED = ("a", "b", "c", "d", "e", "f", "g", "learned-g")
"""The built-in agents: HiPPO with the default preset on graphs a to g, and a learned meta-controller on g."""
_FORMAT = "hierroom agent 1"
_OUTLINE = msgspec.defstruct(
    "Outline", [("config", dict), ("descriptions", dict), ("steps", Annotated[int, msgspec.Meta(ge=0, le=2**62)])]
)


@dataclass(frozen=True)
class SavedAgent:
    """A trained agent, read from a file of weights or a checkpoint."""

    config: TrainConfig  # the config of its training
    steps: int  # primitive steps it was trained for
    agents: Mapping[str, dict[str, Any]]  # the argument of `PPOAgent.take_weights` for each agent that learns

    def write(self, path: Path) -> None:
        """Write it to a file, replacing one that exists."""
        tensors = {
            f"{agent}.{name}": tensor.detach().cpu().clone(memory_format=torch.contiguous_format)  # it may be shared
            for agent, state in self.agents.items()
            for name, tensor in state["learner"]["backend"]["network"].items()
        }
        metadata = {
            "format": _FORMAT,
            "config": to_json(self.config.to_dict()),
            "steps": str(self.steps),
            "descriptions": to_json({agent: state["description"] for agent, state in self.agents.items()}),
        }
        write_atomically(path, save(tensors, {**metadata, "sha256": digest(metadata, tensors)}))

    @classmethod
    def read(cls, path: Path) -> SavedAgent:
        """Read it from a file."""
        if not path.is_file():
            raise InputError(f"there is no file {path}")
        try:
            with safe_open(path, "pt") as file:
                metadata, tensors = file.metadata() or {}, {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror or error}") from error
        except SafetensorError as error:
            raise InputError(f"{path} is no file of weights, or damaged: {error}") from error
        if metadata.get("format") != _FORMAT:
            raise InputError(f"{path} holds no agent of this hierroom: its format is {shown(metadata.get('format'))}")
        if metadata.pop("sha256", None) != digest(metadata, tensors):
            raise InputError(f"{path} is damaged: its content is not the one that its digest was made of")
        try:
            entries = {name: json.loads(metadata.get(name, "null")) for name in ("config", "descriptions", "steps")}
            msgspec.convert(entries, _OUTLINE)
            config = TrainConfig.from_dict(entries["config"])
        except (ValueError, RecursionError, InputError) as error:  # errors of msgspec are ValueErrors
            raise InputError(f"{path} cannot be used: {error}") from error
        agents: dict[str, dict[str, Any]] = {}
        for agent, description in entries["descriptions"].items():
            before = f"{agent}."
            own = {name.removeprefix(before): tensor for name, tensor in tensors.items() if name.startswith(before)}
            agents[agent] = {"description": description, "learner": {"backend": {"network": own}}}
        return cls(config, entries["steps"], agents)


def weights_file(run: str | Path) -> Path | None:
    """Return the file of weights for a path, or for a name in `SHIPPED`; None for the folder of a run."""
    path = usable_path(run)
    if str(run) in SHIPPED and not path.exists():
        return FOLDER / f"{run}{SUFFIX}"
    return path if path.suffix == SUFFIX and not path.is_dir() else None


def digest(metadata: Mapping[str, str], tensors: Mapping[str, torch.Tensor]) -> str:
    """Return the SHA-256 of named texts and tensors, in hexadecimal."""
    sha = hashlib.sha256(json.dumps(dict(metadata), sort_keys=True).encode())
    for name in sorted(tensors):
        tensor = tensors[name]
        sha.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
        sha.update(tensor.contiguous().reshape(-1).view(torch.uint8).numpy(force=True).tobytes())
    return sha.hexdigest()
