"""The largest of many means: an interval that holds the largest true one, and a value that chance does not lift."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.diagnostics.statistics.batch_interval import largest_of_map

BLOCKS, POINTS, DRAWS = 100, 30, 100


def drawn(seed: int, means: np.ndarray) -> np.ndarray:
    """Return rates of points over blocks: skew, positive, alike at neighbors and from block to block; (blocks, points).

    Means of exponentials that neighbors share have the means asked for.
    """
    rng = np.random.default_rng(seed)
    raw = rng.exponential(size=(BLOCKS + 2, POINTS + 2))
    shared = sum(raw[i : BLOCKS + i, j : POINTS + j] for i in range(3) for j in range(3)) / 9.0
    return np.asarray(shared * means)


@pytest.mark.parametrize("kind", ["even", "one peak"])
def test_the_interval_holds_the_largest_true_mean(kind: str) -> None:
    """In 95 % of draws and more; the largest mean alone is too large where all points are alike."""
    means = np.ones(POINTS) if kind == "even" else 1.0 + np.exp(-0.5 * ((np.arange(POINTS) - 15.0) / 3.0) ** 2)
    found = [largest_of_map(drawn(seed, means)) for seed in range(DRAWS)]
    held = np.mean([one.interval.low <= means.max() <= one.interval.high for one in found])
    assert held >= 0.95
    lifted = np.mean([one.interval.value for one in found]) / means.max() - 1.0
    elsewhere = np.mean([one.elsewhere for one in found]) / means.max() - 1.0
    assert lifted > (0.1 if kind == "even" else 0.0)
    assert -0.1 < elsewhere < 0.03


def test_a_point_alone_and_points_that_never_slide() -> None:
    series = drawn(1, np.ones(POINTS))
    series[:, 1:] = 0.0
    one = largest_of_map(series)
    assert (one.point, one.points) == (0, POINTS)
    assert one.interval.low > 0.0
    assert one.elsewhere == pytest.approx(one.interval.value)
    none = largest_of_map(np.zeros((BLOCKS, 3)))
    assert (none.interval.value, none.interval.low, none.interval.high) == (0.0, 0.0, 0.0)


def test_rare_points_do_not_widen_the_interval_without_end() -> None:
    """A point with one event has an interval about its mean, not about its logarithm."""
    series = drawn(2, np.ones(POINTS))
    series[:, 0] = 0.0
    series[50, 0] = 1.0
    assert largest_of_map(series).interval.high < 2.0
