"""Exploration complexity of goal graphs: depth, width and passage times, before anybody trains."""

from hierroom.complexity.augmented import AugmentedGraph, Node, count_nodes
from hierroom.complexity.chain import Chain, EdgeSensitivity
from hierroom.complexity.difficulty import Curriculum, Difficulty, is_difficulty, parse_difficulty
from hierroom.complexity.hitting import (
    expected_visits,
    first_passage_variance,
    hitting_probability,
    mean_first_passage_time,
    passage_time_sensitivity,
)
from hierroom.complexity.laplacian import laplacian, laplacian_hitting_time, laplacian_sensitivity
from hierroom.complexity.reach import expected_states, reach_probability
from hierroom.complexity.report import ComplexityReport, analyze
from hierroom.complexity.simulate import simulate_passage_times
from hierroom.complexity.walk import Reading, Walk

__all__ = [
    "AugmentedGraph",
    "Chain",
    "ComplexityReport",
    "Curriculum",
    "Difficulty",
    "EdgeSensitivity",
    "Node",
    "Reading",
    "Walk",
    "analyze",
    "count_nodes",
    "expected_states",
    "expected_visits",
    "first_passage_variance",
    "hitting_probability",
    "is_difficulty",
    "laplacian",
    "laplacian_hitting_time",
    "laplacian_sensitivity",
    "mean_first_passage_time",
    "parse_difficulty",
    "passage_time_sensitivity",
    "reach_probability",
    "simulate_passage_times",
]
