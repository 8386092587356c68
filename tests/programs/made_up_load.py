"""A load that gapbeam does not have, in one file, as somebody would add it: the pulse of an impact hammer.

s(t) = A sin(pi (t - t0) / T) for t0 <= t <= t0 + T,    0 before and after
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.point_load import PointLoad
from gapbeam.solver.loads.time_function import TimeFunction, smooth
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.schema.table import Name, NonNegative, Number, Positive, Vector

CONTENT = 1.5  # over the duration: beyond this frequency the spectrum of the pulse is below a tenth
FEWEST = 10  # steps that show a pulse


class HalfSineForce(PointLoad):
    """A force at a point with the function of time of half a sine, as from an impact hammer."""

    type: Literal["half_sine_force"] = Field(description="kind of load")
    name: Name = Field(default="pulse", description="name in results and messages, different for every load")
    amplitude: Number = Field(description="largest force, N", examples=[20.0])
    duration: Positive = Field(description="duration of the pulse, s", examples=[0.002])
    start: NonNegative = Field(default=0.0, description="time at which the pulse begins, s")
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, the bending direction"
    )

    def time_function(self) -> TimeFunction:
        """Return the pulse."""

        def value(time: Any) -> Any:
            share = (time - self.start) / self.duration
            return np.where((share >= 0.0) & (share <= 1.0), self.amplitude * np.sin(pi * share), 0.0)

        return smooth(value)

    @property
    def peak(self) -> float:
        """The amplitude, N."""
        return abs(self.amplitude)

    @property
    def forcing_frequency(self) -> None:
        """None: there is one pulse."""

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """Where the spectrum of the pulse ends, Hz."""
        return CONTENT / self.duration, f"{CONTENT:g} over the duration of the pulse {self.name}"

    @property
    def rise_time(self) -> float:
        """0: no ramp."""
        return 0.0

    def at_full_amplitude(self) -> Self:
        """Return the pulse at once."""
        return self.model_copy(update={"start": 0.0})

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return where the spectrum ends, and the steps of the pulse."""
        return f"{CONTENT / self.duration:.4g} Hz", f"{self.duration / step:.4g} steps in the pulse"

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:  # noqa: ARG002
        """Yield a pulse that begins after the run."""
        if self.start >= end:
            expected = f"less than the end of the run, {end:g} s"
            yield Fault((*key, "start"), f"{self.start:g} s", expected, "start = 0.0", (("time", "end"),))

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a step that misses the pulse."""
        if step * FEWEST > self.duration:
            yield f"{self.duration / step:.3g} steps in the pulse {self.name}, and {FEWEST} show it"
