"""An environment with the public interface of HierarchyCraft: a raft is built of wood, and sails from the shore."""

from collections import Counter
from dataclasses import dataclass, field
from enum import Enum
from types import SimpleNamespace
from typing import NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces

Owner = Enum("Owner", {"PLAYER": "player", "CURRENT": "current_zone", "DESTINATION": "destination", "ZONES": "zones"})
Operation = Enum("Operation", {"MIN": "min", "MAX": "max", "REMOVE": "remove", "ADD": "add"})


class Zone(NamedTuple):
    name: str


class Item(NamedTuple):
    name: str


class Stack(NamedTuple):
    item: Item
    quantity: int = 1


@dataclass
class Transformation:
    name: str
    zone: Zone | None = None
    destination: Zone | None = None
    inventory_changes: dict = field(default_factory=dict)

    def stacks(self, operation, zone):
        """Yield for each place (None: the player) the stacks of an operation."""
        places = {Owner.PLAYER: None, Owner.CURRENT: zone, Owner.DESTINATION: self.destination}
        for owner, operations in self.inventory_changes.items():
            some = operations.get(operation, ())
            by_place = some or {} if owner is Owner.ZONES else {places[owner]: some}
            for place, stacks in by_place.items():
                yield from ((place, stack) for stack in stacks)


SHORE, FOREST, ISLAND = map(Zone, ("shore", "forest", "island"))
WOOD, AXE, RAFT, FLAG = map(Item, ("wood", "axe", "raft", "flag"))
WORLD = SimpleNamespace(
    zones=[SHORE, FOREST, ISLAND],
    start_zone=SHORE,
    start_items=[Stack(AXE)],
    start_zones_items={ISLAND: [Stack(FLAG)]},
    transformations=[
        Transformation("to-forest", SHORE, FOREST),
        Transformation("to-shore", FOREST, SHORE),
        Transformation(
            "chop",
            FOREST,
            inventory_changes={
                Owner.PLAYER: {
                    Operation.MIN: [Stack(AXE)],
                    Operation.MAX: [Stack(WOOD, 1)],
                    Operation.ADD: [Stack(WOOD, 2)],
                }
            },
        ),
        Transformation(
            "build",
            inventory_changes={
                Owner.PLAYER: {Operation.MIN: [Stack(WOOD, 2)], Operation.REMOVE: [Stack(WOOD, 2)]},
                Owner.CURRENT: {Operation.ADD: [Stack(RAFT)]},
            },
        ),
        Transformation(
            "sail",
            SHORE,
            ISLAND,
            {
                Owner.CURRENT: {Operation.MIN: [Stack(RAFT)], Operation.REMOVE: [Stack(RAFT)]},
                Owner.DESTINATION: {Operation.ADD: [Stack(RAFT)]},
            },
        ),
        Transformation(
            "take",
            inventory_changes={
                Owner.CURRENT: {Operation.MIN: [Stack(FLAG)], Operation.REMOVE: [Stack(FLAG)]},
                Owner.PLAYER: {Operation.ADD: [Stack(FLAG)]},
            },
        ),
        Transformation("sing"),
    ],
)


class Crafting(gymnasium.Env):
    """Things are counted by place and item; place None is the player."""

    world = WORLD
    action_space = spaces.Discrete(len(WORLD.transformations))
    observation_space = spaces.Box(0, np.inf, (5,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.zone, self.things = WORLD.start_zone, Counter({(None, stack.item): 1 for stack in WORLD.start_items})
        for zone, stacks in WORLD.start_zones_items.items():
            self.things.update({(zone, item): n for item, n in stacks})
        return self._observation(), {"action_is_legal": self._legal()}

    def step(self, action):
        if self._legal()[action]:
            done = WORLD.transformations[action]
            for sign, operation in ((-1, Operation.REMOVE), (1, Operation.ADD)):
                for place, (item, n) in done.stacks(operation, self.zone):
                    self.things[place, item] += sign * n
            self.zone = done.destination or self.zone
        return self._observation(), 0.0, False, False, {"action_is_legal": self._legal()}

    def _observation(self):
        held = [self.things[None, item] for item in (WOOD, AXE, RAFT, FLAG)]
        return np.array([WORLD.zones.index(self.zone), *held], np.int32)

    def _legal(self):
        return np.array([self._is_legal(one) for one in WORLD.transformations])

    def _is_legal(self, one):
        bounds = {Operation.MIN: lambda have, n: have >= n, Operation.MAX: lambda have, n: have <= n}
        fits = (
            allowed(self.things[place, item], n)
            for operation, allowed in bounds.items()
            for place, (item, n) in one.stacks(operation, self.zone)
        )
        return one.zone in (None, self.zone) and all(fits)
