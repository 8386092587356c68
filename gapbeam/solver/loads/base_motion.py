"""Harmonic motion of the support: f = -M e a_b(t) in the frame of the support.

a_b is the given acceleration, or the first or second derivative of the given velocity or displacement, ramp included.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.harmonic_load import HarmonicLoad
from gapbeam.solver.loads.support_motion import SupportMotion
from gapbeam.solver.table import Name, Number


class BaseMotion(HarmonicLoad, SupportMotion):
    """Harmonic motion of the support; the equations are solved in the moving frame."""

    type: Literal["base_motion"] = Field(description="kind of load")
    name: Name = Field(default="base", description="name in results and messages, different for every load")
    amplitude: Number = Field(description="amplitude of the quantity, m/s^2, m/s or m", examples=[20.0])

    @property
    def amplitude_unit(self) -> str:
        """Unit of the quantity."""
        return self.quantity_unit

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that does nothing, or that looks like another unit."""
        yield from super().unusual_values()
        if self.peak > self.hardest:
            yield f"shakes the support with {self.peak:.3g} m/s^2, over 1000 g: is the amplitude in mm?"
