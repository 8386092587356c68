"""Series of recordings whose values leave the ranges of the library: what is known of them alone makes the trend."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.studies.uncertain.probability import IntervalEstimate


def estimated(values: np.ndarray, half: float, low: float, high: float) -> list[gb.EstimatedValues]:
    """Return estimates of "g" in a range, as `estimate` clips them, and of "k", which is always inside."""
    found = []
    for i, v in enumerate(values):
        a, b, c = (float(np.clip(x, low, high)) for x in (v, v - half, v + half))
        ends = ("g",) if b <= low or c >= high else ()
        some = {"g": IntervalEstimate(a, b, c, 1), "k": IntervalEstimate(5.0, 4.0, 6.0, 1)}
        found.append(gb.EstimatedValues(f"r{i}", some, 1.0, ends))
    return found


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("rate", [-0.1, 0.1])
@pytest.mark.parametrize("beyond", [0, 1, 3, 6])
def test_estimates_at_an_end_bend_no_trend(beyond: int, rate: float, size: float) -> None:
    """A line with the scatter of its intervals that leaves the range: its rate, and the time to a limit far outside.

    Those beyond were estimates at the end with an interval of width 0: rates were nan, "no change seen".
    """
    t, hits, reached = np.arange(6.0 + beyond), 0, 0
    end = 1.0 + 5.35 * rate
    low, high = (end - 0.01, 5.0) if rate < 0.0 else (-5.0, end + 0.01)
    for seed in range(200):
        v = 1.0 + rate * t + 0.02 * np.random.default_rng(seed).standard_normal(len(t)) * (t < 6)
        some = estimated(size * v, size * 0.04, size * low, size * high)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            series = gb.series(some, t, {"g": size * (1.0 + 20.0 * rate)})
        one = series.trends["g"]
        assert one.is_seen
        assert one.reached is not None
        hits += one.rate.low <= size * rate <= one.rate.high
        reached += one.reached.low <= 20.0 <= one.reached.high
        left = [x.name for x in some if x.ends]
        assert not left or f"left out: {', '.join(left)}" in series.headline()
        assert beyond <= len(left) <= beyond + 3
    assert hits >= 180
    assert reached >= 180


@pytest.mark.parametrize("inside", [0, 1, 2])
def test_fewer_than_three_inside_of_the_range_have_no_rate(inside: int) -> None:
    """The other value has one."""
    series = gb.series(estimated(np.r_[np.full(inside, 1.0), np.full(5, 3.0)], 0.1, 0.5, 2.0), None, {"g": 2.5})
    assert list(series.trends) == ["k"]
    assert "inside of the library and the range of g: no rates, no times to limits" in series.headline()
