"""Block means of signals in constant memory, with their autocorrelation time and the share of missed impacts.

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
from typing import Any

import numpy as np

from gapbeam.solver.diagnostics.contact_episodes import DURATION, ImpactList

Array = np.ndarray

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
    def means(self) -> Array:
        """Means of the whole blocks, (blocks, signals)."""
        return np.asarray(self._sums[: self._whole] / self.length)

    @property
    def ends(self) -> Array:
        """Values at the ends of the whole blocks, (blocks, signals)."""
        return self._ends[: self._whole].copy()

    def add(self, values: Array) -> None:
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
        """Bring blocks, as they are at a start, to what was stored.

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
    def changes(self) -> Array:
        """Change of the sums over a record, mean over each whole block, (blocks, signals)."""
        return np.asarray(np.diff(self._ends[: self._whole + 1], axis=0) / self.length)

    def begin(self, sums: Array) -> None:
        """Take in the sums before the first block, (signals,)."""
        self._ends[0] = sums

    def add(self, sums: Array) -> None:
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
        """Bring blocks, as they are at a start, to what was stored.

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


def varies(series: Array) -> bool:
    """Return whether a series varies by more than round-off."""
    return bool(np.ptp(series) > STEADY * np.abs(series).max())


def correlation_time(series: Array, interval: float = 1.0) -> float:
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


def effective_samples(series: Array) -> float:
    """Return the number of independent samples with the same uncertainty of the mean as a series, (n,); at most n."""
    return len(series) / (2.0 * correlation_time(series))


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
