"""What all motions of the walls of one support have in common."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.table import Name


class MovingSupport(LoadTable):
    """A given motion of the walls of one support in the frame of all supports, counted from t = 0.

    Attributes:
        opens: Whether it changes the clearance, or moves the support as it is.
    """

    opens: ClassVar[bool] = False

    support: Name | None = Field(default=None, description="name of the support; default the only one")

    @property
    def place(self) -> SupportWalls:
        """The walls of the support."""
        return SupportWalls(self.support, self.opens)
