"""What all motions of the support have in common."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.places import SupportAcceleration


class SupportMotion(LoadTable):
    """Motion of the support; the equations are solved in the moving frame.

    Nothing is integrated in time: in the frame of the support only its acceleration acts.
    """

    hardest: ClassVar[float] = 1.0e4
    """Usual acceleration of a support, m/s^2."""

    quantity: Literal["acceleration", "velocity", "displacement"] = Field(
        default="acceleration", description="which quantity of the support it gives"
    )

    @property
    def place(self) -> SupportAcceleration:
        """All of the beam, in the frame of the support."""
        return SupportAcceleration()

    @property
    def derivative(self) -> int:
        """Which derivative of the quantity in time is the acceleration."""
        return ("acceleration", "velocity", "displacement").index(self.quantity)

    @property
    def quantity_unit(self) -> str:
        """Unit of the quantity."""
        return ("m/s^2", "m/s", "m")[self.derivative]
