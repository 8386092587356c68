"""Whether a record is long enough, and has settled, for an interval of its means to hold.

Narrow intervals are the wrong ones on a short record: it has not yet seen how far the motion strays. Rules that look
for the end of a transient do more harm than good, so that a fixed share is left out.

Source: Kendall (1938), Biometrika 30, 81, for tau.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from gapbeam.solver.diagnostics.statistics.batch_interval import BATCHES, batch_means, next_correlation
from gapbeam.solver.diagnostics.statistics.correlation_time import correlation_time

Array = np.ndarray
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
    """Return how many values to leave out at the start: a tenth, at least 5 relaxation times, at most a third.

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
        series: What is left behind the burn-in, (n,).
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
