"""Harmonic time functions with a smooth start, and their derivatives.

    q(t) = r(t) A sin(2 pi f t + phi),   r = 10 s^3 - 15 s^4 + 6 s^5,  s = t / ramp in [0, 1]

The ramp is twice continuously differentiable, so that an acceleration derived from a displacement is continuous.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, TypeVar

import numpy as np

from solver.operators import Array

Times = TypeVar("Times", float, Array)


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
        ramps = self._ramp(time)
        binomial = ((1,), (1, 1), (1, 2, 1))[derivative]
        total: Times = self.amplitude * sum(
            factor * ramps[derivative - k] * waves[k] for k, factor in enumerate(binomial)
        )
        return total

    def mean(self, start: Times, end: Times, derivative: int = 0) -> Times:
        """Return the mean over an interval, or each of many; by Gauss-Legendre quadrature, exact on short ones."""
        half, middle = 0.5 * (end - start), 0.5 * (end + start)
        values: list[Any] = [self.value(middle + half * x, derivative) for x in _NODES]
        total: Times = sum(0.5 * w * value for w, value in zip(_WEIGHTS, values, strict=True))
        return total

    def _ramp(self, time: Times) -> tuple[Any, Any, Any]:
        if self.ramp == 0.0 or np.min(time) >= self.ramp:
            return 1.0, 0.0, 0.0
        s = np.clip(time / self.ramp, 0.0, 1.0)
        return (
            s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
            30.0 * s * s * (1.0 - s) ** 2 / self.ramp,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self.ramp**2,
        )


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
