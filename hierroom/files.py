"""Writing files atomically, and JSON without infinities and NaNs."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hierroom.errors import InputError


def write_atomically(path: str | Path, content: bytes) -> None:
    """Write a file so that it always holds either the old content or the new one, even after a crash.

    Args:
        path: the file; its folder must exist.
        content: the new content.

    Raises:
        InputError: if the file cannot be written; the old content is still there.
    """
    path = Path(path)
    unfinished = path.with_name(path.name + ".part")
    try:
        with unfinished.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise InputError(f"cannot write {path}: {error.strerror}") from error


def to_json(value: Any) -> str:
    """Plain types as JSON text; infinities and NaNs, which JSON cannot represent, become null.

    A named tuple becomes an object with its names, so that nobody has to know the order of its entries.
    """

    def finite(value: Any) -> Any:
        value = getattr(value, "_asdict", lambda: value)()
        if isinstance(value, Mapping):
            return {name: finite(entry) for name, entry in value.items()}
        if isinstance(value, (list, tuple)):
            return [finite(entry) for entry in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return json.dumps(finite(value), indent=2, allow_nan=False)
