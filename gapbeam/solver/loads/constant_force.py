"""A constant force at a point: f = N(x_p)^T e F at all times, from the seat on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field

from gapbeam.solver.loads.point_load import PointLoad
from gapbeam.solver.loads.time_function import TimeFunction, constant
from gapbeam.solver.table import Name, Number, Vector


class ConstantForce(PointLoad):
    """A constant force at a point, part of the static seat: the beam starts at rest under it."""

    static: ClassVar[bool] = True

    type: Literal["constant_force"] = Field(description="kind of load")
    name: Name = Field(default="force", description="name in results and messages, different for every load")
    amplitude: Number = Field(description="the force along the direction, N", examples=[20.0])
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, the bending direction"
    )

    def time_function(self) -> TimeFunction:
        """Return s(t) = amplitude."""
        return constant(self.amplitude)

    @property
    def peak(self) -> float:
        """The size of the force, N."""
        return abs(self.amplitude)

    @property
    def forcing_frequency(self) -> None:
        """None: it is static."""

    @property
    def frequency_of_interest(self) -> None:
        """None: it is static."""

    @property
    def rise_time(self) -> float:
        """0: it acts before the run."""
        return 0.0

    def at_full_amplitude(self) -> Self:
        """Return the load itself."""
        return self

    def frequency_words(self, step: float) -> None:
        """Return None: it is static."""

    def unusual_values(self) -> Iterator[str]:
        """Yield a load that does nothing."""
        if self.amplitude == 0.0:
            yield "amplitude = 0: it does nothing"
