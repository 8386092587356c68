"""Confidence intervals of means over time, from the means of a few long batches.

    se^2 = (s_b^2 / b) (1 + r) / (1 - r),    r = clip(rho_1 + 1 / b, 0, 0.8)

with the standard deviation s_b of the means of b batches, and their correlation rho_1 from one to the next, whose bias
is -1 / b. Student's t with b - 1 degrees of freedom takes the standard error to an interval, which is even about the
logarithm of a figure that is positive.

Sources: Law and Kelton, Simulation Modeling and Analysis, chapter 9, for batch means; the correction of an AR(1)
process for what is left of the correlation is that of Fishman, Principles of Discrete Event Simulation (1978).

Of a map of means, the largest value needs care. The largest of many means is larger than the mean at its place: chance
lifts some, and the largest is one of these. So

* the interval belongs to the largest of the true means. Each point has an interval that holds with the probability
  1 - 0.05 / m; all m of them hold with 0.95 at least (Bonferroni), and then the largest true mean lies between the
  largest of their lower and the largest of their upper ends;
* beside the largest mean stands the mean at a place that other batches chose: the place where the even batches are
  largest, averaged over the odd ones, and the reverse. Chance does not lift it.

Source: Miller, Simultaneous Statistical Inference (1981), section 2.1, for Bonferroni's intervals.

An interval holds where the record is long enough and has settled. Narrow intervals are the wrong ones on a short
record: it has not yet seen how far the motion strays. Rules that look for the end of a transient do more harm than
good, so that a fixed share is left out.

Source: Kendall (1938), Biometrika 30, 81, for tau.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import exp, inf, sqrt
from typing import Literal

import numpy as np
import scipy

from gapbeam.solver.diagnostics.statistics.block_means import correlation_time

Array = np.ndarray

BATCHES = 10
CONFIDENCE = 0.95
LARGEST_CORRELATION = 0.8  # beyond, the correction of an AR(1) process means nothing
MOST_REACH = 700.0  # of an exponent
STOPPING_BATCHES = (8, BATCHES, 16, 32)


@dataclass(frozen=True)
class Interval:
    """A figure with its confidence interval.

    Attributes:
        value: The figure.
        low: Lower end.
        high: Upper end.
    """

    value: float
    low: float
    high: float

    @property
    def half_width(self) -> float:
        """The larger distance from the figure to an end."""
        return max(self.high - self.value, self.value - self.low)

    @property
    def relative(self) -> float:
        """Half of the width over the figure; infinite for a figure of 0."""
        return self.half_width / abs(self.value) if self.value != 0.0 else inf

    def root(self) -> Interval:
        """Return the interval of the square root."""
        return Interval(*(sqrt(max(x, 0.0)) for x in (self.value, self.low, self.high)))


def batch_means(series: Array, batches: int) -> Array:
    """Return the means of batches of equal length, (batches,); what does not fill a batch is left out at the start.

    Args:
        series: Values at even distances in time, or their means over blocks of equal length, (n,), n >= batches.
        batches: Number of batches.
    """
    length = len(series) // batches
    return np.asarray(series[len(series) - batches * length :].reshape(batches, length).mean(axis=1))


def next_correlation(means: Array) -> float:
    """Return the correlation of means, (b,), from one to the next; 0 where all are the same."""
    parts = means - means.mean()
    square = float(parts @ parts)
    return float(parts[1:] @ parts[:-1]) / square if square > 0.0 else 0.0


def standard_error(means: Array) -> float:
    """Return the standard error of the mean of batch means, (b,)."""
    count = len(means)
    r = min(max(next_correlation(means) + 1.0 / count, 0.0), LARGEST_CORRELATION)
    return sqrt(float(np.var(means, ddof=1)) / count * (1.0 + r) / (1.0 - r))


@cache
def quantile(confidence: float, batches: int) -> float:
    """Return the half-width of an interval of a mean of batch means, in standard errors."""
    return float(scipy.stats.t.ppf(0.5 + 0.5 * confidence, batches - 1))


def interval_of_mean(
    series: Array, positive: bool = False, batches: int = BATCHES, confidence: float = CONFIDENCE
) -> Interval:
    """Return the mean of a series with its 95 % interval.

    Args:
        series: As in `batch_means`.
        positive: Whether the figure is positive by its meaning: the interval is then even about its logarithm.
        batches: Number of batches.
        confidence: Confidence of the interval.
    """
    means = batch_means(series, batches)
    value = float(means.mean())
    return interval_about(value, quantile(confidence, batches) * standard_error(means), positive)


def interval_about(value: float, reach: float, positive: bool = False) -> Interval:
    """Return the interval that reaches so far to both sides of a mean.

    Args:
        value: The mean.
        reach: A quantile times its standard error.
        positive: Whether the interval is even about the logarithm, by reach / value, where the mean is positive.
    """
    if positive and value > 0.0:
        factor = exp(min(reach / value, MOST_REACH))
        return Interval(value, value / factor, value * factor)
    return Interval(value, value - reach, value + reach)


def stopping_interval(series: Array, positive: bool = False) -> Interval:
    """Return the widest of the intervals from 8, 10, 16 and 32 batches: what may end a run that is looked at often."""
    found = (interval_of_mean(series, positive, batches) for batches in STOPPING_BATCHES)
    return max(found, key=lambda one: one.half_width)


def interval_of_percentile(samples: Array, share: float) -> Interval:
    """Return the value below which a share of a motion lies, with its 95 % interval.

    The interval of the share of values below it is that of a mean; the order statistics at its ends are the interval
    of the percentile.

    Args:
        samples: Values at even distances in time, (n,).
        share: Between 0 and 1.
    """
    value = float(np.quantile(samples, share))
    means = batch_means((samples <= value).astype(float), BATCHES)
    reach = quantile(CONFIDENCE, BATCHES) * standard_error(means)
    low, high = (float(np.quantile(samples, min(max(share + sign * reach, 0.0), 1.0))) for sign in (-1, 1))
    return Interval(value, low, high)


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
        series: Series of each point, (blocks, points), at least 10 blocks and a point.
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


Verdict = Literal["good", "too short", "not settled"]

FEWEST = 64  # values of a series that is judged at all
LOOKED_AT = 20  # batches
TREND = 0.6  # of Kendall's tau
REMEMBERED = 0.5  # correlation of a batch with the next one
RELAXATIONS = 40.0  # measured ones, which stand for 30: short records show correlation times a fifth too small
RELAXATIONS_OF_EVENTS = 100.0  # of figures of impacts
STOPPING_RELAXATIONS = 20.0
BURN_IN = 0.1  # share of a record that is left out at its start
LARGEST_BURN_IN = 1.0 / 3.0
BURN_IN_RELAXATIONS = 5.0


def burn_in(series: list[Array], decay: float = 0.0) -> int:
    """Return the number of values to leave out at the start: a tenth, at least 5 relaxation times, at most a third.

    Args:
        series: Of one record, each (n,); the slowest one counts.
        decay: A relaxation time that is known, in values.
    """
    count = len(series[0])
    rest = round(LARGEST_BURN_IN * count)
    slowest = max(decay, *(correlation_time(one[rest:]) for one in series))
    return min(max(round(BURN_IN * count), round(BURN_IN_RELAXATIONS * slowest)), rest)


def verdict_on(series: Array, rare: bool = False, relaxation: float | None = None) -> Verdict:
    """Return whether the interval of the mean of a series can be relied on.

    It is "not settled" where 20 batch means rise or fall: Kendall's tau beyond 0.6. It is "too short" where it has
    less than 40 relaxation times as measured (100 for rare events), a batch is much like the next one, or a batch is
    empty of rare events.

    Args:
        series: Values behind the burn-in, (n,).
        rare: Whether most values may be 0, such as forces of impacts.
        relaxation: Relaxation time of the slowest series of the record, in values; None: that of this one.
    """
    if len(series) < FEWEST:
        return "too short"
    means = batch_means(series, LOOKED_AT)
    if abs(kendall(means)) > TREND:
        return "not settled"
    slow = correlation_time(series) if relaxation is None else relaxation
    empty = rare and bool(np.any(batch_means(series, BATCHES) == 0.0)) and bool(np.any(series != 0.0))
    least = RELAXATIONS_OF_EVENTS if rare else RELAXATIONS
    if len(series) < least * slow or empty or next_correlation(means) > REMEMBERED:
        return "too short"
    return "good"


def kendall(values: Array) -> float:
    """Return Kendall's rank correlation of values, (k,), with their order, -1 to 1."""
    order = np.sign(values[None, :] - values[:, None])
    return float(order[np.triu_indices(len(values), 1)].mean())
