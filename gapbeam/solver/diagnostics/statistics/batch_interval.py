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

Block means of signals in constant memory, with their autocorrelation time and the share of missed impacts.

A block holds as many records as all others. Where there is no room for another block, neighbors are joined in pairs and
the length doubles. The sums are formed record by record, so that they do not depend on how many records come at once.

Of signals that are recorded as sums over time only the sums at the ends of blocks are kept, so that a record costs next
to nothing; where there is no room for another block, every second end goes.

The integrated autocorrelation time says how many independent samples a motion holds,

    tau = h (1/2 + sum_{k >= 1} rho_k),    n_eff = T / (2 tau)

The sum ends where k reaches 5 times what it has come to. A process whose correlation is exp(-t / tau), such as that of
Ornstein and Uhlenbeck, has the relaxation time tau.

Source: Sokal, Monte Carlo Methods in Statistical Mechanics (1997), section 3, for the window.

Impacts that are shorter than a step may be missed. A face is looked at once a step h. A touch of duration d < h is seen
with the probability d / h, and so is a parting of that duration between two touches, which are otherwise counted as
one. Where durations are spread evenly below h,

    missed = integral of (1 - d / h) dd = h / 2 = integral of (d / h) dd = seen:

as many are missed as are seen to be shorter than a step. A contact of one spring and one mass has no touch that is much
shorter than half its period; fast modes of a beam make some at any step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import exp, inf, sqrt
from typing import Any, Literal

import numpy as np
import scipy

from gapbeam.solver.diagnostics.contact_episodes import DURATION, ImpactList

MOST = 2048  # blocks; even


class BlockMeans:
    """Means over blocks, and the value at the end of each.

    Args:
        signals: Number of signals.

    Attributes:
        length: Records in a block.
    """

    def __init__(self, signals: int) -> None:
        self.length = 1
        self._signals = signals
        self._sums = np.zeros((MOST, signals))
        self._ends = np.zeros((MOST, signals))
        self._whole = 0
        self._sum, self._waiting = np.zeros(signals), 0

    @property
    def records(self) -> int:
        """Records so far."""
        return self._whole * self.length + self._waiting

    @property
    def means(self) -> np.ndarray:
        """Means of the whole blocks, (blocks, signals)."""
        return np.asarray(self._sums[: self._whole] / self.length)

    @property
    def ends(self) -> np.ndarray:
        """Values at the ends of the whole blocks, (blocks, signals)."""
        return self._ends[: self._whole].copy()

    def add(self, values: np.ndarray) -> None:
        """Take in records, (records, signals)."""
        first = 0
        while first < len(values):
            taken = values[first : first + self.length - self._waiting]
            first += len(taken)
            self._waiting += len(taken)
            self._sum = np.add.accumulate(np.vstack([self._sum, taken]), axis=0)[-1]
            if self._waiting == self.length:
                self._sums[self._whole], self._ends[self._whole] = self._sum, taken[-1]
                self._whole, self._waiting, self._sum = self._whole + 1, 0, np.zeros(self._signals)
                if self._whole == MOST:
                    self._join()

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        return {
            "length": self.length,
            "waiting": self._waiting,
            "sum": self._sum.tolist(),
            "sums": self._sums[: self._whole].tolist(),
            "ends": self._ends[: self._whole].tolist(),
        }

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore new blocks from a checkpoint.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        whole = len(data["sums"])
        length, waiting = int(data["length"]), int(data["waiting"])
        parts = [np.array(data[key], dtype=float).reshape(whole, self._signals) for key in ("sums", "ends")]
        rest = np.array(data["sum"], dtype=float).reshape(self._signals)
        if not (0 <= waiting < length and whole < MOST and all(np.all(np.isfinite(part)) for part in (*parts, rest))):
            raise ValueError(f"{whole} blocks of {length} records and {waiting} more, expected finite means of such")
        self.length, self._waiting, self._whole, self._sum = length, waiting, whole, rest
        self._sums[:whole], self._ends[:whole] = parts

    def _join(self) -> None:
        half = MOST // 2
        self._sums[:half] = self._sums[0::2] + self._sums[1::2]
        self._ends[:half] = self._ends[1::2]
        self._whole, self.length = half, 2 * self.length


