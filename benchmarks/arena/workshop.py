"""Workshops of the arena: tech trees that no committed run has seen.

They were drawn at random with seed 73, and not chosen by any measure: a seed of 10,000 to 99,999 and any shape.
Numbers of goals and limits were shuffled by themselves. The number of actions follows from the tree.
"""

_DRAWN = {
    "workshop:5:30945:either": 200,
    "workshop:5:68203:either": 800,
    "workshop:9:28734:either": 150,
    "workshop:7:28852:mixed": 400,
    "workshop:4:50840:deep": 800,
    "workshop:7:65373:wide": 500,
    "workshop:6:14285:wide": 300,
    "workshop:8:14692:either": 300,
}
TASKS = {name: {"task": name, "max_steps": limit} for name, limit in _DRAWN.items()}
