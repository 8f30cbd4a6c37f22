"""Fuzzing of the environments' APIs: wrong arguments, seeds, options and actions end in one line, or in play.

``python -m tests.fuzz.apis --examples 2000`` tries so many on every API; the seed fixes them.
"""

from __future__ import annotations

import argparse
import inspect
import math
import os
import random
import traceback
import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from pettingzoo import AECEnv, ParallelEnv
from rich.progress import track

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.support.errors import InputError
from hierroom.vector_env import EscapeRooms
from hierroom.worlds.env_config import EnvConfig

ID = "hierroom/EscapeRoom-v0"
NATIVE = {
    "env": hierroom.env,
    "raw_env": hierroom.raw_env,
    "parallel_env": hierroom.parallel_env,
    "EscapeRoom": EscapeRoom,
    "EscapeRooms": EscapeRooms,
}
"""The APIs by their own names."""
APIS = {**NATIVE, "gymnasium.make": partial(gymnasium.make, ID), "gymnasium.make_vec": partial(gymnasium.make_vec, ID)}
"""The APIs, and what Gymnasium makes of them."""
SIGNATURES = {"gymnasium.make": EscapeRoom, "gymnasium.make_vec": EscapeRooms}
"""Functions that get their arguments by way of Gymnasium."""
OF_RESULTS = ("env_reset_passive_checker", "env_step_passive_checker", "env_render_passive_checker")
"""Gymnasium's functions that check what an environment returns."""

THINGS = (
    *(None, True, False, 0, 1, 2, 5, 6, 13, 14, -1, 7.5, 0.0, -0.0, math.nan, math.inf, 1e300, 2**31, 2**62, 2**63 - 1),
    *(2**63, 10**30, -(2**63) - 1, 10**5000, 1j, "", "a", "x", "rooms:3", "two\nlines", "[/b]", "9" * 5000, "\udcff"),
    *(b"a", [], (), {}, set(), [1], ["a", None], [[0]], {"a": 1}, {"reset_mask": 1}, object(), int),
    *(range(3), np.int8(3), np.uint64(2**64 - 1), np.float64(0.5), np.str_("a")),
    *(np.zeros(0), np.zeros(1), np.zeros(2, np.int64), np.ones(2, bool), np.zeros((2, 7, 7, 3)), np.array(3)),
    *(np.array("a"), np.array([None, 1]), np.array(math.nan), np.ma.masked, {"reset_mask": np.ones(2, bool)}),
    *({"key_rooms": [0], "exit_room": 1}, {"key_rooms": [5], "exit_room": 1}, "training", "extrinsic", "none", "seen"),
    *("ansi", "rgb_array", "oracle", "random", "fixed-dfs", "nowhere:X", "c.toml", "/", ".", 11, 19, 63),
)
"""Values given in the place of right arguments."""
N_ENVS = 2


def problems(name: str, count: int, seed: int) -> Iterator[tuple[str, str | None]]:
    """Yield each try on an API with its fault, or None."""
    rng = random.Random(f"{seed} {name}")
    signature = inspect.signature(SIGNATURES.get(name, APIS[name])).parameters
    parameters = [p for p in {**vars(EnvConfig()), **signature} if p not in ("num_envs", "entries")]
    right = {"graph": "a", "size": 11, "max_steps": 5}
    if name in ("EscapeRooms", "gymnasium.make_vec"):
        right["num_envs"] = N_ENVS
    for _ in range(count):
        arguments = {**right, **{rng.choice(parameters): rng.choice(THINGS) for _ in range(rng.choice((0, 1, 1, 2)))}}
        if rng.random() < 0.05:
            arguments[rng.choice(("num_envs", "pay", "self", "room_index"))] = rng.choice((0, -1, True, 1.5, "2", None))
        calls: list[Any] = [arguments]
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                _play(APIS[name](**arguments), calls, rng)
            problem = None
        except InputError as error:
            said = str(error)
            problem = None if said.isprintable() and len(said) < 1100 else f"not one line: {said!r:.3000}"
        except Exception as error:
            problem = traceback.format_exc() if _is_ours(error) else None
        yield f"{name}: {_described(calls)}", problem


def _is_ours(error: Exception) -> bool:
    """Check that an error went through our code or is about its results, not only about the library's own checks.

    What a wrapper refuses without asking the environment, such as an action outside of its space, goes through no code
    of ours; Gymnasium's checkers raise in their own code, too, but after the environment's.
    """
    ours = str(Path(hierroom.__file__).parent)
    frames = traceback.extract_tb(error.__traceback__)
    return any(frame.filename.startswith(ours) or frame.name in OF_RESULTS for frame in frames)


def _described(calls: list[Any]) -> str:
    try:
        return f"{calls!r:.1500}"
    except ValueError:  # Python writes no number of thousands of digits
        return "a huge number"


def _play(env: Any, calls: list[Any], rng: random.Random) -> None:
    """Reset and step with now and then a wrong argument, which is noted in ``calls``."""
    n_envs = getattr(env, "num_envs", None)
    for _ in range(rng.randrange(1, 12)):
        wrong = rng.choice(THINGS)
        kind = rng.randrange(12)
        calls.append((kind, wrong))
        if kind == 0 or len(calls) == 2:
            env.reset(**rng.choice(({}, {"seed": 1}, {"seed": wrong}, {"seed": 1, "options": wrong})))
        elif isinstance(env, AECEnv):
            if env.agents:
                has_ended = env.terminations[env.agent_selection] or env.truncations[env.agent_selection]
                env.step(None if has_ended else wrong if kind < 3 else rng.randrange(5))
        elif isinstance(env, ParallelEnv):
            env.step(wrong if kind == 1 else {"meta_0": wrong if kind == 2 else 13, "controller_0": rng.randrange(5)})
        else:
            right = rng.randrange(5) if n_envs is None else [rng.randrange(5) for _ in range(n_envs)]
            env.step(wrong if kind < 3 else right)
        if kind == 11:
            env.render()
    env.close()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=500, help="wrong uses of each API")
    parser.add_argument("--seed", type=int, default=0, help="fixes them")
    options = parser.parse_args()
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    n_wrong = 0
    for name in APIS:
        tries = problems(name, options.examples, options.seed)
        for tried, problem in track(tries, f"{name:<18}", options.examples):
            if problem is not None:
                n_wrong += 1
                print(f"\n{tried}\n{problem[-2000:]}", flush=True)
    print(f"{options.examples} wrong uses of each of {len(APIS)} APIs (seed {options.seed}): {n_wrong} ended otherwise")
    return int(n_wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
