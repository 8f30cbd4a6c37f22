"""Confidence intervals."""

import pytest

from hierroom.support.intervals import wilson_interval


def test_wilson_interval_by_hand():
    # 10 of 50 in the tables of Brown, Cai and DasGupta's formula, worked out by hand: z = 1.96, z^2 = 3.8415
    value, low, high = wilson_interval(0.2, 50, 0.95)
    assert (value, round(low, 4), round(high, 4)) == (0.2, 0.1124, 0.3304)
    assert wilson_interval(0.0, 300, 0.95).high == pytest.approx(3.8415 / 303.8415, rel=1e-4)
    assert wilson_interval(1.0, 300, 0.95).low == pytest.approx(300 / 303.8415, rel=1e-4)
