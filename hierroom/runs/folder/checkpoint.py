"""A checkpoint as bytes: what torch writes, and behind it a line with the SHA-256 digest of all of it.

The digest stands in the same file, so that no crash can part the two. Without it, damage would go unnoticed: torch does
not look at the checksums of its own format.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from typing import Any

import torch

from hierroom.runs.folder.plain_state import plain_state
from hierroom.support.errors import InputError, shown
from hierroom.support.schema import AnyMapping, Anything, Exactly, Real, Schema, Table, Whole
from hierroom.turns.ledger import AGENTS

CHECKPOINT_FORMAT = 11
TABLES = ("metrics", "evaluations", "episodes")
"""The tables that grow with a run."""
_MARK = b"\nsha256 "
_LENGTH = len(_MARK) + 64 + 1  # of the last line: the mark, the digest in hexadecimal digits, a line feed
_ENTRIES: Mapping[str, Schema] = {
    "format": Exactly(CHECKPOINT_FORMAT),
    "config": Anything(),  # `RunFolder.require_same_config` reads it
    "turns": AnyMapping(),
    "levels": AnyMapping(),
    "agents": Table(dict.fromkeys(AGENTS, AnyMapping())),
    "log": AnyMapping(),
    "tables": Table(dict.fromkeys(TABLES, Whole(0, 2**62))),
    "steps": Whole(0, 2**62),
    "seconds": Real(0),
    "compile_seconds": Real(0),
}
"""The outline of a checkpoint, which is checked whenever one is read; what is in it, where it is used."""


def to_bytes(state: Mapping[str, Any]) -> bytes:
    """The content of a checkpoint file.

    Args:
        state: what `Trainer.state_dict` gave, and in ``tables`` how many rows each table of the run has, if any.
    """
    plain = {name: plain_state(entry, name) for name, entry in state.items()}
    buffer = io.BytesIO()
    torch.save({"format": CHECKPOINT_FORMAT, "tables": dict.fromkeys(TABLES, 0), **plain}, buffer)
    content = buffer.getvalue()
    return content + _last_line(content)


class OtherFormatError(InputError):
    """A checkpoint that another version of hierroom wrote, as it did those before it."""


def from_bytes(content: bytes) -> dict[str, Any]:
    """The state in the content of a checkpoint file; no code from it is executed.

    Args:
        content: what `to_bytes` gave.
    """
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
    except Exception as error:  # torch raises many types for what it does not load, RuntimeError among them
        lines = str(error).strip().splitlines() or [type(error).__name__]
        reason = lines[0].split(". ")[0]  # the rest is advice to users of torch
        raise InputError(f"cannot be read: {reason}") from error
    found = state.get("format") if isinstance(state, dict) else None
    if type(found) is not int or found != CHECKPOINT_FORMAT:
        raise OtherFormatError(f"has format {shown(found)}, this hierroom reads {CHECKPOINT_FORMAT}")
    try:
        Table(_ENTRIES).check(state, "its state")
    except InputError as error:
        raise InputError(f"cannot be used: {error}") from error
    return state


def _last_line(content: bytes) -> bytes:
    return _MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"
