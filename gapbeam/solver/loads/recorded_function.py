"""Recorded functions of time, with a smooth start, and the curve between the rows of a record.

    q(t) = r(t) (scale (x(start + t) - mean) + offset)

x is the curve through the rows of the record, r the ramp (`loads.time_function`), mean the mean of
x over the record or 0. What acts on the beam is s = q for forces, and the derivative 0, 1 or 2 of q for the
acceleration of the support from a recorded acceleration, velocity or displacement. Nothing is integrated in time: the
equations are those in the frame of the support, where only its acceleration acts. Before the first row and after the
last, s is 0, or the record again.

Peak and spectrum of a record are those of its curve. Schemes of order 2 need a load that is smooth between its rows,
and a base motion given as a displacement needs its second derivative: the cubic spline is twice continuously
differentiable, and its error is of order 4. It overshoots at jumps, where piecewise cubics that keep the data monotone
(order 2 at peaks, one continuous derivative) do not.

Source: de Boor, A Practical Guide to Splines (1978); Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import ceil
from typing import Any, Literal

import numpy as np
import scipy

from gapbeam.solver.loads.load_table import Holes, RecordedTable
from gapbeam.solver.loads.record_file import FILE, TIME, RecordedRows, RecordError, read_record
from gapbeam.solver.loads.time_function import Times, piecewise_mean, ramped
from gapbeam.solver.messages.errors import Fault, UserError
from gapbeam.solver.system.operators import Array, Indices

ALIKE = 1.0e-9
"""Relative difference of intervals that are equal except for the digits of their times."""
CLOSEST = 1.0e-13
"""Time between rows, of the span of a record; what is closer is round-off."""
WIDEST = 3.0
"""Median intervals between two rows, from which on a hole is between them."""
CLOSED = 1.0e-2
"""Largest jump from the end to the start of a record that is repeated, over the range of its values."""

MOST = 1 << 20
"""Samples of a spectrum, where rows are closer than the span over it."""


@dataclass(frozen=True)
class Content:
    """Distribution of the power of a curve over frequencies.

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

    pieces: scipy.interpolate.PPoly
    first: float
    checksum: str

    @property
    def knots(self) -> Array:
        """Times of the rows from the first, s, (rows,)."""
        return np.asarray(self.pieces.x)

    @property
    def span(self) -> float:
        """Duration from the first row to the last, s."""
        return float(self.knots[-1])

    @property
    def interval(self) -> float:
        """Mean time between rows, s."""
        return self.span / (len(self.knots) - 1)

    @property
    def closest(self) -> float:
        """Shortest time between rows, s."""
        return float(np.diff(self.knots).min())

    @cached_property
    def mean(self) -> float:
        """Mean over the span, in the unit of the values."""
        return float(self.pieces.integrate(0.0, self.span)) / self.span

    @cached_property
    def overshoot(self) -> float:
        """Overshoot of the curve beyond its rows, relative to the range of their values."""
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
        hint = "the file has changed since; remove checksum to accept the new one"
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
    """Return the spectrum of a derivative of a curve, without its mean, up to half the rate of its closest rows.

    The curve is continued by its mirror image, without a jump at its ends: pulses count wherever they lie.
    """
    count = min(ceil(curve.span / curve.closest * (1.0 - ALIKE)), MOST)
    values = curve.pieces(np.linspace(0.0, curve.span, count + 1), nu=derivative)
    spectrum = np.append(0.0, np.abs(scipy.fft.dct(values - values.mean(), type=1)[1:]))
    power = np.cumsum((spectrum / max(float(spectrum.max()), 1.0e-300)) ** 2)
    shares = power / power[-1] if power[-1] > 0.0 else np.ones(count + 1)
    return Content(np.asarray(0.5 * np.arange(count + 1) / curve.span, dtype=float), shares)


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


def _pieces(
    times: Array, values: Array, interpolation: Literal["cubic", "monotone"], closed: bool
) -> scipy.interpolate.PPoly:
    """Return the curve through rows; a straight line through two."""
    if interpolation == "monotone":
        return scipy.interpolate.PchipInterpolator(times, values)
    return scipy.interpolate.CubicSpline(times, values, bc_type="periodic" if closed else "not-a-knot")


