"""Harmonic motion of one support: its walls move by q(t) - q(0), q = r(t) A sin(2 pi f t + phi), in m."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from math import cos, pi, radians
from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.harmonic_function import Harmonic
from gapbeam.solver.loads.harmonic_load import HarmonicLoad
from gapbeam.solver.loads.moving_support import MovingSupport
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.table import Name, Number
from gapbeam.solver.wording.compared_numbers import apart, exceeds

HARDEST = 1.0e4  # m/s^2
SLOWEST = 1.0e-9  # share of the largest speed that is no jump


class HarmonicSupportMotion(HarmonicLoad, MovingSupport):
    """Harmonic displacement of one support while the others stay where they are."""

    type: Literal["support_motion"] = Field(description="kind of load")
    name: Name = Field(default="motion", description="name in results and messages, different for every load")
    amplitude: Number = Field(description="amplitude of the displacement, m", examples=[1.0e-4])

    def time_function(self) -> TimeFunction:
        """Return the displacement."""
        harmonic = Harmonic(self.amplitude, self.frequency, self.phase, self.ramp)
        return TimeFunction(harmonic.value, harmonic.mean, partial(harmonic.value, derivative=1))

    @property
    def peak(self) -> float:
        """A (2 pi f)^2, the largest acceleration of the support, m/s^2."""
        return abs(self.amplitude) * float((2.0 * pi * self.frequency) ** 2)

    @property
    def amplitude_unit(self) -> str:
        """Unit of the displacement."""
        return "m"

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that does nothing, or that looks like another unit."""
        yield from super().unusual_values()
        if self.peak > HARDEST:
            yield f"shakes a support with {self.peak:.3g} m/s^2, over 1000 g: is the amplitude in mm?"

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a motion whose speed starts with a jump, or that never reaches its amplitude."""
        if exceeds(self.ramp, end):
            yield "ramp = {} is longer than the run, {} s".format(*apart(self.ramp, end))
        jump = abs(cos(radians(self.phase)))
        if self.ramp == 0.0 and self.acts and jump > SLOWEST:
            speed = jump * abs(self.amplitude) * 2.0 * pi * self.frequency
            yield f"the support jumps to a speed of {speed:.3g} m/s at t = 0: give a ramp, or phase = 90.0"
