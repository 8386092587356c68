"""Recorded loads as functions of time, with a smooth start.

    q(t) = r(t) (scale (x(start + t) - mean) + offset)

x is the curve through the rows of the record (`loads.record_curve`), r the ramp (`loads.ramp`), mean the mean of
x over the record or 0. What acts on the beam is s = q for forces, and the derivative 0, 1 or 2 of q for the
acceleration of the support from a recorded acceleration, velocity or displacement. Nothing is integrated in time: the
equations are those in the frame of the support, where only its acceleration acts. Before the first row and after the
last, s is 0, or the record again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.loads.load_table import RecordedTable
from gapbeam.solver.loads.ramp import ramped
from gapbeam.solver.loads.record_curve import Content, RecordCurve, content, curve_of, extremes
from gapbeam.solver.loads.time_function import piecewise_mean
from gapbeam.solver.system.operators import Array

Times = TypeVar("Times", float, Array)
MOST_POWER = 0.99
"""Of a record: the frequencies that hold it are of interest."""
ROUNDING = 1.0e-6
"""Of the span of a record: how far a run may ask beyond its ends."""


@dataclass(frozen=True)
class RecordedSignal:
    """A recorded function of time.

    Attributes:
        name: Of the load.
        curve: x, of time from the first row.
        shift: Time from the first row at which the run starts, s.
        scale: What x is multiplied by.
        constant: What is added to that, the mean taken off.
        ramp: Duration of the smooth start, s.
        beyond: What acts before the first row and after the last.
        derivative: Of q, that is s.
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
        """How the power of s is spread over frequencies."""
        return content(self.curve, self.derivative)

    @property
    def last(self) -> float:
        """Time of the run at which the last row is reached, s."""
        return self.curve.span - self.shift

    def _places(self, times: Array) -> tuple[Array, Any]:
        """Return where in the record times lie, s, and whether it covers them."""
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
        """Return the times between two at which s goes from one polynomial to the next."""
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
