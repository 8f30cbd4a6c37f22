"""The observation space of a task: its entries by flat names, and how a network reads each."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from operator import itemgetter
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hierroom.support.byte_array import ByteArray
from hierroom.support.errors import InputError, in_one_line, shown, text_of
from hierroom.worlds.world import Feature

RESERVED = (
    *("goal", "action_mask", "outcome", "features", "choice"),
    *("symbol", "previous-action", "goal-status", "goal-outcome"),
)
"""Entries of an agent's observation that do not come from the world, and features that are no entries."""
MAX_SYMBOL_SIDE = 31
"""Images of bytes up to this side may be grids of symbols, like MiniGrid's; larger ones are pixels."""
MAX_SYMBOLS = 2**14
"""Images with more bytes are pixels, too: a symbol takes 64 bytes of memory in each turn of a minibatch."""
_LEAST_SYMBOLS, _MOST_SYMBOLS, _LAST_SYMBOL = 16, 32, 127
"""Symbols seen in a trial have at most so many values, up to this one: letters have, but not grey or colours."""
MAX_CATEGORIES = 256
MAX_NUMBERS = 2**22
"""Most numbers of an entry that a network reads: each has a place in lists that are made before the network."""
_KNOWN = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)


def flat_entries(space: spaces.Space) -> tuple[dict[str, tuple[tuple[Any, ...], spaces.Space]], list[str]]:
    """Return the entries of an observation space by name: the path of keys to each, and its space.

    A single array is named ``observation``. Entries of dicts and tuples keep their names; nested ones are joined by
    ``_``. Entries that no network reads, such as texts and empty arrays, are left out; their names are returned too.
    """
    entries, left_out = {}, []
    for path, part in _leaves(space, ()):
        name = "_".join(map(str, path)) or "observation"
        if not isinstance(part, _KNOWN) or 0 in (part.shape or ()):
            left_out.append(name)
            continue
        while name in RESERVED or name in entries:
            name = f"observation_{name}"
        entries[name] = path, part
    if not entries:
        raise InputError(
            f"a task's observations are Box, Discrete, MultiDiscrete or MultiBinary, or dicts, not {space}"
        )
    return entries, left_out


def _leaves(space: spaces.Space, path: tuple[Any, ...]) -> Iterator[tuple[tuple[Any, ...], spaces.Space]]:
    if isinstance(space, spaces.Dict):
        for name, part in space.items():
            yield from _leaves(part, (*path, name))
    elif isinstance(space, spaces.Tuple):
        for n, part in enumerate(space):
            yield from _leaves(part, (*path, n))
    else:
        yield path, space


def entry_of(observation: Any, path: tuple[Any, ...]) -> Any:
    """Return the entry of an observation at a path of keys."""
    for key in path:
        observation = observation[key]
    return observation


def read_entry(
    observations: Sequence[Any], name: str, path: tuple[Any, ...], space: spaces.Space, task: str
) -> NDArray[Any]:
    """Return an entry of M observations as an array [M, ...] of its space's type; refuse one outside the space.

    Floats may be outside the bounds of a `Box`, because many environments exceed them.
    """
    try:
        parts = observations
        for key in path:
            parts = [*map(itemgetter(key), parts)]
        values = np.array(parts)
    except Exception:  # an entry is missing, or NumPy makes no array of them
        values = np.array(None)
    return _checked(values, len(observations), name, space, task, lambda: _unlike(observations, path, space))


def read_batch(batch: Any, n: int, name: str, path: tuple[Any, ...], space: spaces.Space, task: str) -> NDArray[Any]:
    """Return an entry of the observations of n environments as `read_entry` does; they come as one batch of arrays."""
    try:
        values = np.asarray(entry_of(batch, path))
    except Exception:
        values = np.array(None)

    def describe() -> str:
        given = f"an array of {values.dtype} and shape {values.shape}"
        return f"{given} for {n} environments, each with {text_of(space)}"

    return _checked(values, n, name, space, task, describe)


def _checked(
    values: NDArray, n: int, name: str, space: spaces.Space, task: str, describe: Callable[[], str]
) -> NDArray[Any]:
    if values.shape != (n, *(space.shape or ())) or values.dtype.kind not in "biuf":
        raise InputError(f"{task} shows {name!r} outside its observation space: {describe()}")
    dtype: Any = space.dtype
    if dtype.kind != "f" and (outside := _first_outside(space, values)) is not None:
        raise InputError(f"{task} shows {name!r} outside its observation space: {outside} in {text_of(space)}")
    read = values if values.dtype == dtype else _cast(values, dtype)
    if dtype.kind == "f":
        are_finite = np.isfinite(read if dtype == np.float32 else _cast(read, np.float32))
        if np.count_nonzero(are_finite) < are_finite.size:
            most = min(np.finfo(dtype).max, np.finfo(np.float32).max)
            wrong = f"{name!r} with {values[~are_finite][0]}"
            raise InputError(f"{task} shows {wrong}; a network reads finite numbers up to {most:.4g}")
    return read


def _cast(values: NDArray, dtype: Any) -> NDArray:
    with np.errstate(over="ignore"):
        return values.astype(dtype)


