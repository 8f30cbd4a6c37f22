"""What can be measured of a task by playing it, where its states are too many to enumerate."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SampledMeasures:
    """Measures of the literature, estimated from rollouts in a deterministic MDP whose return is 0 or 1.

    What is left out of `summary.MdpMeasures` needs the values of all states.

    Args:
        states: number of states; None if it is not known.
        actions: number of actions A.
        horizon: number of steps T of an episode.
        shortest: steps of a shortest solution.
        random_success: share of the random policy's episodes that succeed within T steps.
        random_success_low: lower end of its 95% interval (Wilson 1927).
        random_success_high: upper end of it.
        rollouts: least m_1 with which half of the runs of GORP succeed; None if it takes more steps than are allowed.
        rollouts_tried: the greatest number of rollouts with which less than half of them do; 0 if one is enough.
        effective_horizon: H_1 = 1 + log_A m_1; ``inf`` if m_1 is not known.
        samples: GORP's sample bound T^2 A^H; ``inf`` likewise.
        pic: policy information capacity, in nats.
        poic: policy-optimal information capacity, in nats.
    """

    states: int | None
    actions: int
    horizon: int
    shortest: int
    random_success: float
    random_success_low: float
    random_success_high: float
    rollouts: int | None
    rollouts_tried: int
    effective_horizon: float
    samples: float
    pic: float
    poic: float
