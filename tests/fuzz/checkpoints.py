"""Fuzzing of checkpoints: damaged files never load; crafted states with a valid digest do no harm.

``python -m tests.fuzz.checkpoints --count 5000`` tries so many of either kind on each run below. Set
``NUMBA_BOUNDSCHECK=1`` and a ``NUMBA_CACHE_DIR`` of its own, and an index out of range is an error, not a silent one.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import torch

from hierroom.agents.config import AgentsConfig
from hierroom.learners.config import PPOConfig
from hierroom.runs.config.config import TrainConfig
from hierroom.runs.folder.checkpoint import from_bytes, to_bytes
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError
from hierroom.worlds.env_config import EnvConfig

_SMALL = {"sequence_length": 4, "minibatches": 2, "epochs": 1, "hidden_size": 4}
_ENV = EnvConfig("a", size=11, max_steps=30)


def _config(agents: AgentsConfig, env: EnvConfig = _ENV) -> TrainConfig:
    learner = PPOConfig(**_SMALL)
    return TrainConfig(env, agents, num_envs=4, steps=100_000, ppo=learner, meta_ppo=learner, evaluation_episodes=2)


CONFIGS = {
    "hippo": _config(AgentsConfig()),
    "drops keys": _config(AgentsConfig(), EnvConfig("b", size=11, max_steps=30, drop_key=True, subgoal_horizon=6)),
    "learned": _config(AgentsConfig(meta="learned", meta_start_success=0.0)),
    "warms up": _config(AgentsConfig(meta="learned")),
    "curious": _config(AgentsConfig(method="ppo-rnd", features=("direction", "keys"))),
    "curriculum": _config(AgentsConfig(method="ppo-novelty"), EnvConfig("rooms:3", curriculum_stages=2, size=11)),
}
"""Small runs that together save every kind of state there is."""

NUMBERS = (-1, 0, 1, 2, 3, 5, 6, 7, 12, 13, 14, 22, 63, 64, 127, 128, 255, 256, 10**7, 2**31 - 1, 2**31, 2**63 - 1)
NUMBERS += (-2, -5, -128, -(2**31), -(2**63), 2**64, 10**5000, 0.5, -0.0, 1e-320, 1e308, float("nan"), float("inf"))
OTHERS = (None, True, False, "", "x", b"", [], {}, (), [[]], {"x": 1}, {1: 2, "x": 3}, *map(torch.zeros, (0, (2, 2))))
DTYPES = (torch.bool, torch.uint8, torch.int8, torch.int32, torch.int64, torch.float32, torch.float64, torch.complex64)


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Return a damaged checkpoint file: flipped bits, a block of zeros or random bytes, a cut or a repetition."""
    changed, place = bytearray(content), rng.randrange(len(content))
    length = min(rng.choice((1, 16, 512, 4096)), len(content) - place)
    kind = rng.randrange(6)
    if kind == 0:
        for _ in range(rng.choice((1, 1, 1, 2, 8))):
            changed[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    elif kind == 1:
        changed[place : place + length] = bytes(length)
    elif kind == 2:
        changed[place : place + length] = rng.randbytes(length)
    elif kind == 3:
        del changed[place:]
    elif kind == 4:
        del changed[place : place + length]
    else:
        changed[place:place] = changed[place : place + length]
    return bytes(changed)


def crafted(state: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """Return a state with one to three entries changed, anywhere in it."""
    state = deepcopy(state)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_places(state))
        holder, key = rng.choice(places[1:])
        kind = rng.randrange(12)
        if kind == 0 and isinstance(holder, dict):
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[rng.choice((f"{key}?", 7, ("x", 1)))] = holder.pop(key)
        elif kind == 2:
            other_holder, other_key = rng.choice(places)
            holder[key], other_holder[other_key] = deepcopy(other_holder[other_key]), deepcopy(holder[key])
        elif kind == 3:
            holder[key] = rng.choice((*OTHERS, *NUMBERS))
        else:
            holder[key] = _changed(holder[key], rng)
    return state


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield all entries of nested dicts and lists, as (holder, key)."""
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, entry in entries:
        yield value, key
        if isinstance(entry, (dict, list)):
            yield from _places(entry)


def _changed(value: Any, rng: random.Random) -> Any:
    if isinstance(value, torch.Tensor) and value.numel():
        return _changed_tensor(value.clone(), rng)
    if isinstance(value, list) and value:
        return rng.choice((value[:-1], value + value[:1], value[::-1], [*value[:-1], _changed(value[-1], rng)]))
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return rng.choice((value + 1, value - 1, -value, 2 * value, *NUMBERS))
    return rng.choice((*OTHERS, *NUMBERS))


def _changed_tensor(tensor: torch.Tensor, rng: random.Random) -> torch.Tensor:
    """Return a tensor with one or all numbers changed, or of another dtype, shape, layout or memory."""
    flat, place = tensor.view(-1), rng.randrange(tensor.numel())
    numbers = flat.numpy()  # the same memory; torch lacks much for unsigned numbers
    kind = rng.randrange(12)
    if kind == 0:
        return tensor.to(rng.choice(DTYPES))
    if kind == 1:
        return (
            rng.choice((tensor[:-1], tensor[None], flat, torch.cat([tensor, tensor]))) if tensor.dim() else tensor[None]
        )
    if kind == 2:
        sparse = tensor.to_sparse() if tensor.dtype is not torch.uint64 else tensor.to("meta")
        spread = flat[:1].expand(tensor.shape) if tensor.dim() else tensor[None]
        return rng.choice((spread, sparse, tensor.to("meta")))
    if kind == 3:
        return torch.from_numpy(np.random.default_rng(place).permutation(numbers)).view(tensor.shape)
    if kind == 4 and tensor.dtype == torch.bool:
        tensor.view(torch.uint8).fill_(rng.choice((2, 254, 255)))
        return tensor
    if tensor.dtype == torch.bool:
        numbers[place] = not numbers[place]
        return tensor
    number = rng.choice((*NUMBERS, numbers[place].item() + 1, numbers[place].item() - 1))
    if tensor.dtype.is_floating_point:
        number = float(number) if abs(number) < 1e300 else float("inf")
    else:
        info = torch.iinfo(tensor.dtype)
        number = int(min(max(number, info.min), info.max)) if number == number else info.max  # not: not a number
    if kind == 5:
        numbers.fill(number)
    else:
        numbers[place] = number
    return tensor


def trained_state(config: TrainConfig, updates: int = 6) -> dict[str, Any]:
    """Return the state that a run saves after some updates."""
    trainer = Trainer(config)
    for _ in range(updates):
        trainer.advance()
    return trainer.state_dict()


def try_damaged(content: bytes, count: int, seed: int) -> int:
    """Read damaged files, each another than the right one; returns how many were refused."""
    rng, refused = random.Random(seed), 0
    for n in range(count):
        while (given := damaged(content, rng)) == content:
            pass  # such as zeros over zeros
        try:
            from_bytes(given)
        except InputError as error:
            _check_is_one_line(error)
            refused += 1
        else:
            raise AssertionError(f"damaged file {n} of seed {seed} was read")
    return refused


def try_crafted(config: TrainConfig, state: dict[str, Any], count: int, seed: int) -> int:
    """Load crafted states, go on training from those that load, and evaluate; returns how many loaded.

    Whatever is not refused in one line (`InputError`), and does not end as a training that diverges, fails here.
    """
    rng, loaded = random.Random(seed), 0
    trainer = Trainer(config)
    for n in range(count):
        given = crafted(state, rng)
        try:
            try:
                trainer.load_state_dict(from_bytes(to_bytes(given)))
                loaded += 1
                trainer.advance()
                if loaded % 10 == 0:
                    trainer.evaluate()
                to_bytes(trainer.state_dict())
            except InputError as error:
                _check_is_one_line(error)
            except FloatingPointError:
                pass
        except Exception as error:
            raise AssertionError(f"crafted state {n} of seed {seed} ends in {error!r}") from error
    return loaded


def _check_is_one_line(error: InputError) -> None:
    if "\n" in str(error):
        raise AssertionError(f"not one line: {error}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=5000, help="files and states of each run")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--run", choices=CONFIGS, nargs="*", default=list(CONFIGS))
    options = parser.parse_args()
    for name in options.run:
        state = trained_state(CONFIGS[name])
        n_damaged = try_damaged(to_bytes(state), options.count, options.seed)
        loaded = try_crafted(CONFIGS[name], state, options.count, options.seed)
        print(f"{name}: {n_damaged} damaged files refused; {options.count} crafted states: {loaded} loaded and trained")


if __name__ == "__main__":
    main()
