"""Function of time s of a load, and its mean over intervals.

A swept sine has a frequency that goes from one value to another and, if asked for, back,

    s(t) = r(t) A sin(2 pi phi(t)),    phi(t) = int_0^t f dt

    linear:        f = f0 + (f1 - f0) t / T,    phi = f0 t + (f1 - f0) t^2 / (2 T)
    logarithmic:   f = f0 (f1 / f0)^(t / T),    phi = f0 T ((f1 / f0)^(t / T) - 1) / ln(f1 / f0)

On the way back f is mirrored at t = T. Behind the sweep the last frequency is held, or the load is 0.

Harmonic functions have their derivatives in closed form,

    q(t) = r(t) A sin(2 pi f t + phi)

The ramp r starts a load smoothly:

    r(t) = 10 s^3 - 15 s^4 + 6 s^5,   s = t / ramp in [0, 1]

It is twice continuously differentiable, so that an acceleration derived from a displacement is continuous.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import log, pi
from typing import Any, Literal, TypeVar

import numpy as np
import scipy

from gapbeam.solver.system.operators import Alike, Array


def ramps_at(time: Any, ramp: float) -> tuple[Any, Any, Any]:
    """Return r and its first and second derivative at a time, or at each of an array of times, 1, 1/s and 1/s^2.

    Args:
        time: s.
        ramp: Duration of the start, s; 0 for none.
    """
    if ramp == 0.0 or np.min(time, initial=np.inf) >= ramp:
        return 1.0, 0.0, 0.0
    s = np.clip(time / ramp, 0.0, 1.0)
    return (
        s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
        30.0 * s * s * (1.0 - s) ** 2 / ramp,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / ramp**2,
    )


def ramped(time: Any, ramp: float, derivatives: Sequence[Any]) -> Any:
    """Return the last derivative of r x from those of x, by the product rule.

    Args:
        time: A time or an array of times, s.
        ramp: Duration of the start, s; 0 for none.
        derivatives: x, or x and x', or x, x' and x'' at the times.
    """
    ramps, last = ramps_at(time, ramp), len(derivatives) - 1
    return sum(factor * ramps[last - k] * derivatives[k] for k, factor in enumerate(BINOMIAL[last]))


BINOMIAL = ((1,), (1, 1), (1, 2, 1))


@dataclass(frozen=True)
class TimeFunction:
    """A function of time.

    Attributes:
        value: s at a time, or at each of an array of times.
        mean: Mean of s over intervals from starts, (times,), to ends, (times,).
        rate: Derivative of s, where s moves a wall.
        acceleration: Its derivative, where s moves a clamp.
        signal: Computes s together with others of its kind; None: s is computed by itself.
        jumps: Whether s jumps: steps take its mean.
    """

    value: Callable[[Any], Any]
    mean: Callable[[Array, Array], Array]
    rate: Callable[[Any], Any] | None = None
    acceleration: Callable[[Any], Any] | None = None
    signal: Alike | None = None
    jumps: bool = False


def constant(value: float) -> TimeFunction:
    """Return the function that has one value at all times."""
    return TimeFunction(lambda _time: value, lambda starts, _ends: np.full(np.shape(starts), value))


def smooth(value: Callable[[Any], Any], rate: Callable[[Any], Any] | None = None) -> TimeFunction:
    """Return a function that polynomials follow well over a step; its mean is found by quadrature.

    Args:
        value: s at a time, or at each of an array of times.
        rate: Its derivative, where it moves a wall.
    """
    return TimeFunction(value, partial(quadrature_mean, value), rate)


def quadrature_mean(value: Callable[[Any], Any], start: Any, end: Any) -> Any:
    """Return the mean over an interval, or each of many; by Gauss-Legendre quadrature, exact on short ones."""
    half, middle = 0.5 * (end - start), 0.5 * (end + start)
    values: list[Any] = [value(middle + half * x) for x in _NODES]
    return sum(0.5 * w * value for w, value in zip(_WEIGHTS, values, strict=True))


def piecewise_mean(value: Callable[[Array], Array], knots: Array, starts: Array, ends: Array) -> Array:
    """Return the mean over intervals of a function that is smooth between knots; exact up to degree 9 there, (times,).

    Args:
        value: s at each of an array of times.
        knots: Times at which s goes from one smooth piece to the next, s; those outside of the intervals do not count.
        starts: (times,), s.
        ends: (times,), s, none before its start.
    """
    inside = (knots > np.min(starts)) & (knots < np.max(ends))
    edges = np.unique(np.concatenate([starts, ends, knots[inside]]))
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    parts = np.zeros(len(half) + 1)
    for node, weight in zip(*_FIVE, strict=True):
        parts[:-1] += weight * half * value(np.asarray(middle + half * node))
    # a sum for each interval by itself: the same bits wherever a run is interrupted
    places = np.stack([np.searchsorted(edges, starts), np.searchsorted(edges, ends)], axis=1)
    gained, spans = np.add.reduceat(parts, places.ravel())[::2], ends - starts
    at_starts = value(np.asarray(starts, dtype=float))
    return np.asarray(np.divide(gained, spans, out=at_starts, where=spans > 0.0))


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_FIVE = np.polynomial.legendre.leggauss(5)

Times = TypeVar("Times", float, Array)


@dataclass(frozen=True)
class SweptSine:
    """A swept sine.

    Attributes:
        amplitude: A, in the unit of the load.
        first: f0, Hz.
        last: f1, Hz.
        duration: T, of one way, s.
        spacing: Change of f from one to the other.
        back: Whether f goes back to f0 in another T.
        after: Load behind the sweep; "stop" lets the amplitude fall to 0 at its end over the ramp.
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
        return np.asarray(self.first * times * scipy.special.exprel(log(self.last / self.first) * share))


@dataclass(frozen=True)
class Harmonic:
    """A ramped sine: amplitude, frequency (Hz), phase (degrees), ramp (s)."""

    amplitude: float
    frequency: float
    phase: float = 0.0
    ramp: float = 0.0

    def value(self, time: Times, derivative: int = 0) -> Times:
        """Return the derivative 0, 1 or 2 of q at a time, or at each of an array of times."""
        omega, angle = 2.0 * pi * self.frequency, 2.0 * pi * self.frequency * time + np.deg2rad(self.phase)
        sine, cosine = np.sin(angle), np.cos(angle)
        waves = (sine, omega * cosine, -omega * omega * sine)
        total: Times = self.amplitude * ramped(time, self.ramp, waves[: derivative + 1])
        return total

    def mean(self, start: Times, end: Times, derivative: int = 0) -> Times:
        """Return the mean over an interval, or each of many."""
        total: Times = quadrature_mean(partial(self.value, derivative=derivative), start, end)
        return total
