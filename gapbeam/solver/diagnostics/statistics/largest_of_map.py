"""The largest value of a map of means with chance in them: where it is, and what interval it has.

The largest of many means is larger than the mean at its place: chance lifts some, and the largest is one of these. So

* the interval is that of the largest of the true means. Each point has an interval that holds with the probability
  1 - 0.05 / m; all m of them hold with 0.95 at least (Bonferroni), and then the largest true mean lies between the
  largest of their lower and the largest of their upper ends;
* beside the largest mean stands the mean at a place that other batches chose: the place where the even batches are
  largest, averaged over the odd ones, and the reverse. Chance does not lift it.

Source: Miller, Simultaneous Statistical Inference (1981), section 2.1, for Bonferroni's intervals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.diagnostics.statistics.batch_interval import BATCHES, CONFIDENCE, Interval, interval_of_mean

Array = np.ndarray


@dataclass(frozen=True)
class LargestOfMap:
    """The largest value of a map.

    Attributes:
        point: Index of the point with the largest mean.
        interval: That mean, and the 95 % interval of the largest true mean.
        elsewhere: Mean at places that other batches chose.
        points: Number of points.
    """

    point: int
    interval: Interval
    elsewhere: float
    points: int


def largest_of_map(series: Array) -> LargestOfMap:
    """Return the largest mean of a map of figures that are positive or 0.

    Args:
        series: Of each point, (blocks, points), at least 10 blocks and a point.
    """
    count = series.shape[1]
    confidence = 1.0 - (1.0 - CONFIDENCE) / count
    ends = [_ends(one, confidence) for one in series.T]
    values = np.array([one.value for one in ends])
    point = int(np.argmax(values))
    low, high = max(one.low for one in ends), max(one.high for one in ends)
    length = len(series) // BATCHES
    batches = series[len(series) - BATCHES * length :].reshape(BATCHES, length, count).mean(axis=1)
    even, odd = batches[0::2].mean(axis=0), batches[1::2].mean(axis=0)
    elsewhere = 0.5 * float(odd[np.argmax(even)] + even[np.argmax(odd)])
    return LargestOfMap(point, Interval(float(values[point]), max(low, 0.0), high), elsewhere, count)


def _ends(series: Array, confidence: float) -> Interval:
    """Return a mean with its interval: even about the logarithm, or about the mean where that would reach too far."""
    found = interval_of_mean(series, confidence=confidence)
    if found.value <= 0.0 or found.high - found.value > found.value:
        return found
    return interval_of_mean(series, positive=True, confidence=confidence)
