"""What loads have in common that are a force at a point or an acceleration of the support, as a key says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.places import PointForce, SupportAcceleration
from gapbeam.solver.loads.support_motion import SupportMotion
from gapbeam.solver.loads.unrepeated_load import UnrepeatedLoad
from gapbeam.solver.table import Number, Vector


class PointOrSupportLoad(UnrepeatedLoad):
    """A force at a point or an acceleration of the support, with a smooth start; it never repeats."""

    quantity: Literal["force", "acceleration"] = Field(
        default="force", description="what it is: a force at a point, or the acceleration of the support"
    )
    point: Number | Vector | None = Field(
        default=None,
        description="of a force: x on the beam axis, or all coordinates (0 on the axis), m",
        examples=[0.15],
    )

    @property
    def place(self) -> PointForce | SupportAcceleration:
        """The point, or all of the beam in the frame of the support."""
        return SupportAcceleration() if self.point is None else PointForce(self.point)

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return "N" if self.quantity == "force" else "m/s^2"

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield a force at no point, and an acceleration at one."""
        if self.quantity == "force" and self.point is None:
            yield Fault(
                (*key, "point"),
                "missing, of a force",
                "where the force acts: x on the axis, or all coordinates, m",
                'point = 0.15, or quantity = "acceleration" to shake the support',
                ((*key, "quantity"),),
            )
        if self.quantity == "acceleration" and self.point is not None:
            yield Fault(
                (*key, "point"),
                "a point, of an acceleration",
                "no point: an acceleration is that of the support, with all that stands on it",
                'leave point out, or quantity = "force"',
                ((*key, "quantity"),),
            )

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that looks like another unit."""
        if self.quantity == "acceleration" and self.peak > SupportMotion.hardest:
            yield f"shakes the support with {self.peak:.3g} m/s^2, over 1000 g: are its values in m/s^2?"
