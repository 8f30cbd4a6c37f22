"""Random tech trees: rules for a workshop, by number of goals, seed and shape."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Literal, TypeVar, get_args

import numpy as np

from hierroom.goals import Rules
from hierroom.goals.goal_set import MAX_GOALS
from hierroom.support.errors import InputError, require_name, require_number, shown

Name = TypeVar("Name", str, tuple[str, str])
Shape = Literal["mixed", "deep", "wide", "either"]
"""Unused things to take as ingredients: random ones (mixed, either), the newest (deep) or the oldest (wide)."""
MIN_GOALS = 2
MATERIALS = (
    *(("tree", "wood"), ("rock", "stone"), ("mine", "ore"), ("field", "straw"), ("sheep", "wool"), ("pit", "clay")),
    *(("river", "water"), ("hive", "wax"), ("bush", "berry"), ("dune", "sand"), ("cow", "hide"), ("spring", "salt")),
)
PARTS = ("plank", "brick", "ingot", "rope", "cloth", "nail", "glass", "gear", "paint", "paper", "pipe", "wire")
TOOLS = ("axe", "hammer", "saw", "kiln", "loom", "forge", "mill", "drill", "press", "lathe", "crane", "engine")
MASTERPIECE = "masterpiece"
CAPACITY = 3
"""Capacity of each material; everything else has capacity 1."""


def tech_tree_of(spec: str) -> Rules:
    """Return the tech tree of a text: ``GOALS``, with optional ``:SEED`` (0) and ``:SHAPE`` (mixed)."""
    match = re.fullmatch(r"([0-9]{1,4})(?::([0-9]{1,18}))?(?::(\w+))?", spec, re.ASCII)
    if match is None:
        raise InputError(
            "a workshop is workshop:GOALS, workshop:GOALS:SEED or workshop:GOALS:SEED:SHAPE, "
            f"such as workshop:8:3:deep, not {shown(f'workshop:{spec}')}"
        )
    n_goals, seed, shape = match.groups()
    return tech_tree(int(n_goals), int(seed or 0), shape or "mixed")  # pyright: ignore[reportArgumentType] - checked there


def tech_tree(n_goals: int, seed: int = 0, shape: Shape = "mixed") -> Rules:
    """Return a random tech tree.

    A third of the goals (a quarter if deep, half if wide) are materials, made with a source that is never used up, such
    as wood with a tree. The others are made of one to three earlier things: parts, which are used up as ingredients,
    and tools, which are not. The last one is the masterpiece, the target; all others are needed for something. As
    every ingredient can be made again and again, the masterpiece can always be made.

    Args:
        n_goals: 2 to 63.
        seed: 0 to 10**18 - 1.
        shape: deep for a long way to the target, wide for a short one with many branches, mixed, or either. With
            either, about half of the parts and tools can also be made in a second way.
    """
    require_number("the number of goals of a workshop", n_goals, MIN_GOALS, MAX_GOALS, is_whole=True)
    require_number("the seed of a workshop", seed, 0, 10**18 - 1, is_whole=True)
    require_name("the shape of a workshop must be one of", shape, get_args(Shape))
    rng = np.random.default_rng([seed, n_goals, get_args(Shape).index(shape)])
    n_materials = {"deep": max(1, n_goals // 4), "wide": n_goals // 2}.get(shape, max(1, round(n_goals / 3)))
    n_parts = (n_goals - n_materials) // 2
    pairs = _chosen(rng, MATERIALS, n_materials, lambda number: (f"source {number}", f"material {number}"))
    sources, materials = zip(*pairs, strict=True)
    rules: dict[str, dict | list[dict]] = {material: {"needs": source, "gives": material} for source, material in pairs}
    parts = _chosen(rng, PARTS, n_parts, "part {}".format)
    tools = _chosen(rng, TOOLS, n_goals - n_materials - n_parts - 1, "tool {}".format)
    products = [*rng.permutation([*parts, *tools]).tolist(), MASTERPIECE]
    unused, known, made = [*materials], [*materials], []
    for product in products:
        asks = [_ask(rng, unused, known, materials, shape, is_last=product == MASTERPIECE)]
        unused = [thing for thing in unused if thing not in asks[0]] + [product]
        if shape == "either" and product != MASTERPIECE and rng.random() < 0.5:
            asks += _other_ask(rng, known, made)
        made += asks
        ways = [
            {
                "needs": {thing: count for thing, count in ask.items() if thing in tools},
                "uses": {thing: count for thing, count in ask.items() if thing not in tools},
                "gives": product,
            }
            for ask in asks
        ]
        rules[product] = ways if len(ways) > 1 else ways[0]
        known.append(product)
    label = f"workshop:{n_goals}:{seed}" + (f":{shape}" if shape != "mixed" else "")
    capacity = dict.fromkeys(materials, CAPACITY)
    return Rules(rules, MASTERPIECE, capacity, dict.fromkeys(sources, 1), label)


def _ask(
    rng: np.random.Generator,
    unused: list[str],
    known: list[str],
    materials: tuple[str, ...],
    shape: str,
    *,
    is_last: bool,
) -> dict[str, int]:
    """Return the ingredients of a product: one to three things, each with its count.

    At least one is unused so far, so no two products have the same ingredients. As long as more than two things are
    unused, it takes two of them, so that the last product can take the rest.
    """
    at_random: list[str] = rng.permutation(unused).tolist()
    waiting = {"deep": unused[::-1], "wide": unused}.get(shape, at_random)
    chosen = waiting if is_last else waiting[: 1 + (len(waiting) > 2 or rng.random() < 0.5)]
    if len(chosen) < 2 and len(known) > 1:
        chosen = [*chosen, str(rng.choice([thing for thing in known if thing not in chosen]))]
    counts = dict.fromkeys(chosen, 1)
    of_materials = [thing for thing in chosen if thing in materials]
    if len(counts) < 3 and of_materials and rng.random() < 0.5:
        counts[of_materials[0]] = 2
    return counts


def _other_ask(rng: np.random.Generator, known: list[str], made: list[dict[str, int]]) -> list[dict[str, int]]:
    """Return a list with one pair of known things that is no product's recipe yet; empty if none is found."""
    for _ in range(20 if len(known) > 1 else 0):
        ask = dict.fromkeys(rng.choice(known, 2, replace=False).tolist(), 1)
        if ask not in made:
            return [ask]
    return []


def _chosen(rng: np.random.Generator, names: Sequence[Name], n: int, more: Callable[[int], Name]) -> list[Name]:
    chosen = [names[place] for place in rng.permutation(len(names))[:n]]
    return [*chosen, *map(more, range(len(chosen) + 1, n + 1))]
