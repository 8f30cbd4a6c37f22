"""Exploration complexity of goal graphs and rules before training: depth, width and passage times.

W holds the probability of each move in one step, and D the row sums of W. Q holds the transition probabilities among
the nodes that are not targets, staying included, and N = (I - Q)^-1. The walk starts at node s. If there is a single
target node t, b = e_s - e_t.

| equation | function | source |
|---|---|---|
| L = W - D | `laplacian` | paper, section 2.1 |
| hitting time b' pinv(D - W) b | `laplacian_hitting_time` | paper, section 2.1 and Table 2 |
| mean m of the first-passage time: ((D - W) m)_i = 1, 0 at targets | `mean_first_passage_time` | Norris, 1.3.5 |
| its variance (2 N - I) m - m^2 | `first_passage_variance` | Kemeny and Snell, 3.3.3 |
| hitting probability h: ((D - W) h)_i = 0, 1 at targets | `hitting_probability` | Norris, 1.3.2 |
| expected visits v = e_s' N | `expected_visits` | Kemeny and Snell, chapter 3 |
| reach probability P(T <= t) = h_s - (Q^t h)_s | `reach_probability` | derived in `chains.reach` |
| expected distinct states: sum over i of P(T_i <= t) | `expected_states` | derived in `chains.reach` |
| sensitivity dm_s / dW_ij = v_i (m_j - m_i) | `passage_time_sensitivity` | from dN = N dQ N |
| sensitivity d(b' pinv(D - W) b) / dW_ij | `laplacian_sensitivity` | Golub and Pereyra, 4.3 |

Systems for m, v and h are solved without subtraction (`chains.elimination`; Grassmann, Taksar and Heyman, 1985).

`AugmentedGraph` is the paper's augmented graph with its weights W (appendix A); `MarkingGraph` is its counterpart for
rules. Numbers after a source are its theorems: Norris, Markov Chains, 1997; Kemeny and Snell, Finite Markov Chains,
1960; Golub and Pereyra, The Differentiation of Pseudo-Inverses, 1973.
"""

from hierroom.complexity.augmented import AugmentedGraph, Node, count_nodes
from hierroom.complexity.chains.chain import Chain
from hierroom.complexity.chains.hitting import (
    expected_visits,
    first_passage_variance,
    hitting_probability,
    mean_first_passage_time,
    passage_time_sensitivity,
)
from hierroom.complexity.chains.laplacian import laplacian, laplacian_hitting_time, laplacian_sensitivity
from hierroom.complexity.chains.reach import expected_states, reach_probability
from hierroom.complexity.chains.walk import Walk
from hierroom.complexity.graph_set import Curriculum, GraphSet
from hierroom.complexity.markings import MarkingGraph
from hierroom.complexity.report import ComplexityReport, analyze
from hierroom.complexity.rules_report import RulesReport

__all__ = ["AugmentedGraph", "Chain", "ComplexityReport", "Curriculum", "GraphSet", "MarkingGraph", "Node"]
__all__ += ["RulesReport", "Walk", "analyze", "count_nodes", "expected_states", "expected_visits"]
__all__ += ["first_passage_variance", "hitting_probability", "laplacian", "laplacian_hitting_time"]
__all__ += ["laplacian_sensitivity", "mean_first_passage_time", "passage_time_sensitivity", "reach_probability"]
