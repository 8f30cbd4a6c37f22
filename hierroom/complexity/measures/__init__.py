"""Measures from the literature of how hard a task is to explore or to learn.

| measure | function | source |
|---|---|---|
| k-QVI-solvable at k | `minimum_k` | Laidlaw, Russell and Dragan 2023, definition 5.1 |
| effective horizon, H <= k + log_A m | `effective_horizon` | the same, theorem 5.4 |
| GORP's m_k and H_k, its samples T^2 A^k m_k | `Gorp` | the same, definition 5.2 and lemma 5.3 |
| effective planning window W | `effective_planning_window` | Malik, Pacchiano, Srinivasan and Li 2021 |
| covering length L | `covering_length` | Even-Dar and Mansour 2003 |
| policy (optimal) information capacity | `policy_information`, `mdp_policy_information` | Furuta et al. 2021 |
| stationary distribution pi P = pi | `stationary_distribution` | Levin and Peres, proposition 1.14 |
| absolute spectral gap | `spectral_gap` | Levin and Peres, section 12.2 |
| mixing time | `mixing_time` | Levin and Peres, equation 4.30 |
| commute time m_st + m_ts | `commute_time` | Levin and Peres, section 10.3 |
| cover time | `cover_time`, `sampled_cover_time` | Levin and Peres, chapter 11 |
| committor | `committor` | Norris, 1.3.2 |

The first six need a `DeterministicMDP`: of a goal graph (`graph_mdp`), a Gymnasium environment (`enumerate_env`) or a
level (`hierroom.worlds.escape_room.measured_levels.level_mdp`). The others need W, as defined in `hierroom.complexity`.
Levin and Peres is Markov Chains and Mixing Times, 2nd edition, 2017; Norris is Markov Chains, 1997.
"""

from hierroom.complexity.chains.ergodic import (
    committor,
    commute_time,
    cover_time,
    mixing_time,
    sampled_cover_time,
    spectral_gap,
    stationary_distribution,
)
from hierroom.complexity.measures.covering import covering_length
from hierroom.complexity.measures.effective_horizon import effective_horizon, effective_planning_window, minimum_k
from hierroom.complexity.measures.gorp import Gorp
from hierroom.complexity.measures.mdp import DeterministicMDP, enumerate_env, graph_mdp
from hierroom.complexity.measures.policy_information import mdp_policy_information, policy_information
from hierroom.complexity.measures.summary import measure_mdp, measure_walk

__all__ = [
    "DeterministicMDP",
    "Gorp",
    "committor",
    "commute_time",
    "cover_time",
    "covering_length",
    "effective_horizon",
    "effective_planning_window",
    "enumerate_env",
    "graph_mdp",
    "mdp_policy_information",
    "measure_mdp",
    "measure_walk",
    "minimum_k",
    "mixing_time",
    "policy_information",
    "sampled_cover_time",
    "spectral_gap",
    "stationary_distribution",
]