def _unlike(observations: Sequence[Any], path: tuple[Any, ...], space: spaces.Space) -> str:
    """Describe the first observation with an entry that is no array of numbers in the shape of its space."""
    for one in observations:
        try:
            entry = entry_of(one, path)
            array = np.array(entry)
        except Exception as error:
            return f"{in_one_line(error)} in {text_of(space)}"
        if array.shape != space.shape or array.dtype.kind not in "biuf":
            given = f"an array of {array.dtype} and shape {array.shape}"
            return f"{shown(entry) if array.dtype == object else given} in {text_of(space)}"
    return f"arrays of different kinds in {text_of(space)}"


def is_byte_image(space: spaces.Space) -> bool:
    """Return whether an entry is an image of bytes, which may be pixels or symbols."""
    return isinstance(space, spaces.Box) and space.dtype == np.uint8 and len(space.shape) in (2, 3)


def are_symbols(space: spaces.Space, values: Collection[int]) -> bool:
    """Return whether an image of bytes is a grid of symbols, as its size and the values seen in a trial say."""
    return _is_small(_image_shape(space.shape or ())) and len(values) <= _MOST_SYMBOLS and max(values) <= _LAST_SYMBOL


def n_symbols(values: Collection[int]) -> int:
    """Return how many symbols to tell apart, given those seen in a trial: there may be twice as many."""
    return min(256, max(_LEAST_SYMBOLS, 2 ** (2 * max(values)).bit_length()))


def _is_small(shape: tuple[int, int, int]) -> bool:
    return max(shape[:2]) <= MAX_SYMBOL_SIDE and math.prod(shape) <= MAX_SYMBOLS


def feature_of(name: str, space: spaces.Space, n_symbols: int = 0, is_guess: bool = False) -> Feature:
    """Return the feature that reads an entry of the observation.

    An image with ``n_symbols`` is a grid of them; ``is_guess`` says that no user has named it.
    """
    if (n := math.prod(space.shape or ())) > MAX_NUMBERS:
        raise InputError(f"a network reads up to {MAX_NUMBERS:,} numbers of an entry; {name} has {n:,}")
    if isinstance(space, spaces.Box):
        layout = _layout(space, n_symbols, is_guess)
        return Feature(
            (MAX_CATEGORIES,) * layout.n_bytes,
            lambda o: layout.to_bytes(_channels_last(o.view.entries[name], layout)),
            array=layout,
        )
    starts, sizes = (each.ravel() for each in _categories(space))

    def numbers(observation: Any) -> NDArray:
        values = observation.view.entries[name]
        return values.reshape(len(values), -1) - starts

    if sizes.max() <= MAX_CATEGORIES:
        return Feature(tuple(sizes.tolist()), numbers)
    if sizes.max() > 2**31:
        raise InputError(f"a network reads discrete numbers of up to 2**31 values; {name} has {sizes.max():,}")
    layout = ByteArray((len(sizes),), "ids", n_values=int(sizes.max()))
    return Feature((MAX_CATEGORIES,) * layout.n_bytes, lambda o: layout.to_bytes(numbers(o)), array=layout)


def _first_outside(space: spaces.Space, values: NDArray) -> Any:
    """Return the first of values [M, ...] that is outside a space of whole numbers or flags or its dtype, or None."""
    if isinstance(space, spaces.Box):
        if values.dtype == space.dtype:
            return None
        low, end = (0, 2) if space.dtype == bool else (np.iinfo(space.dtype).min, np.iinfo(space.dtype).max + 1)
    elif isinstance(space, spaces.Discrete):
        low, end = int(space.start), int(space.start) + int(space.n)  # faster than arrays of one number
    else:
        low, sizes = _categories(space)
        end = low + sizes
    is_outside = (values < low) | (values >= end)  # `end` is exact as a float where the largest number is not
    if values.dtype.kind == "f":
        is_outside |= values != np.floor(values)  # NaN, too
    return values[is_outside][0] if is_outside.any() else None


def _categories(space: spaces.Space) -> tuple[NDArray, NDArray]:
    if isinstance(space, spaces.Discrete):
        return np.array([int(space.start)]), np.array([int(space.n)])
    if isinstance(space, spaces.MultiDiscrete):  # in int64, as bytes and such would overflow at their sums
        return np.asarray(space.start, np.int64), np.asarray(space.nvec, np.int64)
    assert isinstance(space, spaces.MultiBinary)
    return np.zeros(space.shape, np.int64), np.full(space.shape, 2)


def _layout(space: spaces.Box, n_symbols: int, is_guess: bool) -> ByteArray:
    shape, low, high = space.shape, float(space.low.min()), float(space.high.max())
    if is_byte_image(space):
        image, kind = _image_shape(shape), "symbols" if n_symbols else "pixels"
        return ByteArray(image, kind, 0, 255, n_symbols or 256, were_symbols=is_guess and _is_small(image))
    if len(shape) == 3:
        return ByteArray(_image_shape(shape), "pixels", low, high)
    bounds = space.low.ravel().tolist(), space.high.ravel().tolist()
    return ByteArray(tuple(shape), "numbers", low, high, bounds=bounds)


def _image_shape(shape: tuple[int, ...]) -> tuple[int, int, int]:
    if len(shape) == 2:
        return shape[0], shape[1], 1
    is_first = shape[0] < min(shape[1:])
    return (shape[1], shape[2], shape[0]) if is_first else (shape[0], shape[1], shape[2])


def _channels_last(values: NDArray, layout: ByteArray) -> NDArray:
    is_first = values.ndim == 4 and layout.kind != "numbers" and values.shape[1:] != layout.shape
    return np.moveaxis(values, 1, -1) if is_first else values
