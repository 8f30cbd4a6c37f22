"""All measures of one MDP and of one walk."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.measures.covering import covering_length
from benchmarks.measures.effective_horizon import (
    effective_horizon,
    effective_planning_window,
    minimum_k,
    samples_of,
)
from benchmarks.measures.gorp import Gorp
from benchmarks.measures.mdp import DeterministicMDP, check_horizon
from benchmarks.measures.policy_information import policy_information
from benchmarks.measures.walk import (
    MAX_COVER_NODES,
    MAX_DENSE_NODES,
    committor,
    commute_time,
    cover_time,
    mixing_time,
    sampled_cover_time,
    spectral_gap,
    stationary_distribution,
)
from hierroom.complexity.chains.chain import EXIT, Chain
from hierroom.complexity.chains.weights import as_moves, row_sums
from hierroom.support.errors import InputError


@dataclass(frozen=True)
class MdpMeasures:
    """The measures of the literature on a deterministic MDP with returns 0 or 1."""

    states: int  # number of states
    actions: int  # number of actions A
    horizon: int  # number of steps T of an episode
    shortest: int  # steps of a shortest solution
    random_success: float  # probability that the random policy succeeds within T steps
    k: int  # least k at which the MDP is k-QVI-solvable
    planning_window: int  # the effective planning window W
    horizon_bound: float  # upper bound on the effective horizon by theorem 5.4
    rollouts: int | None  # m_1 of GORP; None if it is above a million
    effective_horizon: float  # H_1 = 1 + log_A m_1; ``inf`` if m_1 is not known
    samples: float  # GORP's sample bound T^2 A^H, H the lesser of H_1 and the bound; ``inf`` if it overflows a float
    covering_low: float  # lower bound on the covering length, in episodes
    covering_high: float  # upper bound on the covering length, in episodes
    pic: float  # policy information capacity, in nats
    poic: float  # policy-optimal information capacity, in nats


def measure_mdp(mdp: DeterministicMDP, horizon: int, n_policies: int = 200) -> MdpMeasures:
    """Return every measure of an MDP with returns 0 or 1.

    Args:
        horizon: number of steps T of an episode, at least the length of a shortest solution.
        n_policies: number of policies drawn for the information capacities.
    """
    check_horizon(mdp, horizon)
    shortest = mdp.shortest_solution()
    if shortest < 0:
        raise InputError("no number of steps leads to a reward of this MDP, so that nothing can be measured")
    if shortest > horizon:
        raise InputError(f"a solution of the MDP needs at least {shortest} steps, but the horizon is {horizon}")
    bound = effective_horizon(mdp, horizon).value
    gorp = Gorp(mdp, horizon).rollouts()
    covering = covering_length(mdp, horizon)
    information = policy_information(mdp, horizon, n_policies)
    return MdpMeasures(
        states=mdp.n_states,
        actions=mdp.n_actions,
        horizon=horizon,
        shortest=shortest,
        random_success=mdp.random_success(horizon),
        k=minimum_k(mdp, horizon),
        planning_window=effective_planning_window(mdp, horizon),
        horizon_bound=bound,
        rollouts=gorp.rollouts,
        effective_horizon=gorp.effective_horizon,
        samples=samples_of(horizon, mdp.n_actions, min(bound, gorp.effective_horizon)),
        covering_low=covering.low,
        covering_high=covering.high,
        pic=information.pic,
        poic=information.poic,
    )


@dataclass(frozen=True)
class WalkMeasures:
    """Measures of the long-run behaviour of a walk."""

    nodes: int  # number of nodes
    at_exit: float  # long-run fraction of the time at the exit
    escape: float  # probability to reach the exit before the start again, once the start is left
    spectral_gap: float  # absolute spectral gap
    mixing: float  # mixing time in steps, to a total variation distance of 1/4; ``nan`` if the graph is too large
    commute: float  # commute time between start and exit, in steps
    cover: float  # cover time from the start, in steps
    cover_error: float  # standard error of a sampled cover time; 0 if it is exact


def measure_walk(chain: Chain, n_walks: int = 1000, seed: int = 0) -> WalkMeasures:
    """Return every measure of the long-run behaviour of a walk.

    Args:
        chain: the walk.
        n_walks: number of walks drawn for the cover time of a large graph, at least 2.
        seed: determines these walks.
    """
    weights, source, target = as_moves(chain.weights), chain.source, chain.goals[EXIT][0]
    n = len(chain.labels)
    to_exit = committor(weights, source, target)
    leaving = float(row_sums(weights)[source])
    if n <= MAX_COVER_NODES:
        cover, error = cover_time(weights, source), 0.0
    else:
        cover, error = sampled_cover_time(weights, source, n_walks, seed)
    return WalkMeasures(
        nodes=n,
        at_exit=float(stationary_distribution(weights)[target]),
        escape=float((weights @ to_exit)[source]) / leaving if leaving else 0.0,
        spectral_gap=spectral_gap(weights),
        mixing=mixing_time(weights) if n <= MAX_DENSE_NODES else float("nan"),
        commute=commute_time(weights, source, target),
        cover=cover,
        cover_error=error,
    )