def _filled(
    times: Array, values: Array, holes: Indices, interpolation: Literal["cubic", "monotone"], straight: bool
) -> scipy.interpolate.PPoly:
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
    return scipy.interpolate.PPoly(coefficients, times)


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


MOST_POWER = 0.99
"""Share of the power of a record that makes its frequencies of interest."""
ROUNDING = 1.0e-6
"""Share of the span of a record by which a run may pass its ends."""


@dataclass(frozen=True)
class RecordedSignal:
    """A recorded function of time.

    Attributes:
        name: Name of the load.
        curve: x, of time from the first row.
        shift: Time from the first row at which the run starts, s.
        scale: Factor of x.
        constant: Offset added to that, less the mean.
        ramp: Duration of the smooth start, s.
        beyond: Load before the first row and after the last.
        derivative: Derivative of q, which is s.
    """

    name: str
    curve: RecordCurve
    shift: float
    scale: float
    constant: float
    ramp: float
    beyond: Literal["refuse", "zero", "repeat"]
    derivative: int

    def value(self, time: Times) -> Times:
        """Return s at a time, or at each of an array of times.

        Raises:
            UserError: The record does not cover the time, and nothing was said about what acts there.
        """
        times = np.asarray(time, dtype=float)
        places, inside = self._places(times)
        values: list[Any] = [self.scale * self.curve.pieces(places, nu=k) for k in range(self.derivative + 1)]
        values[0] = values[0] + self.constant
        total = np.where(inside, ramped(times, self.ramp, values), 0.0)
        found: Times = total if isinstance(time, np.ndarray) else float(total)
        return found

    def mean(self, starts: Array, ends: Array) -> Array:
        """Return the mean of s over intervals, (times,); exact, as s is made of polynomials between the rows.

        Args:
            starts: (times,), s.
            ends: (times,), s, none before its start.
        """
        return piecewise_mean(self.value, self._knots(float(np.min(starts)), float(np.max(ends))), starts, ends)

    @property
    def peak(self) -> float:
        """Largest |s| in the record, the ramp left out."""
        least, most = (self.scale * value for value in extremes(self.curve, self.derivative))
        constant = self.constant if self.derivative == 0 else 0.0
        return max(abs(least + constant), abs(most + constant))

    @property
    def content(self) -> Content:
        """Distribution of the power of s over frequencies."""
        return content(self.curve, self.derivative)

    @property
    def last(self) -> float:
        """Time of the run at which the last row is reached, s."""
        return self.curve.span - self.shift

    def _places(self, times: Array) -> tuple[Array, Any]:
        """Return the places of times in the record, s, and whether it covers them."""
        places, span = times + self.shift, self.curve.span
        if self.beyond == "repeat":
            return np.asarray(np.mod(places, span)), True
        slack = ROUNDING * span if self.beyond == "refuse" else 0.0
        inside = (places >= -slack) & (places <= span + slack)
        if self.beyond == "refuse" and not np.all(inside):
            time = float(np.ravel(times)[np.argmin(np.ravel(inside))])
            raise UserError(
                f"load {self.name}: its record covers t = {-self.shift:.6g} to {self.last:.6g} s of the run, and "
                f't = {time:.6g} s was asked for; a longer record, or beyond = "zero" or "repeat"'
            )
        return np.asarray(np.clip(places, 0.0, span)), inside

    def _knots(self, first: float, last: float) -> Array:
        """Return the times between two at which s changes from one polynomial to the next."""
        knots, span = self.curve.knots, self.curve.span
        if self.beyond == "repeat":
            rounds = np.arange(np.floor((first + self.shift) / span), np.floor((last + self.shift) / span) + 1.0)
            places = (knots[:-1] + span * rounds[:, None]).ravel() - self.shift
        else:
            places = knots - self.shift
        places = np.append(places, self.ramp)
        return np.asarray(places[(places > first) & (places < last)])


def signal_of(load: RecordedTable) -> RecordedSignal:
    """Return a recorded load as a function of time.

    Raises:
        RecordError: Its file cannot be used.
    """
    curve = curve_of(load)
    return RecordedSignal(
        load.name,
        curve,
        0.0 if load.start is None else load.start - curve.first,
        load.scale,
        load.offset - (load.scale * curve.mean if load.remove_mean else 0.0),
        load.ramp,
        load.beyond,
        load.derivative,
    )
