"""The modules that are mutated."""

from collections.abc import Mapping
from pathlib import Path

TESTS = Path(__file__).parents[1]
TARGETS: Mapping[str, tuple[str, str, int]] = {
    "gae": ("learners/gae.py", "learner_gae", 0),
    "graph": ("goals/graph.py", "goals goals_enumeration", 0),
    "tree": ("goals/tree.py", "goals goals_enumeration complexity_graph_set", 1),
    "hitting": ("complexity/chains/hitting.py", "complexity_hitting", 7),
    "elimination": ("complexity/chains/elimination.py", "complexity_elimination", 21),
    "ledger": ("turns/ledger.py", "options turn_kernels crafted_states", 24),
    "turn_kernels": ("turns/kernels.py", "options turn_kernels rewards api_vector", 6),
    "turns": ("turns/turns.py", "turns turns_masks turns_state turns_curriculum rewards", 4),
    "step": ("worlds/escape_room/step_kernels.py", "world_keys world_minigrid world_batch features novelty", 0),
    "view": (
        "worlds/escape_room/view_kernels.py",
        "world_keys world_minigrid world_batch features frontier novelty",
        7,
    ),
    "generation": ("worlds/escape_room/generation_kernels.py", "world_levels", 28),
    "random": ("worlds/random_kernels.py", "world_random", 0),
    "batch": ("worlds/escape_room/batch_kernels.py", "world_batch", 0),
    "observations": ("worlds/escape_room/observations.py", "api_equal api_vector", 3),
    "state_check": ("worlds/escape_room/state_check.py", "state_check", 10),
    "vector_arrays": ("envs/vector_arrays.py", "api_vector api_equal api_contract", 28),
    "oracle": ("worlds/escape_room/oracle.py", "world_oracle", 38),
    "features": ("worlds/escape_room/features.py", "features feature_values frontier", 13),
    "sampling": ("learners/sampling.py", "learner_sampling", 6),
    "encoder": ("learners/fused/encoder_kernels.py", "learner_kernels", 7),
    "recurrent": ("learners/fused/recurrent_kernels.py", "learner_kernels", 7),
    "loss": ("learners/fused/loss_kernels.py", "learner_kernels", 1),
    "adam": ("learners/fused/adam_kernels.py", "learner_kernels", 1),
}
"""By name: a module, the tests that must notice an error in it, and how many mutants no test can notice."""


def files_of_tests(names: str) -> list[str]:
    """Return the paths of tests from the names that `TARGETS` has."""
    return [str(path) for one in names.split() for path in TESTS.rglob(f"test_{one}.py")]
