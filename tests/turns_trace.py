"""A digest of all that the APIs return in some episodes, which must not depend on Numba."""

import hashlib

import numpy as np

import hierroom
from hierroom.gym_env import EscapeRoom
from hierroom.vector_env import EscapeRooms

SETTINGS = {"graph": "d", "size": 11, "max_steps": 25, "drop_key": True}
SHOP = {"task": "workshop:3", "max_steps": 25, "subgoal_horizon": 6}


def trace() -> str:
    digest = hashlib.sha256()

    def record(observed) -> None:
        if isinstance(observed, dict):
            record([*observed.items()])
        elif isinstance(observed, (tuple, list)) or (isinstance(observed, np.ndarray) and observed.dtype == object):
            for one in observed:
                record(one)
        elif isinstance(observed, np.ndarray):
            digest.update(np.ascontiguousarray(observed))
        else:
            digest.update(repr(observed).encode())

    rng = np.random.default_rng(0)
    for mask in ("reachable", "existing", "seen", "none"):
        for settings in (SETTINGS | {"subgoal_horizon": 6, "reward": "novelty"}, SHOP):
            env = hierroom.raw_env(**settings, goal_mask=mask)
            env.reset(seed=1)
            for _ in range(60):
                observed = env.last()
                record(observed)
                env.step(None if observed[2] or observed[3] else int(rng.integers(-1, 15)))
                if not env.agents:
                    env.reset()
    for settings in ({}, {"autoreset_mode": "NextStep"}, {"meta": "fixed-dfs", "subgoal_horizon": 6, "copy": False}):
        envs, one = EscapeRooms(4, **SETTINGS, reward="bonus", **settings), EscapeRoom(**SHOP, meta="fixed-dfs")
        record([envs.reset(seed=2), one.reset(seed=2)])
        for _ in range(60):
            record(envs.step(rng.integers(7, size=4)))
            observed = one.step(int(rng.integers(7)))
            record([observed, one.reset() if observed[3] else None])
    return digest.hexdigest()


if __name__ == "__main__":
    print(trace())
