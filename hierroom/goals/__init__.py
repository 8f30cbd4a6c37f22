"""Goal graphs, rules, the forms in which users give them, and the ids of the goals in a level."""

from hierroom.goals.alternatives import Alternative
from hierroom.goals.graph import NAMED_GRAPHS, GoalGraph, enumerate_graphs, is_graph_name, is_graph_set
from hierroom.goals.ids import (
    COLOURS,
    EXIT_GOAL,
    FIRST_DOOR_GOAL,
    GOAL_NAMES,
    GOAL_VECTORS,
    MAX_GRID_ROOMS,
    N_COLOURS,
    N_GOALS,
    NO_GOAL,
    ROOM_GOAL_NAMES,
    room_goals,
)
from hierroom.goals.rules import Rules
from hierroom.goals.specs import GraphSpec, GraphSpecs, as_goal_graph, graph_specs, plain_specs, spec_names

__all__ = ["COLOURS", "EXIT_GOAL", "FIRST_DOOR_GOAL", "GOAL_NAMES", "GOAL_VECTORS", "MAX_GRID_ROOMS", "NAMED_GRAPHS"]
__all__ += ["NO_GOAL", "N_COLOURS", "N_GOALS", "ROOM_GOAL_NAMES", "Alternative", "GoalGraph", "GraphSpec"]
__all__ += ["GraphSpecs", "Rules", "as_goal_graph", "enumerate_graphs", "graph_specs", "is_graph_name"]
__all__ += ["is_graph_set", "plain_specs", "room_goals", "spec_names"]
