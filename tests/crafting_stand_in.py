"""An environment with a world as in HierarchyCraft: a raft is built of wood, and sails from the shore."""

from collections import namedtuple
from enum import Enum
from types import SimpleNamespace

import gymnasium

Owner = Enum("Owner", {"PLAYER": "player", "CURRENT": "current_zone", "DESTINATION": "destination", "ZONES": "zones"})
Operation = Enum("Operation", {"MIN": "min", "MAX": "max", "REMOVE": "remove", "ADD": "add"})
MIN, MAX, REMOVE, ADD = Operation
Zone, Item = (namedtuple(kind, ["name"]) for kind in ("Zone", "Item"))
Stack = namedtuple("Stack", ["item", "quantity"], defaults=[1])
SHORE, FOREST, ISLAND = map(Zone, ("shore", "forest", "island"))
WOOD, AXE, RAFT, FLAG = map(Item, ("wood", "axe", "raft", "flag"))


def transformation(name, zone=None, to=None, **changes):
    """Return a transformation; changes are pairs (operation, item and perhaps count) by owner."""
    by_owner = {
        Owner[owner.upper()]: {operation: [Stack(*items)] for operation, *items in several}
        for owner, several in changes.items()
    }
    return SimpleNamespace(name=name, zone=zone, destination=to, inventory_changes=by_owner)


class Crafting(gymnasium.Env):
    """It is only asked for its world."""

    world = SimpleNamespace(
        zones=[SHORE, FOREST, ISLAND],
        start_zone=SHORE,
        start_items=[Stack(AXE)],
        start_zones_items={ISLAND: [Stack(FLAG)]},
        transformations=[
            transformation("to-forest", SHORE, FOREST),
            transformation("to-shore", FOREST, SHORE),
            transformation("chop", FOREST, player=[(MIN, AXE), (MAX, WOOD, 1), (ADD, WOOD, 2)]),
            transformation("build", player=[(MIN, WOOD, 2), (REMOVE, WOOD, 2)], current=[(ADD, RAFT)]),
            transformation("sail", SHORE, ISLAND, current=[(MIN, RAFT), (REMOVE, RAFT)], destination=[(ADD, RAFT)]),
            transformation("take", current=[(MIN, FLAG), (REMOVE, FLAG)], player=[(ADD, FLAG)]),
            transformation("sing"),
        ],
    )
