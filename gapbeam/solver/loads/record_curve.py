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
from gapbeam.solver.loads.load_table import Holes, RecordedTable
from gapbeam.solver.loads.record_file import FILE, TIME, RecordedRows, RecordError, read_record
from gapbeam.solver.system.operators import Array, Indices

ALIKE = 1.0e-9
"""By how much intervals differ that are equal but for the digits of their times."""
CLOSEST = 1.0e-13
"""Time between rows, of the span of a record; what is closer is round-off."""
WIDEST = 3.0
"""Median intervals between two rows, from which on a hole is between them."""
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
    return _curve(record, load.time_scale, load.interpolation, load.beyond == "repeat", load.holes)


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
    record: RecordedRows, time_scale: float, interpolation: Literal["cubic", "monotone"], closed: bool, fill: Holes
) -> RecordCurve:
    times = (record.times - record.times[0]) * time_scale
    values = record.values
    if closed:
        values = _closed(values)
    if float(np.min(np.diff(times))) <= CLOSEST * float(times[-1]):
        raise RecordError([_too_close(times)])
    holes = holes_between(times)
    if len(holes) and fill == "refuse":
        raise RecordError([_hole(times, float(record.times[0] * time_scale), holes)])
    try:
        with np.errstate(all="ignore"):
            if fill == "spline" or not len(holes):
                pieces = _pieces(times, values, interpolation, closed)
            else:
                pieces = _filled(times, values, holes, interpolation, straight=fill == "linear")
    except ValueError as error:  # numbers beyond what a computer can hold
        raise RecordError([_too_close(times)]) from error
    if not np.all(np.isfinite(pieces.c)):
        raise RecordError([_too_close(times)])
    return RecordCurve(pieces, float(record.times[0] * time_scale), record.checksum)


def holes_between(times: Array) -> Indices:
    """Return the rows, from 0, after which the next one is more than three median intervals away."""
    gaps = np.diff(times)
    return np.asarray(np.flatnonzero(gaps > WIDEST * float(np.median(gaps)) * (1.0 + ALIKE)))


def _pieces(times: Array, values: Array, interpolation: Literal["cubic", "monotone"], closed: bool) -> PPoly:
    """Return the curve through rows; a straight line through two."""
    if interpolation == "monotone":
        return PchipInterpolator(times, values)
    return CubicSpline(times, values, bc_type="periodic" if closed else "not-a-knot")


def _filled(
    times: Array, values: Array, holes: Indices, interpolation: Literal["cubic", "monotone"], straight: bool
) -> PPoly:
    """Return the curves through the rows between holes, with straight lines across these, or 0 in them."""
    coefficients = np.zeros((4, len(times) - 1))
    starts, ends = np.concatenate([[0], holes + 1]), np.concatenate([holes, [len(times) - 1]])
    for first, last in zip(starts, ends, strict=True):
        if last > first:
            rows = slice(first, last + 1)
            found = _pieces(times[rows], values[rows], interpolation, closed=False).c
            coefficients[4 - len(found) :, first:last] = found
    if straight:
        coefficients[2, holes] = (values[holes + 1] - values[holes]) / (times[holes + 1] - times[holes])
        coefficients[3, holes] = values[holes]
    return PPoly(coefficients, times)


def _hole(times: Array, first: float, holes: Indices) -> Fault:
    gaps = np.diff(times)
    row, median = int(holes[np.argmax(gaps[holes])]), float(np.median(gaps))
    more = f", and {len(holes) - 1} narrower ones" if len(holes) > 1 else ""
    found = (
        f"a hole of {gaps[row]:.6g} s after row {row + 1}, from {first + times[row]:.6g} to "
        f"{first + times[row + 1]:.6g} s, {gaps[row] / median:.3g} median intervals{more}"
    )
    expected = f"rows at most {WIDEST:g} median intervals of {median:.4g} s apart, or what acts in a hole"
    return Fault(FILE, found, expected, 'holes = "linear", "spline" or "zero" beside file')


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
