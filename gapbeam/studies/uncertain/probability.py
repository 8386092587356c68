"""Probabilities and means with 95 % intervals, from random points or from the scatter of randomised replicates.

Subset simulation finds probabilities too small for plain sampling, level by level.
"""

from __future__ import annotations

from collections.abc import Callable
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


PART, WANTED, SPREAD, MOST_LEVELS = 0.1, 0.44, 0.6, 20
"""Share kept at a level; acceptance aimed at; first spread of proposals; levels after which a replicate gives up."""


@dataclass(frozen=True, eq=False)
class RareProbability:
    """Probability that a figure exceeds a limit, by subset simulation.

    Attributes:
        value: The estimate, the mean over replicates.
        low: Lower end of the 95 % interval.
        high: Upper end.
        replicates: Estimates of the replicates.
        thresholds: Of each level, the mean over replicates that came to it.
        members: Evaluations.
        failed: Share of evaluations without a figure: they count as below the limit.
        complete: Whether each replicate came to the limit.
    """

    value: float
    low: float
    high: float
    replicates: Array
    thresholds: Array
    members: int
    failed: float
    complete: bool


def subset_simulation(
    figure: Callable[[Array], Array], inputs: int, limit: float, members: int = 500, replicates: int = 20, seed: int = 0
) -> RareProbability:  # fmt: skip
    """Return the probability that a figure exceeds a limit.

    Each replicate samples the standard normal space, keeps the largest tenth, and continues from there by Markov
    chains conditional on that threshold; the probability is the product of the shares kept. The interval is
    by Student's t for the mean over replicates, on the logarithmic scale.

    Args:
        figure: Values (points,) at standard normal points, (points, inputs); NaN where there is none.
        inputs: Their number.
        limit: Of the figure.
        members: Of a level, in each replicate.
        replicates: Independent of each other; they march side by side.
        seed: Of the draws.

    Source: Au and Beck (2001), Prob. Eng. Mech. 16, 263; Papaioannou et al. (2015), Prob. Eng. Mech. 41, 89
    (conditional sampling with adaptive spread).
    """
    draw = np.random.default_rng(seed)
    counts = {"asked": 0, "failed": 0}

    def asked(points: Array) -> Array:
        y = figure(points.reshape(-1, inputs))
        counts["asked"] += y.size
        counts["failed"] += int(np.isnan(y).sum())
        return np.where(np.isnan(y), -np.inf, y).reshape(points.shape[:-1])

    U = draw.standard_normal((replicates, members, inputs))
    Y = asked(U)
    product: Array = np.ones(replicates)
    open_ = np.ones(replicates, dtype=bool)
    spread, found = np.full(replicates, SPREAD), np.zeros(replicates)
    levels: list[float] = []
    kept = max(round(PART * members), 1)
    for _ in range(MOST_LEVELS):
        over = (limit < Y).mean(axis=1)
        done = open_ & (over >= PART)
        found[done] = product[done] * over[done]
        open_ &= ~done
        threshold = np.sort(Y, axis=1)[:, members - kept - 1]
        share = (threshold[:, None] < Y).mean(axis=1)  # less than a tenth where several are equal
        last = open_ & ((share == 0.0) | ~np.isfinite(threshold))
        found[last] = product[last] * over[last]
        stuck = last & (over == 0.0)
        open_ &= ~last
        if not open_.any():
            return _result(found, levels, counts, complete=not stuck.any())
        levels.append(float(threshold[open_].mean()))
        product = np.where(open_, product * share, product)
        U[open_], Y[open_], spread[open_] = _conditional(
            U[open_], Y[open_], threshold[open_], spread[open_], kept, asked, draw
        )
    return _result(found, levels, counts, complete=False)


def _conditional(
    U: Array, Y: Array, threshold: Array, spread: Array, kept: int, asked: Callable[[Array], Array],
    draw: np.random.Generator,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return as many members above the threshold, by chains from those that are: (replicates, members, inputs)."""
    R, members, d = U.shape
    order = np.argsort(-Y, axis=1)
    above = (threshold[:, None] < Y).sum(axis=1)
    seeds = np.array([np.resize(draw.permutation(one[:many]), kept) for one, many in zip(order, above, strict=True)])
    rows = np.arange(R)[:, None]
    u, y = U[rows, seeds], Y[rows, seeds]
    chain, heights = [u], [y]
    scale = U.std(axis=1, keepdims=True)
    for number in range(1, -(-members // kept)):
        step = np.minimum(spread[:, None, None] * scale, 1.0)
        moved = np.sqrt(1.0 - step**2) * u + step * draw.standard_normal((R, kept, d))
        tried = asked(moved)
        accepted = tried > threshold[:, None]
        u, y = np.where(accepted[..., None], moved, u), np.where(accepted, tried, y)
        spread = spread * np.exp((accepted.mean(axis=1) - WANTED) / np.sqrt(number))
        chain.append(u)
        heights.append(y)
    return np.concatenate(chain, axis=1)[:, :members], np.concatenate(heights, axis=1)[:, :members], spread


def _result(found: Array, levels: list[float], counts: dict[str, int], complete: bool) -> RareProbability:
    mean, half = mean_and_half_width(found)
    wide = np.exp(half / mean) if mean > 0.0 else np.inf
    return RareProbability(
        mean, mean / wide if mean > 0.0 else 0.0, min(mean * wide, 1.0) if mean > 0.0 else float("nan"), found,
        np.array(levels), counts["asked"], counts["failed"] / counts["asked"], complete,
    )  # fmt: skip
