"""Conversion of NumPy's numbers to Python's, which do not overflow and which files can hold."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


def use_python_numbers(config: Any) -> None:
    """Replace NumPy's numbers and truth values among the entries of a frozen dataclass by Python's."""
    for entry in fields(config):
        if isinstance(value := getattr(config, entry.name), np.generic):
            object.__setattr__(config, entry.name, value.item())
