"""An environment with a world as in HierarchyCraft: a raft is built of wood, and sails from the shore."""

from dataclasses import dataclass, field
from enum import Enum
from types import SimpleNamespace
from typing import NamedTuple

import gymnasium

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
    """It is only asked for its world."""

    world = WORLD
