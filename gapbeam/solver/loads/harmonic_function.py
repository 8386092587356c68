"""Harmonic time functions with a smooth start, and their derivatives.

    q(t) = r(t) A sin(2 pi f t + phi)

The ramp r is that of `gapbeam.solver.loads.ramp`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import pi
from typing import TypeVar

import numpy as np

from gapbeam.solver.loads.ramp import ramped
from gapbeam.solver.loads.time_function import quadrature_mean
from gapbeam.solver.system.operators import Array

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
        total: Times = self.amplitude * ramped(time, self.ramp, waves[: derivative + 1])
        return total

    def mean(self, start: Times, end: Times, derivative: int = 0) -> Times:
        """Return the mean over an interval, or each of many."""
        total: Times = quadrature_mean(partial(self.value, derivative=derivative), start, end)
        return total
