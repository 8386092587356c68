"""The curve between the rows of a record, and what it holds: its peak, its spectrum.

Schemes of order 2 need a load that is smooth between its rows, and a base motion given as a displacement needs its
second derivative: the cubic spline is twice continuously differentiable, and its error is of order 4. It overshoots at
jumps, where piecewise cubics that keep the data monotone (order 2 at peaks, one continuous derivative) do not.

Source: de Boor, A Practical Guide to Splines (1978); Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

from gapbeam.solver.faults import Fault
from gapbeam.solver.loads.record_file import FILE, TIME, RecordedRows, RecordError, read_record
from gapbeam.solver.loads.recorded_table import RecordedTable
from gapbeam.solver.system.operators import Array

CLOSEST = 1.0e-13
"""Time between rows, of the span of a record; what is closer is round-off."""
CLOSED = 1.0e-2
"""How far the ends of a record that is repeated may be apart, of the range of its values."""


@dataclass(frozen=True)
class Content:
    """How the power of a curve is spread over frequencies.

    Attributes:
        frequencies: Hz, ascending, (bins,).
        shares: Share of the power up to each of them, (bins,).
    """

    frequencies: Array
    shares: Array

    def below(self, share: float) -> float:
        """Return the frequency below which a share of the power lies, Hz."""
        return float(self.frequencies[min(int(np.searchsorted(self.shares, share)), len(self.shares) - 1)])

    def above(self, frequency: float) -> float:
        """Return the share of the power above a frequency."""
        place = np.searchsorted(self.frequencies, frequency, side="right") - 1
        return float(1.0 - self.shares[place])


@dataclass(frozen=True, eq=False)
class RecordCurve:
    """A curve through the rows of a record.

    Attributes:
        pieces: x(t), t in s from the first row.
        first: Time of the first row, s.
        checksum: SHA-256 of the file.
    """

    pieces: PPoly
    first: float
    checksum: str

    @property
    def knots(self) -> Array:
        """Times of the rows from the first, s, (rows,)."""
        return np.asarray(self.pieces.x)

    @property
    def span(self) -> float:
        """From the first row to the last, s."""
        return float(self.knots[-1])

    @property
    def interval(self) -> float:
        """Mean time between rows, s."""
        return self.span / (len(self.knots) - 1)

    @cached_property
    def mean(self) -> float:
        """Mean over the span, in the unit of the values."""
        return float(self.pieces.integrate(0.0, self.span)) / self.span

    @cached_property
    def overshoot(self) -> float:
        """How far the curve goes beyond its rows, relative to the range of their values."""
        at_rows, between = self.pieces(self.knots), self.pieces(self.middles)
        beyond = max(float(between.max() - at_rows.max()), float(at_rows.min() - between.min()), 0.0)
        return beyond / float(np.ptp(at_rows)) if np.ptp(at_rows) > 0.0 else 0.0

    @property
    def middles(self) -> Array:
        """Times halfway between rows, s, (rows - 1,)."""
        return np.asarray(0.5 * (self.knots[1:] + self.knots[:-1]))


def curve_of(load: RecordedTable) -> RecordCurve:
    """Return the curve of a recorded load, before scaling; the same one as long as its file does not change.

    Raises:
        RecordError: The file cannot be used, or is another one than its checksum says.
    """
    record = read_record(load.file, load.time_column, load.value_column)
    if load.checksum is not None and load.checksum.lower() != record.checksum:
        found = f"a file with the SHA-256 {record.checksum}"
        hint = "the file has changed since; remove checksum to take it as it is"
        raise RecordError([Fault(FILE, found, f"{load.checksum}, as checksum says", hint)])
    return _curve(record, load.time_scale, load.interpolation, load.beyond == "repeat")


@lru_cache(maxsize=32)
def extremes(curve: RecordCurve, derivative: int) -> tuple[float, float]:
    """Return the least and the largest value of a derivative of a curve, at and between its rows."""
    places = np.concatenate([curve.knots, curve.middles])
    values = curve.pieces(places, nu=derivative)
    return float(values.min()), float(values.max())


@lru_cache(maxsize=32)
def content(curve: RecordCurve, derivative: int) -> Content:
    """Return how the power of a derivative of a curve is spread up to half its mean sampling rate; without its mean."""
    rows = len(curve.knots)
    values = curve.pieces(np.linspace(0.0, curve.span, rows), nu=derivative)
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(rows)))
    power = np.cumsum((spectrum / max(float(spectrum.max()), 1.0e-300)) ** 2)
    shares = power / power[-1] if power[-1] > 0.0 else np.ones(len(power))
    return Content(np.asarray(np.fft.rfftfreq(rows, curve.interval), dtype=float), shares)


@lru_cache(maxsize=8)
def _curve(
    record: RecordedRows, time_scale: float, interpolation: Literal["cubic", "monotone"], closed: bool
) -> RecordCurve:
    times = (record.times - record.times[0]) * time_scale
    values = record.values
    if closed:
        values = _closed(values)
    if float(np.min(np.diff(times))) <= CLOSEST * float(times[-1]):
        raise RecordError([_too_close(times)])
    try:
        with np.errstate(all="ignore"):
            pieces: PPoly
            if interpolation == "monotone":
                pieces = PchipInterpolator(times, values)
            else:
                pieces = CubicSpline(times, values, bc_type="periodic" if closed else "not-a-knot")
    except ValueError as error:  # numbers beyond what a computer can hold
        raise RecordError([_too_close(times)]) from error
    if not np.all(np.isfinite(pieces.c)):
        raise RecordError([_too_close(times)])
    return RecordCurve(pieces, float(record.times[0] * time_scale), record.checksum)


def _too_close(times: Array) -> Fault:
    gaps = np.diff(times)
    row = int(np.argmin(gaps))
    found = f"{gaps[row]:.3g} s between rows {row + 1} and {row + 2}, of {times[-1]:.3g} s in all"
    return Fault(TIME, found, "times that are far enough apart for a curve between the rows")


def _closed(values: Array) -> Array:
    """Return the values with the first one again in the last row."""
    jump = abs(float(values[-1] - values[0]))
    if jump > CLOSED * float(np.ptp(values)):
        found = f'{values[0]:g} in the first row and {values[-1]:g} in the last, with beyond = "repeat"'
        hint = "end the file one row after a whole number of periods, with the value of the first row"
        raise RecordError([Fault(FILE, found, "the same value: the last row is the first of the next round", hint)])
    return np.append(values[:-1], values[0])
