"""The frequencies that carry the kinetic energy of a motion, from recorded velocities.

The power spectra of all signals, v v by Hann windows over segments that overlap by half, are added up. A hundred
frequencies, each of which stands for a hundredth of the energy, represent the sum. Motion along the beam and across it
are waves of different lengths: each kind has the frequency above which it carries less than half a hundredth of all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gapbeam.solver.system.operators import Array

SEGMENT = 8192  # records
PARTS = 100
FEWEST = 16  # records; fewer show no frequency
DEPTH = 1e-6  # of the interval, by which records may be unevenly spaced


@dataclass(frozen=True)
class FrequencyContent:
    """Distribution of the energy over frequencies.

    Attributes:
        frequencies: Each stands for a hundredth of the energy, rising, (100,), Hz.
        along: Highest frequency of motion along the beam, Hz; 0: it carries next to nothing.
        across: The same of motion across the beam; None: that of all motion.
    """

    frequencies: Array
    along: float = 0.0
    across: float | None = None

    @property
    def middle(self) -> float:
        """Half of the energy lies below, Hz."""
        return float(self.frequencies[PARTS // 2])

    @property
    def highest(self) -> float:
        """All but a hundredth of the energy lies below, Hz."""
        return float(self.frequencies[-1])

    @property
    def bending(self) -> float:
        """Highest frequency of motion across the beam, Hz; 0: it carries next to nothing."""
        return self.highest if self.across is None else self.across


class Recorded(Protocol):
    """Records in memory or in a file, (records, ...), read a part at a time."""

    def __getitem__(self, part: slice, /) -> Array:
        """Return part of the records."""


def content_of_motion(times: Array, velocity: Recorded) -> FrequencyContent | None:
    """Return the energy content of recorded velocities; None where nothing moves, or with too few records.

    Args:
        times: Of the records, s; what comes after the first uneven interval is left out.
        velocity: (records, ..., components), m/s, the component along the beam first.
    """
    intervals = np.diff(times)
    if len(times) < FEWEST:
        return None
    interval = float(np.median(intervals))
    even = np.flatnonzero(np.abs(intervals - interval) > DEPTH * interval)
    count = int(even[0]) + 1 if len(even) else len(times)  # the last record may come early
    if count < FEWEST:
        return None
    power: Array = np.zeros((2, 1))
    for taken in segments(count):
        part = np.asarray(velocity[taken])
        kinds = part[..., :1], part[..., 1:]
        power = power + [power_of(kind.reshape(len(part), -1)) for kind in kinds]
    return content_of(power, interval, 2 * (power.shape[1] - 1) + (min(count, taken.stop - taken.start) % 2))


def segments(count: int) -> Iterator[slice]:
    """Yield the segments of so many records, the last one up to the last record."""
    if count <= SEGMENT:
        yield slice(0, count)
        return
    half = SEGMENT // 2
    for first in range(0, count - SEGMENT, half):
        yield slice(first, first + SEGMENT)
    yield slice(count - SEGMENT, count)


def power_of(velocities: Array) -> Array:
    """Return the power of a segment without its mean, (records / 2 + 1,), of velocities (records, signals)."""
    window = np.hanning(len(velocities) + 2)[1:-1, None]
    moved = velocities - np.mean(velocities, axis=0)
    return np.asarray(np.sum(np.abs(np.fft.rfft(window * moved, axis=0)) ** 2, axis=1))


def content_of(power: Array, interval: float, records: int) -> FrequencyContent | None:
    """Return the content of a spectrum; None where nothing moves.

    Args:
        power: Sums of `power_of` over segments, of motion along the beam and across it, (2, lines).
        interval: Time between records, s.
        records: Of a segment.
    """
    lines = np.arange(1, power.shape[1]) / (records * interval)
    sums = np.cumsum(power.sum(axis=0)[1:])
    if not len(sums) or not np.isfinite(sums[-1]) or sums[-1] <= 0.0:
        return None
    wanted = (np.arange(PARTS) + 0.5) / PARTS * sums[-1]
    tails = power[:, :0:-1].cumsum(axis=1)[:, ::-1]  # of the energy at a line and above it
    carrying = [lines[kind >= 0.5 / PARTS * sums[-1]] for kind in tails]
    along, across = (float(kind[-1]) if len(kind) else 0.0 for kind in carrying)
    return FrequencyContent(lines[np.searchsorted(sums, wanted)], along, across)
