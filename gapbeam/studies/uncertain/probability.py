"""Probabilities and means with 95 % intervals, from random points or from the scatter of randomised replicates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest, t

from gapbeam.solver.system.operators import Array

FEW = 10
"""Members inside, or outside, below which the scatter of replicates does not have the shape that its interval needs."""
UP = 0.975


@dataclass(frozen=True)
class IntervalEstimate:
    """A number with its interval.

    Attributes:
        value: The estimate.
        low: Lower end of the 95 % interval.
        high: Upper end.
        count: Members that the event has; for a mean, members that it is taken over.
        unknown: Share of members for which it is not known: their motion failed or did not settle. The interval of a
            probability holds whatever they would have been.
    """

    value: float
    low: float
    high: float
    count: int
    unknown: float = 0.0


def probability(event: Any, known: Any, independent: bool) -> IntervalEstimate:
    """Return the probability of an event.

    Independent members: the interval of Wilson. Replicates of randomised points: Student's t of their means, where
    ten members or more have the event and ten have not; else the interval of Wilson, which is wider for such points.

    Args:
        event: Whether it happened, (replicates, members).
        known: Whether that is known, (replicates, members).
        independent: Whether members are drawn independently of each other.

    Source: Wilson (1927); Owen (2013), Monte Carlo Theory, section 17.
    """
    yes, maybe = event & known, event | ~known
    low, high = _ends(yes, independent)[0], _ends(maybe, independent)[1]
    count, every = int(yes.sum()), int(known.sum())
    return IntervalEstimate(count / every if every else float("nan"), low, high, count, 1.0 - every / known.size)


def _ends(event: Any, independent: bool) -> tuple[float, float]:
    count, size = int(event.sum()), event.size
    if independent or min(count, size - count) < FEW:
        ends = binomtest(count, size).proportion_ci(method="wilson")
        return float(ends.low), float(ends.high)
    mean, half = mean_and_half_width(event.mean(axis=1))
    return max(mean - half, 0.0), min(mean + half, 1.0)


def mean_and_half_width(means: Array) -> tuple[float, float]:
    """Return the mean of independent numbers, and the half width of its 95 % interval."""
    spread = float(np.std(means, ddof=1)) / np.sqrt(len(means)) if len(means) > 1 else float("nan")
    return float(np.mean(means)), float(t.ppf(UP, len(means) - 1)) * spread if len(means) > 1 else spread


def mean_of(values: Array, inside: Any, independent: bool) -> IntervalEstimate:
    """Return the mean of a figure over the members inside.

    Independent members: Student's t of these. Replicates: Student's t of the residuals of a ratio, of the sum inside
    to the number inside.

    Args:
        values: (replicates, members); others than inside do not count.
        inside: Which members, (replicates, members).
        independent: As in `probability`.

    Source: Cochran (1977), Sampling Techniques, section 2.11 (ratio).
    """
    count = int(inside.sum())
    if not count:
        return IntervalEstimate(float("nan"), float("nan"), float("nan"), 0)
    if independent:
        mean, half = mean_and_half_width(values[inside])
        return IntervalEstimate(mean, mean - half, mean + half, count)
    sums, counts = np.where(inside, values, 0.0).sum(axis=1), inside.sum(axis=1)
    mean = float(sums.sum() / count)
    _, half = mean_and_half_width((sums - mean * counts) / counts.mean())
    return IntervalEstimate(mean, mean - half, mean + half, count)
