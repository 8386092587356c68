"""A sine whose frequency goes from one value to another and, if asked for, back.

    s(t) = r(t) A sin(2 pi phi(t)),    phi(t) = int_0^t f dt

    linear:        f = f0 + (f1 - f0) t / T,    phi = f0 t + (f1 - f0) t^2 / (2 T)
    logarithmic:   f = f0 (f1 / f0)^(t / T),    phi = f0 T ((f1 / f0)^(t / T) - 1) / ln(f1 / f0)

On the way back f is mirrored at t = T. Behind the sweep the last frequency is held, or the load is 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi
from typing import Literal, TypeVar

import numpy as np
from scipy.special import exprel

from gapbeam.solver.loads.ramp import ramped
from gapbeam.solver.loads.time_function import piecewise_mean
from gapbeam.solver.system.operators import Array

Times = TypeVar("Times", float, Array)


@dataclass(frozen=True)
class SweptSine:
    """A swept sine.

    Attributes:
        amplitude: A, in the unit of the load.
        first: f0, Hz.
        last: f1, Hz.
        duration: T, of one way, s.
        spacing: How f goes from one to the other.
        back: Whether f goes back to f0 in another T.
        after: What acts behind the sweep; "stop" lets the amplitude fall to 0 at its end over the ramp.
        ramp: Duration of the smooth start, s.
    """

    amplitude: float
    first: float
    last: float
    duration: float
    spacing: Literal["linear", "logarithmic"]
    back: bool
    after: Literal["hold", "stop"]
    ramp: float

    @property
    def end(self) -> float:
        """End of the sweep, s."""
        return 2.0 * self.duration if self.back else self.duration

    @property
    def highest(self) -> float:
        """Highest frequency, Hz."""
        return max(self.first, self.last)

    def value(self, time: Times) -> Times:
        """Return s at a time, or at each of an array of times."""
        times = np.asarray(time, dtype=float)
        values = ramped(times, self.ramp, (self.amplitude * np.sin(2.0 * pi * self.cycles(times)),))
        if self.after == "stop":
            left = self.end - times
            values = np.where(left > 0.0, ramped(left, self.ramp, (values,)), 0.0)
        found: Times = values if isinstance(time, np.ndarray) else float(values)
        return found

    def mean(self, starts: Array, ends: Array) -> Array:
        """Return the mean of s over intervals, (times,); by Gauss-Legendre quadrature over quarters of a period.

        Args:
            starts: (times,), s.
            ends: (times,), s, none before its start.
        """
        quarter = 0.25 / self.highest
        first, last = np.floor(float(np.min(starts)) / quarter), np.ceil(float(np.max(ends)) / quarter)
        corners = [self.ramp, self.duration, self.end - self.ramp, self.end]
        knots = np.concatenate([np.arange(first, last + 1.0) * quarter, corners])
        return piecewise_mean(self.value, knots, starts, ends)

    def cycles(self, times: Array) -> Array:
        """Return phi at times, (times,): whole numbers where s rises through 0."""
        there = self._one_way(np.minimum(times, self.duration))
        way = self._one_way(np.array(self.duration))
        if self.back:
            back = np.clip(times, self.duration, self.end)
            there = there + way - self._one_way(self.end - back)
        held = self.first if self.back else self.last
        return np.asarray(there + held * np.maximum(times - self.end, 0.0))

    def frequency(self, times: Array) -> Array:
        """Return f at times, Hz, (times,)."""
        along = np.clip(times, 0.0, self.end)
        share = np.minimum(along, self.end - along if self.back else along) / self.duration
        if self.spacing == "linear":
            return np.asarray(self.first + (self.last - self.first) * share)
        return np.asarray(self.first * (self.last / self.first) ** share)

    def _one_way(self, times: Array) -> Array:
        share = times / self.duration
        if self.spacing == "linear":
            return np.asarray(times * (self.first + 0.5 * (self.last - self.first) * share))
        return np.asarray(self.first * times * exprel(log(self.last / self.first) * share))
