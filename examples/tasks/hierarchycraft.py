"""Any environment of HierarchyCraft as a task, with the rules that its transformations are.

    pip install hcraft

    from hcraft.examples import TreasureEnv
    from hierarchycraft import task_of

    treasure = task_of(TreasureEnv, target="get gold")

Goals are ``get ITEM``, ``place ITEM`` and ``go to ZONE``, as far as the target can need them. A transformation that
does several of these is one goal: ``get key, go to hall``. Facts of the rules are ITEM, ``ITEM in ZONE``, ``at ZONE``.

The rules are simpler than the world. They ask for no maximum. Of each fact they count no more than some rule asks for.
Of several transformations that achieve a goal they apply the first possible one.
"""

from collections import Counter, defaultdict

import gymnasium

import hierroom


def task_of(make, target, max_steps=1000):
    """Return the task of an environment.

    Args:
        make: a function that makes a ``hcraft.HcraftEnv``, or a subclass of it.
        target: the goal that ends an episode with success.
        max_steps: steps after which an episode is truncated.
    """
    world = make().world
    names = [_goal(transformation) for transformation in world.transformations]
    ways = defaultdict(list)
    for name, transformation in zip(names, world.transformations, strict=True):
        zones = [transformation.zone] if transformation.zone else world.zones or [None]
        ways[name] += [_way(transformation, zone) for zone in zones]
    start = _start(world)
    ways = _possible(ways, start)
    if target not in ways:
        raise ValueError(f"the target is one of {', '.join(ways)}; not {target!r}")
    for way in ways[target]:
        way["gives"][target] = 1
    ways = _needed(ways, target)
    return hierroom.Task(
        make=lambda: CountTransformations(make(), names),
        goals={name: _times(name) for name in ways},
        rules=_rules(ways, target, start),
        target=target,
        max_steps=max_steps,
        label=target,
    )


class CountTransformations(gymnasium.Wrapper):
    """Counts for each goal how often a transformation achieved it: ``times``. It draws nothing, as that opens a window.

    Args:
        env: the environment.
        names: for each action its goal.
    """

    def __init__(self, env, names):
        super().__init__(env)
        self._names, self._is_legal, self.times = names, (), Counter()

    def reset(self, **settings):
        """Begin an episode, with nothing counted."""
        observation, info = self.env.reset(**settings)
        self._is_legal, self.times = info["action_is_legal"], Counter()
        return observation, info

    def step(self, action):
        """Act, and count the action if it is legal."""
        self.times[self._names[action]] += int(self._is_legal[action])
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._is_legal = info["action_is_legal"]
        return observation, reward, terminated, truncated, info

    def render(self):
        """Return None."""


def _times(name):
    return lambda env, info: env.times[name]


def _goal(transformation):
    """Return the name of the goal that a transformation achieves: all that it makes, or its own name."""
    changes = _changes(transformation)
    made = [f"get {stack.item.name}" for stack in changes["player", "add"]]
    placed = [changes["current_zone", "add"], changes["destination", "add"], *dict(changes["zones", "add"]).values()]
    made += [f"place {stack.item.name}" for some in placed for stack in some]
    if transformation.destination:
        made.append(f"go to {transformation.destination.name}")
    return ", ".join(dict.fromkeys(made)) or transformation.name


def _changes(transformation):
    """Return the stacks of each owner and operation; those of ``zones`` know their zone."""
    changes = defaultdict(list)
    for owner, operations in transformation.inventory_changes.items():
        for operation, stacks in operations.items():
            changes[owner.value, operation.value] = stacks
    return changes


def _way(transformation, zone):
    """Return what a transformation needs, uses and gives where it is done in a zone."""
    counts = {"min": Counter(), "remove": Counter(), "add": Counter()}
    places = {"player": None, "current_zone": zone, "destination": transformation.destination}
    for (owner, operation), stacks in _changes(transformation).items():
        by_zone = stacks if owner == "zones" else {places[owner]: stacks}
        for place, some in by_zone.items():
            for stack in some if operation in counts else ():
                counts[operation][_fact(stack.item, place)] += stack.quantity
    if zone:
        moves = transformation.destination not in (None, zone)
        counts["remove" if moves else "min"][f"at {zone.name}"] = 1
    if transformation.destination:
        counts["add"][f"at {transformation.destination.name}"] = 1
    return {"needs": counts["min"], "uses": counts["remove"], "gives": counts["add"]}


def _fact(item, zone):
    return item.name if zone is None else f"{item.name} in {zone.name}"


def _start(world):
    """Return how many there are of each fact at the start."""
    start = Counter({stack.item.name: stack.quantity for stack in world.start_items})
    for zone, stacks in world.start_zones_items.items():
        start.update({_fact(stack.item, zone): stack.quantity for stack in stacks})
    if world.start_zone:
        start[f"at {world.start_zone.name}"] = 1
    return start


def _possible(ways, start):
    """Return the ways that can be gone at some time, such as those that need no chest where none can be."""
    facts, n_before = {*start}, -1
    while n_before < len(facts):
        n_before = len(facts)
        possible = {name: [way for way in some if _asked(way) <= facts] for name, some in ways.items()}
        facts |= {fact for some in possible.values() for way in some for fact in way["gives"]}
    return {name: some for name, some in possible.items() if some}


def _needed(ways, target):
    """Return the ways of the goals that the target can need."""
    needed, n_before = {target}, 0
    while n_before < len(needed):
        n_before = len(needed)
        facts = {fact for name in needed for way in ways[name] for fact in _asked(way)}
        needed |= {name for name, some in ways.items() if any(facts & way["gives"].keys() for way in some)}
    return {name: some for name, some in ways.items() if name in needed}


def _asked(way):
    return way["needs"].keys() | way["uses"].keys()


def _rules(ways, target, start):
    """Return the rules, with as much room for each fact as some rule asks for."""
    every = [way for some in ways.values() for way in some]
    facts = {fact for way in every for counts in way.values() for fact in counts}
    capacity = {fact: max(1, *(max(way["needs"][fact], way["uses"][fact]) for way in every)) for fact in facts}
    begins = {fact: min(n, capacity[fact]) for fact, n in start.items() if fact in facts}
    return hierroom.Rules(ways, target, capacity, begins, label=target)
