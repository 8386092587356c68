"""Statistics of a quantity over a part of a run, and the value of a figure.

Between records t_i the quantity x is a straight line. With n intervals h_i of the part, T = sum h_i, a_i and b_i the
values at the ends of an interval,

    mean     m = sum h_i (a_i + b_i) / (2 T)
    rms      s^2 = sum h_i (a_i^2 + a_i b_i + b_i^2) / (3 T), of x - m
    share    of the time above a limit L: sum h_i p_i / T, p_i the part of the line that is above L

The probability that x is above L within a time d is the share of the windows of length d whose largest value is. Its
95 % interval is that of k windows out of m, which count as independent.
Source: Clopper and Pearson, Biometrika 26 (1934) 404.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

Array = np.ndarray
CONFIDENCE = 0.95
_WHOLE = 1.0e-9


@dataclass(frozen=True)
class FigureValue:
    """The value of a figure.

    Attributes:
        name: Name of the figure.
        unit: SI unit; "1" for shares and probabilities.
        value: SI; None: it is not known.
        low: Lower end of the 95 % interval of a probability; None: the figure has none.
        high: Its upper end.
        at: Time of a maximum or minimum, s.
        reason: Why there is no value.
    """

    name: str
    unit: str
    value: float | None
    low: float | None = None
    high: float | None = None
    at: float | None = None
    reason: str = ""

    def as_data(self) -> dict[str, Any]:
        """Return the value for JSON, without what it has not."""
        return {key: value for key, value in vars(self).items() if value not in (None, "")} | {"value": self.value}


def extreme(blank: FigureValue, t: Array, x: Array, place: int, timed: bool) -> FigureValue:
    """Return a largest or smallest value with its time, or that time.

    Args:
        blank: The figure without its value.
        t: Times, s, (n,).
        x: Values, (n,).
        place: Place of the value.
        timed: Whether the figure is the time.
    """
    return replace(blank, value=float(t[place])) if timed else replace(blank, value=float(x[place]), at=float(t[place]))


def probability(blank: FigureValue, t: Array, x: Array, limit: float, duration: float) -> FigureValue:
    """Return the probability that a quantity is above a limit within a time, with its interval.

    Args:
        blank: The figure without its value.
        t: Times, s, (n,).
        x: Values, (n,).
        limit: The limit, in the unit of x.
        duration: The time, s.
    """
    count = int((t[-1] - t[0]) / duration * (1.0 + _WHOLE))
    if count < 1:
        return replace(blank, reason=f"the records have no window of {duration:g} s")
    edges = t[0] + duration * np.arange(count + 1)
    t, x = np.concatenate([t, edges]), np.concatenate([x, np.interp(edges, t, x)])
    ends = ((t[x > limit, None] >= edges[:-1]) & (t[x > limit, None] <= edges[1:])).any(axis=0)
    happened = scipy.stats.binomtest(int(ends.sum()), count)
    interval = happened.proportion_ci(CONFIDENCE)
    return replace(blank, value=float(happened.statistic), low=float(interval.low), high=float(interval.high))


def mean(t: Array, x: Array) -> float:
    """Return the mean over time."""
    return float(np.trapezoid(x, t) / (t[-1] - t[0])) if t[-1] > t[0] else float(x[-1])


def deviation(t: Array, x: Array) -> float:
    """Return the root mean square about the mean."""
    middle = mean(t, x)
    a, b = x[:-1] - middle, x[1:] - middle
    square = float(np.diff(t) @ (a * a + a * b + b * b)) / 3.0
    return float(np.sqrt(square / (t[-1] - t[0]))) if t[-1] > t[0] else 0.0


def share_above(t: Array, x: Array, limit: float) -> float:
    """Return the share of the time above a limit."""
    return float(np.diff(t) @ part_above(x, limit) / (t[-1] - t[0])) if t[-1] > t[0] else float(x[-1] > limit)


def part_above(x: Array, limit: float) -> Array:
    """Return the part of each interval in which a quantity, (n, ...), is above a limit, (n - 1, ...)."""
    low, high = np.minimum(x[:-1], x[1:]) - limit, np.maximum(x[:-1], x[1:]) - limit
    crossing = (high > 0.0) & (low < 0.0)
    whole = np.asarray(low >= 0.0, dtype=float) * (high > 0.0)
    return np.asarray(np.divide(high, high - low, out=whole, where=crossing))
