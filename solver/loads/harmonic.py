"""Harmonic time functions with a smooth start, and their derivatives.

    q(t) = r(t) A sin(2 pi f t + phi),   r = 10 s^3 - 15 s^4 + 6 s^5,  s = t / ramp in [0, 1]

The ramp is twice continuously differentiable, so that an acceleration derived from a displacement is continuous.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np


@dataclass(frozen=True)
class Harmonic:
    """A ramped sine: amplitude, frequency (Hz), phase (degrees), ramp (s)."""

    amplitude: float
    frequency: float
    phase: float = 0.0
    ramp: float = 0.0

    def value(self, time: float, derivative: int = 0) -> float:
        """Return the derivative 0, 1 or 2 of q at a time."""
        omega, angle = 2.0 * pi * self.frequency, 2.0 * pi * self.frequency * time + np.deg2rad(self.phase)
        waves = (sin(angle), omega * cos(angle), -omega * omega * sin(angle))
        ramps = self._ramp(time)
        binomial = ((1,), (1, 1), (1, 2, 1))[derivative]
        return self.amplitude * sum(factor * ramps[derivative - k] * waves[k] for k, factor in enumerate(binomial))

    def mean(self, start: float, end: float, derivative: int = 0) -> float:
        """Return the mean over an interval by Gauss-Legendre quadrature; exact to round-off on short ones."""
        half, middle = 0.5 * (end - start), 0.5 * (end + start)
        return float(
            0.5 * sum(w * self.value(middle + half * x, derivative) for x, w in zip(_NODES, _WEIGHTS, strict=True))
        )

    def _ramp(self, time: float) -> tuple[float, float, float]:
        if self.ramp == 0.0 or time >= self.ramp:
            return 1.0, 0.0, 0.0
        s = max(time / self.ramp, 0.0)
        return (
            s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
            30.0 * s * s * (1.0 - s) ** 2 / self.ramp,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self.ramp**2,
        )


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
