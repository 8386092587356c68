"""What all forces at a point have in common."""

from __future__ import annotations

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.places import PointForce
from gapbeam.solver.table import Number, Vector


class PointLoad(LoadTable):
    """A force at a point."""

    point: Number | Vector = Field(
        description="x on the beam axis, or all coordinates (0 on the axis), m", examples=[0.15]
    )

    @property
    def place(self) -> PointForce:
        """The point."""
        return PointForce(self.point)
