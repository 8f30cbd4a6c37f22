"""A digest of all that the APIs tell in some plays, which must not depend on Numba."""

import hashlib

import numpy as np

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms

SETTINGS = {"graph": "d", "size": 11, "max_steps": 25, "drop_key": True, "subgoal_horizon": 6}
SHOP = {"task": "workshop:3", "max_steps": 25, "subgoal_horizon": 6}


def trace() -> str:
    digest = hashlib.sha256()

    def record(told) -> None:
        if isinstance(told, dict):
            record([*told.items()])
        elif isinstance(told, (tuple, list)) or (isinstance(told, np.ndarray) and told.dtype == object):
            for one in told:
                record(one)
        elif isinstance(told, np.ndarray):
            digest.update(np.ascontiguousarray(told))
        else:
            digest.update(repr(told).encode())

    rng = np.random.default_rng(0)
    for mask in ("reachable", "existing", "seen", "none"):
        for settings in (SETTINGS, SHOP):
            env = hierroom.raw_env(**settings, goal_mask=mask, reward="novelty")
            env.reset(seed=1)
            for _ in range(60):
                told = env.last()
                record(told)
                env.step(None if told[2] or told[3] else int(rng.integers(-1, 15)))
                if not env.agents:
                    env.reset()
    for settings in ({}, {"flat": True, "autoreset_mode": "NextStep"}, {"meta": "fixed-dfs", "copy": False}):
        envs, one = EscapeRooms(4, **SETTINGS, reward="bonus", **settings), EscapeRoom(**SHOP, meta="fixed-dfs")
        record([envs.reset(seed=2), one.reset(seed=2)])
        for _ in range(60):
            record(envs.step(rng.integers(7, size=4)))
            told = one.step(int(rng.integers(7)))
            record([told, one.reset() if told[3] else None])
    return digest.hexdigest()


if __name__ == "__main__":
    print(trace())
