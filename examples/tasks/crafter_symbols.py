"""Crafter by symbols: its 22 achievements are the goals, and its own ``data.yaml`` says what each one needs.

    pip install crafter numba
    cd examples/tasks
    python -m hierroom train --task crafter_symbols:crafter --meta fixed-dfs --steps 30_000

Then all of 3 evaluated episodes unlock wake_up, 2 place_plant and 1 place_table: a score of 1.5%, in training 2.3%.
"""

import gymnasium
import numpy as np
from crafter import Env, constants
from gymnasium.spaces import Box, Dict, Discrete

import hierroom


class Symbols(Env):
    """Crafter with kinds and counts in place of its picture, which shows 9 x 7 cells."""

    def _obs(self):
        col, row = self._player.pos
        view = np.pad(self._sem_view(), 4)[col : col + 9, row + 1 : row + 8, None].astype(np.uint8)  # 0 is outside
        state = [*self._player.inventory.values(), *self._player.facing, self._player.sleeping, self._world.daylight]
        return {"view": view, "state": np.array(state, np.float32)}

    def _balance_chunk(self, chunk, objs):  # a set, whose order differs from process to process
        super()._balance_chunk(chunk, sorted(objs, key=self._world.objects.index))


class Crafter(gymnasium.Env):
    """Crafter in Gymnasium's form."""

    action_space = Discrete(len(constants.actions))
    observation_space = Dict(view=Box(0, 31, (9, 7, 1), np.uint8), state=Box(-1, 9, (20,), np.float32))

    def __init__(self):
        self.game = Symbols()

    def reset(self, *, seed=None, options=None):
        """Begin a new world: as in a new game with this seed, which would read its 56 pictures again."""
        super().reset(seed=seed)
        self.game._seed, self.game._episode = int(self.np_random.integers(2**31)), 0
        return self.game.reset(), {"achievements": self.game._player.achievements.copy()}

    def step(self, action):
        """Act; an episode terminates where the player dies."""
        observation, reward, done, info = self.game.step(action)
        died = info["discount"] == 0
        return observation, float(reward), died, bool(done and not died), info


def rules():
    """Return the achievements that each achievement needs, and whose items it uses."""
    rules = {name: {} for name in constants.achievements}
    for how in constants.collect.values():
        (item,) = how["receive"]
        rules[f"collect_{item}"] = {"needs": [f"make_{tool}" for tool in how["require"]]}
    for kind in ("place", "make"):
        for thing, how in getattr(constants, kind).items():
            uses = {f"collect_{item}": n for item, n in how["uses"].items()}
            rules[f"{kind}_{thing}"] = {"needs": [f"place_{near}" for near in how.get("nearby", ())], "uses": uses}
    return {**rules, "eat_plant": {"needs": "place_plant"}}


crafter = hierroom.Task(
    make=Crafter,
    goals={name: lambda env, info, name=name: info["achievements"][name] for name in constants.achievements},
    rules=rules(),
    capacity={"collect_wood": 2, "collect_stone": 4},  # as many as some rule asks for
    symbols=["view"],
    label="Crafter",
)
