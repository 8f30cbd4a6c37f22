"""Values as plain types, to compare them with what they were before."""

from dataclasses import fields, is_dataclass

import numpy as np


def plain(value):
    """Return arrays as lists, dataclasses as dicts by field, and the values in lists and dicts likewise."""
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray) and value.dtype.names:  # its records have bytes between their entries
        return {name: plain(value[name]) for name in value.dtype.names}
    return plain(value.tolist()) if isinstance(value, np.ndarray) else value
