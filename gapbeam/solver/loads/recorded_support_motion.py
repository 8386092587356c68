"""Recorded motion of one support: its walls move by q(t) - q(0), q from a file, in m."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.moving_support import MovingSupport
from gapbeam.solver.loads.recorded_function import signal_of
from gapbeam.solver.loads.recorded_load import RecordedLoad
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.table import Name

HARDEST = 1.0e4  # m/s^2


class RecordedSupportMotion(RecordedLoad, MovingSupport):
    """Recorded displacement of one support while the others stay where they are, m after scaling."""

    type: Literal["recorded_support_motion"] = Field(description="kind of load")
    name: Name = Field(default="motion", description="name in results and messages, different for every load")

    def time_function(self) -> TimeFunction:
        """Return the displacement.

        Raises:
            RecordError: The file cannot be used.
        """
        signal = signal_of(self)
        return TimeFunction(signal.value, signal.mean, replace(signal, derivative=1).value)

    @property
    def derivatives(self) -> int:
        """Once: walls damp by their velocity."""
        return 1

    @property
    def peak(self) -> float:
        """Largest acceleration in the record, m/s^2."""
        return replace(signal_of(self), derivative=2).peak

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that looks like another unit, and what is odd in the record."""
        if self.peak > HARDEST:
            yield f"shakes a support with {self.peak:.3g} m/s^2, over 1000 g: are scale and time_scale right?"
        yield from super().unusual_values()
