"""Gravity: f = M g e at all times, from the seat on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.places import BodyForce
from gapbeam.solver.loads.time_function import TimeFunction, constant
from gapbeam.solver.schema.table import Name, NonNegative, Vector

LARGEST = 100.0
"""Usual acceleration, m/s^2."""


class Gravity(LoadTable):
    """Body force density * acceleration; part of the static seat."""

    static: ClassVar[bool] = True
    alone: ClassVar[bool] = True
    default_sense: ClassVar[float] = -1.0

    type: Literal["gravity"] = Field(description="kind of load")
    name: Name = Field(default="gravity", description="unique name")
    acceleration: NonNegative = Field(default=9.81, description="acceleration of gravity, m/s^2")
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default downward, toward the base"
    )

    @property
    def place(self) -> BodyForce:
        """All mass."""
        return BodyForce()

    def time_function(self) -> TimeFunction:
        """Return s(t) = acceleration."""
        return constant(self.acceleration)

    @property
    def peak(self) -> float:
        """The acceleration, m/s^2."""
        return self.acceleration

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
        """Yield an acceleration that looks like another unit."""
        if self.acceleration > LARGEST:
            yield f"acceleration = {self.acceleration:g} is unusual; the unit is m/s^2"
