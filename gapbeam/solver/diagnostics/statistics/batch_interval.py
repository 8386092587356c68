"""The confidence interval of a mean over time, from the means of a few long batches.

    se^2 = (s_b^2 / b) (1 + r) / (1 - r),    r = clip(rho_1 + 1 / b, 0, 0.8)

with the standard deviation s_b of the means of b batches, and their correlation rho_1 from one to the next, whose bias
is -1 / b. Student's t with b - 1 degrees of freedom takes the standard error to an interval, which is even about the
logarithm of a figure that is positive.

Sources: Law and Kelton, Simulation Modeling and Analysis, chapter 9, for batch means; the correction of an AR(1)
process for what is left of the correlation is that of Fishman, Principles of Discrete Event Simulation (1978).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import exp, inf, sqrt

import numpy as np
from scipy.stats import t as student

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
    """Return how many standard errors an interval of a mean of batch means reaches to both sides."""
    return float(student.ppf(0.5 + 0.5 * confidence, batches - 1))


def interval_of_mean(
    series: Array, positive: bool = False, batches: int = BATCHES, confidence: float = CONFIDENCE
) -> Interval:
    """Return the mean of a series with its 95 % interval.

    Args:
        series: As in `batch_means`.
        positive: Whether the figure is positive by its meaning: the interval is then even about its logarithm.
        batches: Number of batches.
        confidence: Of the interval.
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
