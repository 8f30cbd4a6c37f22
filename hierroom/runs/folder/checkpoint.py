"""A checkpoint as bytes: torch's format, then a SHA-256 digest, because torch verifies no checksum."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
import numpy as np
import torch

from hierroom.support.errors import InputError, shown
from hierroom.turns.records import AGENTS

CHECKPOINT_FORMAT = 11
TABLES = ("metrics", "evaluations", "episodes")
"""The tables that grow with a run."""
_DEEPEST = 50
"""The most levels of nested lists and dicts; deeper ones, and those that contain themselves, could not be read."""
_MARK = b"\nsha256 "
_LENGTH = len(_MARK) + 64 + 1  # bytes of the last line: mark, hexadecimal digest, line feed
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
_Seconds = Annotated[float, msgspec.Meta(ge=0, le=2.0**62)]


def _record(entries: Mapping[str, Any]) -> type[msgspec.Struct]:
    return msgspec.defstruct("Outline", [*entries.items()], forbid_unknown_fields=True)


_OUTLINE = _record(
    {
        "format": int,
        "config": str,
        "turns": dict,
        "agents": _record(dict.fromkeys(AGENTS, dict)),
        "log": dict,
        "tables": _record(dict.fromkeys(TABLES, _Count)),
        "steps": _Count,
        "seconds": _Seconds,
        "compile_seconds": _Seconds,
    }
)
"""The structure that is checked when a checkpoint is read; the parts are checked where they are used."""


def to_bytes(state: Mapping[str, Any]) -> bytes:
    """Return the content of a checkpoint file for the state of a `Trainer` and the number of rows of each table."""
    plain = {name: _plain(entry, name) for name, entry in state.items()}
    buffer = io.BytesIO()
    torch.save({"format": CHECKPOINT_FORMAT, "tables": dict.fromkeys(TABLES, 0), **plain}, buffer)
    content = buffer.getvalue()
    return content + _last_line(content)


class OtherFormatError(InputError):
    """Error for a checkpoint of another version of hierroom, which wrote the earlier checkpoints too."""


def from_bytes(content: bytes) -> dict[str, Any]:
    """Return the state from the bytes of `to_bytes`; no code in them is executed."""
    content, last_line = content[:-_LENGTH], content[-_LENGTH:]
    if not last_line.startswith(_MARK):
        raise InputError(
            f"has no digest at its end: it is cut off, or of an older format than {CHECKPOINT_FORMAT}, which this "
            "hierroom reads"
        )
    if last_line != _last_line(content):
        raise InputError("is damaged: its content is not the one that its digest was made of")
    try:
        state = torch.load(io.BytesIO(content), "cpu", weights_only=True)
    except Exception as error:  # torch raises errors of many types
        lines = str(error).strip().splitlines() or [type(error).__name__]
        reason = lines[0].split(". ")[0]  # the rest is advice for users of torch
        raise InputError(f"cannot be read: {reason}") from error
    found = state.get("format") if isinstance(state, dict) else None
    if type(found) is not int or found != CHECKPOINT_FORMAT:
        raise OtherFormatError(f"has format {shown(found)}, this hierroom reads {CHECKPOINT_FORMAT}")
    try:
        msgspec.convert(state, _OUTLINE)
    except (msgspec.ValidationError, AttributeError) as error:  # AttributeError: a tensor instead of a dict
        raise InputError(f"cannot be used: {error}") from error
    return state


def _last_line(content: bytes) -> bytes:
    return _MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"


def _plain(value: Any, name: str, depth: int = 0) -> Any:
    """Return a state as tensors and plain types, so that loading it executes no code; ``name`` is for messages."""
    if depth > _DEEPEST:
        raise InputError(f"a checkpoint cannot hold {name[:100]}...: more than {_DEEPEST} nested lists and dicts")
    if value is None or type(value) in (bool, int, float, str, bytes):
        return value
    if isinstance(value, torch.Tensor) and value.layout is torch.strided and not value.is_quantized:
        return value.detach()
    if isinstance(value, np.generic) and value.dtype.kind in "biufUS":
        return float(value) if value.dtype.kind == "f" else value.item()  # item() of a long double is one too
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.dtype.itemsize <= 8:
        return torch.from_numpy(value.astype(value.dtype.newbyteorder("=")))
    if isinstance(value, Mapping):
        return {_key(key, name): _plain(entry, f"{name}.{key}", depth + 1) for key, entry in value.items()}
    if isinstance(value, (list, tuple)) and type(value) in (list, tuple):
        plain = [_plain(entry, f"{name}[{n}]", depth + 1) for n, entry in enumerate(value)]
        return plain if type(value) is list else tuple(plain)
    raise InputError(
        f"a checkpoint cannot hold {name}, which is {type(value).__name__}; it holds tensors, arrays of numbers, "
        "numbers, texts, lists and dicts"
    )


def _key(key: Any, name: str) -> Any:
    if type(key) is tuple:
        return tuple(_key(part, name) for part in key)
    plain = key.item() if isinstance(key, np.generic) and key.dtype.kind in "biufUS" else key
    if type(plain) not in (int, float, str, bool):
        raise InputError(f"a checkpoint cannot hold {name}, which is a mapping with other keys than texts and numbers")
    return plain
