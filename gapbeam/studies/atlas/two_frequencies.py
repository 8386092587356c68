"""Motions of two frequencies that never repeat: quasi-periodic motions, by the lines of their spectrum.

Such a motion is a sum of harmonics at all combinations k f + l g of two frequencies. These lines are fitted to the
first half of a record and must predict the second half. They do not where a motion is chaotic, still settles, or has a
third frequency. Strobes of a load have its frequency no more: their lines are at l g.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import pi
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from gapbeam.solver.system.operators import Array

ORDERS = {1: (1, 3, 8, 20), 2: (1, 2, 4, 8)}
"""Highest |k| + |l| of the lines, by number of frequencies: those of each fit start from the fit before."""
PREDICTED, LEAST, TRIED = 0.1, 1e-3, 4
"""Error of the prediction over what one frequency leaves; the least of that, over the motion; lines that are tried."""
LINE, SIZE = 0.1, 1e-2
"""Distances of frequencies, in lines of the record, and of sizes, over the largest, at which two motions are one."""
WHOLE, LOCKED = 20, 0.1
"""A ratio of whole numbers up to 20 between frequencies, to a tenth of a line of the record: they are locked."""


class TwoFrequencies(NamedTuple):
    """A quasi-periodic motion.

    Attributes:
        frequencies: Per sample, both of a free motion, or the one beside the load.
        sizes: Sizes of the lines in all motions together, with the mean.
        error: Error of the predicted half, over what one frequency leaves.
    """

    frequencies: tuple[float, ...]
    sizes: Array
    error: float

    def number_among(self, others: Iterable[tuple[int, TwoFrequencies]], line: float, new: int) -> int:
        """Return the number of the motion that is this one, at another phase; a new number where none is.

        Args:
            others: Motions with their numbers.
            line: Width of a line of the record, as frequencies are given.
            new: The new number.
        """
        same = (number for number, other in others if self.is_same(other, LINE * line, SIZE))
        return next(same, new)

    def is_same(self, other: TwoFrequencies, lines: float, part: float) -> bool:
        """Return whether two records are of one motion, at other phases.

        Args:
            other: The other one.
            lines: Largest distance of frequencies.
            part: Largest distance of sizes, over the largest.
        """
        close = np.abs(np.subtract(self.frequencies, other.frequencies)).max() <= lines
        return bool(close and np.abs(self.sizes - other.sizes).max() <= part * other.sizes.max())


def two_frequencies(record: Array, scale: float, *, driven: bool) -> TwoFrequencies | None:
    """Return the two frequencies of a motion; None where its lines do not predict it, or one frequency does.

    Args:
        record: Samples at even times, (samples, motions), in one unit.
        scale: Scale of the motion, in this unit.
        driven: Samples are strobes of a load, whose frequency is one of both.
    """
    if not np.isfinite(record).all():
        return None
    half = len(record) // 2
    first, second = record[:half], record[half : 2 * half]
    free = first - first.mean(axis=0)
    known = () if driven else _refined(first, _strongest(free)[:1], ORDERS[1])
    left = first - _lines(half, known, ORDERS[1][-1], first)[0] if known else free
    remains = float(np.sqrt((left**2).sum(axis=1).mean()))
    if not remains > LEAST * scale:
        return None
    for g in _strongest(left):
        found = _refined(first, [*known, g], ORDERS[len(known) + 1])
        order = ORDERS[len(found)][-1]
        fitted, sizes = _lines(2 * half, found, order, first)
        error = float(np.sqrt(((fitted[half:] - second) ** 2).sum(axis=1).mean())) / remains
        if error <= PREDICTED:
            return None if _locked(found, half) else TwoFrequencies(found, sizes, error)
    return None


def _strongest(signal: Array) -> list[float]:
    """Return the frequencies of the strongest lines per sample, the strongest first."""
    count = len(signal)
    power = (np.abs(np.fft.rfft(np.hanning(count)[:, None] * signal, 4 * count, axis=0)) ** 2).sum(axis=1)
    peaks = find_peaks(power)[0]
    peaks = peaks[np.argsort(-power[peaks])][:TRIED]
    below, here, above = (np.log(np.maximum(power[peaks + k], 1e-300)) for k in (-1, 0, 1))
    found: list[float] = ((peaks + 0.5 * (below - above) / (below - 2.0 * here + above)) / (4.0 * count)).tolist()
    return found


def _combinations(frequencies: Sequence[float], order: int) -> Array:
    """Return the frequencies of all lines up to an order, each once, 0 first."""
    places = [one for one in product(range(-order, order + 1), repeat=len(frequencies))
              if sum(map(abs, one)) <= order and one >= (0,) * len(one)]  # fmt: skip
    found: Array = np.array(places, dtype=float) @ np.asarray(frequencies)
    return found


def _lines(samples: int, frequencies: Sequence[float], order: int, signal: Array) -> tuple[Array, Array]:
    """Return lines fitted to a signal, over so many samples, and the size of each."""
    turns = 2.0 * pi * np.outer(np.arange(samples), _combinations(frequencies, order))
    columns = np.hstack([np.cos(turns), np.sin(turns[:, 1:])])
    weights = np.linalg.lstsq(columns[: len(signal)], signal, rcond=1e-3)[0]
    squares = (weights**2).sum(axis=1)
    lines = turns.shape[1]
    sizes = np.sqrt(squares[:lines] + np.concatenate([[0.0], squares[lines:]]))
    return columns @ weights, sizes


def _refined(signal: Array, frequencies: Sequence[float], orders: Sequence[int]) -> tuple[float, ...]:
    """Return frequencies whose lines leave least of a signal."""
    count = len(signal)
    size = np.sqrt((signal**2).sum())
    found = count * np.asarray(frequencies)
    for order in orders:

        def left(x: Any, order: int = order) -> Array:
            return np.asarray(np.ravel(signal - _lines(count, x / count, order, signal)[0]) / size, dtype=float)

        found = least_squares(left, found, x_scale=0.1, max_nfev=12).x
    return tuple(float(one) for one in found / count)


def _locked(frequencies: tuple[float, ...], samples: int) -> bool:
    """Return whether frequencies, or one and the sampling, are in a ratio of whole numbers, as far as samples show."""
    f, g = frequencies if len(frequencies) == 2 else (1.0, frequencies[0])
    whole = np.arange(1, WHOLE + 1)
    apart = np.abs(np.subtract.outer(whole * f, whole * g))
    return bool(apart.min() <= LOCKED / samples)
