"""The legal actions of a task's environments: where these say them, and how to read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Space
from numpy.typing import NDArray

from hierroom.support.errors import InputError, shown

USUAL = {"info": "action_mask", "observation": "action_mask", "method": "action_masks"}
"""The names by which masks are found."""
Entries = dict[str, tuple[tuple[Any, ...], Space]]
"""Of an observation, by name: the path of keys to each, and its space."""


class MaskPlace(NamedTuple):
    """Find and read the legal actions of environments: an entry of the info or the observation, or a method."""

    kind: str
    name: str
    n_actions: int

    def read(self, env: Any, observation: Any, info: Mapping[str, Any], task: str, *n: int) -> NDArray[np.bool_]:
        """Return whether each action is legal now: [A], or in a vector of ``n`` environments [n, A]."""
        try:
            if self.kind == "method":
                method = _method(env, self.name)
                given = env.unwrapped.call(self.name) if method is None else method()
            else:
                given = (info if self.kind == "info" else observation)[self.name]
        except KeyError:
            raise InputError(f"the {self.kind} of {task} lacks {self.name!r} now, which it had at first") from None
        try:
            mask = np.asarray(given)
            if n and mask.dtype == object:  # vectors of Gymnasium stack arrays but not lists
                mask = np.array([[0] * self.n_actions if row is None else row for row in mask])
        except ValueError:  # rows of unequal lengths
            mask = np.array(None)
        are_flags = mask.dtype.kind == "b" or (mask.dtype.kind in "iuf" and ((mask == 0) | (mask == 1)).all())
        if mask.shape != (*n, self.n_actions) or not are_flags:
            for_each = f" for each of {n[0]} environments" if n else ""
            what = f"{self.n_actions} flags, one an action{for_each}"
            raise InputError(f"{self.name} of {task} must be {what}, not {shown(given)}")
        return mask.astype(bool)

    def left_out_of(self, entries: Entries) -> Entries:
        """Return the observation's entries, paths and spaces by name, without the mask."""
        return {name: one for name, one in entries.items() if self.kind != "observation" or one[0] != (self.name,)}


def all_forbidden(task: str) -> str:
    """Return the error of a mask that leaves a task no action."""
    return f"{task} forbids every action: its mask is all False before the end"


def find_mask(
    named: str | None, n_actions: int, env: Any, observation: Any, info: Mapping[str, Any], task: str
) -> MaskPlace | None:
    """Return where an environment has its mask, or None: it is not asked for, or the actions are no single numbers.

    Args:
        named: the name of the entry or method; None: one of the usual names; empty: there is none.
        n_actions: number of actions; 0 if they are arrays, which have no mask.
        env: the environment, or a vector of them.
        observation: its observation after a reset.
        info: its info after a reset.
        task: the name of the task, for errors.
    """
    if named == "" or (named is None and not n_actions):
        return None
    if not n_actions:
        raise InputError(f"a mask is for Discrete actions, and those of {task} are arrays; leave out action_mask")
    names = USUAL if named is None else dict.fromkeys(USUAL, named)
    has = {
        "info": names["info"] in info,
        "observation": isinstance(observation, Mapping) and names["observation"] in observation,
        "method": _has_method(env, names["method"]),
    }
    for kind, is_there in has.items():
        if is_there:
            return MaskPlace(kind, names[kind], n_actions)
    if named is not None:
        raise InputError(f"{task} has no mask {named!r}, in its info, as an entry of its observation or as a method")
    return None


def refuse_late_mask(named: str | None, n_actions: int, info: Mapping[str, Any], task: str) -> None:
    """Refuse a mask in the info of a step where `find_mask` found none after a reset."""
    if named is None and n_actions and (name := USUAL["info"]) in info:
        rule = "give it in both, or leave it out by action_mask='' of the task"
        raise InputError(f"the info of {task} has {name!r} after a step but not after a reset; {rule}")


def _has_method(env: Any, name: str) -> bool:
    """Return whether an environment has a method, or each environment of a vector that makes them by functions."""
    if _method(env, name) is None and (makers := getattr(env.unwrapped, "env_fns", None)):
        env = makers[0]()
        env.close()
    return _method(env, name) is not None


def _method(env: Any, name: str) -> Any:
    while env is not None:
        if callable(found := getattr(env, name, None)):
            return found
        env = vars(env).get("env")
    return None