class BlockEnds:
    """Sums at the ends of blocks of equal length.

    Args:
        signals: Number of signals.
        most: Number of blocks for which there is room; even.

    Attributes:
        length: Records in a block.
    """

    def __init__(self, signals: int, most: int) -> None:
        self.length = 1
        self._signals, self._most = signals, most
        self._ends = np.zeros((most + 1, signals))  # the first one is that before all blocks
        self._whole, self._waiting = 0, 0

    @property
    def changes(self) -> np.ndarray:
        """Change of the sums over a record, mean over each whole block, (blocks, signals)."""
        return np.asarray(np.diff(self._ends[: self._whole + 1], axis=0) / self.length)

    def begin(self, sums: np.ndarray) -> None:
        """Take in the sums before the first block, (signals,)."""
        self._ends[0] = sums

    def add(self, sums: np.ndarray) -> None:
        """Take in records of the sums, (records, signals)."""
        first = 0
        while True:
            missing = self.length - self._waiting
            blocks = max(0, (len(sums) - first - missing) // self.length + 1)
            taken = min(blocks, self._most - self._whole)
            if taken == 0:
                self._waiting += len(sums) - first
                return
            ends = first + missing - 1 + self.length * np.arange(taken)
            self._ends[self._whole + 1 : self._whole + 1 + taken] = sums[ends]
            self._whole, self._waiting, first = self._whole + taken, 0, int(ends[-1]) + 1
            if self._whole == self._most:
                half = self._most // 2
                self._ends[: half + 1] = self._ends[0::2]
                self._whole, self.length = half, 2 * self.length

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        return {"length": self.length, "waiting": self._waiting, "ends": self._ends[: self._whole + 1].tolist()}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore new blocks from a checkpoint.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        whole, length, waiting = len(data["ends"]) - 1, int(data["length"]), int(data["waiting"])
        ends = np.array(data["ends"], dtype=float).reshape(whole + 1, self._signals)
        if not (0 <= waiting < length and 0 <= whole < self._most and np.all(np.isfinite(ends))):
            raise ValueError(f"{whole} blocks of {length} records and {waiting} more, expected finite sums of such")
        self.length, self._waiting, self._whole = length, waiting, whole
        self._ends[: whole + 1] = ends


WINDOW = 5.0


STEADY = 1e-8
"""Range of a series over its largest value that is round-off of long sums: such a series does not vary."""


def varies(series: np.ndarray) -> bool:
    """Return whether a series varies by more than round-off."""
    return bool(np.ptp(series) > STEADY * np.abs(series).max())


def correlation_time(series: np.ndarray, interval: float = 1.0) -> float:
    """Return the integrated autocorrelation time of a series, s; at least half an interval, as of one that is steady.

    Args:
        series: Values at even distances in time, or their means over blocks, (n,).
        interval: Distance in time, s.
    """
    if not varies(series):
        return 0.5 * interval
    parts = series - np.mean(series)
    count = len(parts)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.fft.rfft(parts, size)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum), size)[:count]
    if correlation[0] <= 0.0:
        return 0.5 * interval
    sums = np.cumsum(correlation / correlation[0]) - 0.5
    wide = np.flatnonzero(np.arange(count) >= WINDOW * sums)
    found = sums[wide[0]] if len(wide) else sums[-1]
    return float(max(found, 0.5)) * interval


MOST_MISSED = 0.03  # of the impacts; beyond, an interval on their rate does not hold what steps leave out


def missed_share(impacts: ImpactList, step: float) -> float:
    """Return about how many impacts were missed, over those that were seen; 0 where there were none.

    Args:
        impacts: Impacts of a face.
        step: s.
    """
    durations = impacts.rows[:, DURATION]
    if not len(durations):
        return 0.0
    return float(np.sum(durations < step) + np.sum(impacts.partings < step)) / len(durations)


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


def batch_means(series: np.ndarray, batches: int) -> np.ndarray:
    """Return the means of batches of equal length, (batches,); a rest at the start is left out.

    Args:
        series: Values at even distances in time, or their means over blocks of equal length, (n,), n >= batches.
        batches: Number of batches.
    """
    length = len(series) // batches
    return np.asarray(series[len(series) - batches * length :].reshape(batches, length).mean(axis=1))


def next_correlation(means: np.ndarray) -> float:
    """Return the correlation of means, (b,), from one to the next; 0 where all are the same."""
    parts = means - means.mean()
    square = float(parts @ parts)
    return float(parts[1:] @ parts[:-1]) / square if square > 0.0 else 0.0


def standard_error(means: np.ndarray) -> float:
    """Return the standard error of the mean of batch means, (b,)."""
    count = len(means)
    r = min(max(next_correlation(means) + 1.0 / count, 0.0), LARGEST_CORRELATION)
    return sqrt(float(np.var(means, ddof=1)) / count * (1.0 + r) / (1.0 - r))


@cache
def quantile(confidence: float, batches: int) -> float:
    """Return the half-width of an interval of a mean of batch means, in standard errors."""
    return float(scipy.stats.t.ppf(0.5 + 0.5 * confidence, batches - 1))


def interval_of_mean(
    series: np.ndarray, positive: bool = False, batches: int = BATCHES, confidence: float = CONFIDENCE
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


def stopping_interval(series: np.ndarray, positive: bool = False) -> Interval:
    """Return the widest of the intervals from 8, 10, 16 and 32 batches, for a stop rule that is asked often."""
    found = (interval_of_mean(series, positive, batches) for batches in STOPPING_BATCHES)
    return max(found, key=lambda one: one.half_width)


def interval_of_percentile(samples: np.ndarray, share: float) -> Interval:
    """Return the value below which a share of a motion lies, with its 95 % interval.

    The interval of the share of values below it is that of a mean; the order statistics at its ends are the interval
    of the percentile.

    Args:
        samples: Values at even distances in time, (n,).
        share: Share of the percentile, between 0 and 1.
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
        interval: Mean of this point, and the 95 % interval of the largest true mean.
        elsewhere: Mean at places that other batches chose.
        points: Number of points.
    """

    point: int
    interval: Interval
    elsewhere: float
    points: int


def largest_of_map(series: np.ndarray) -> LargestOfMap:
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


def _ends(series: np.ndarray, confidence: float) -> Interval:
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


def burn_in(series: list[np.ndarray], decay: float = 0.0) -> int:
    """Return the number of values to leave out at the start: a tenth, at least 5 relaxation times, at most a third.

    Args:
        series: Series of one record, each (n,); the slowest one counts.
        decay: A relaxation time that is known, in values.
    """
    count = len(series[0])
    rest = round(LARGEST_BURN_IN * count)
    slowest = max(decay, *(correlation_time(one[rest:]) for one in series))
    return min(max(round(BURN_IN * count), round(BURN_IN_RELAXATIONS * slowest)), rest)


def verdict_on(series: np.ndarray, rare: bool = False, relaxation: float | None = None) -> Verdict:
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


def kendall(values: np.ndarray) -> float:
    """Return Kendall's rank correlation of values, (k,), with their order, -1 to 1."""
    order = np.sign(values[None, :] - values[:, None])
    return float(order[np.triu_indices(len(values), 1)].mean())
