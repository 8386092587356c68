"""Any closed polygon with holes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gapbeam.meshes.sections.polygon_cells import polygon_patches
from gapbeam.meshes.sections.polygon_outline import PolygonOutline
from gapbeam.meshes.sections.section_curve import Place
from gapbeam.meshes.sections.section_patches import SectionPatches
from gapbeam.solver.faults import Fault
from gapbeam.solver.sections.polygon_faults import polygon_faults
from gapbeam.solver.sections.section_table import Lattice, SectionTable
from gapbeam.solver.table import Number

MOST = 200  # corners of one loop
MOST_HOLES = 16

Corners = Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3, max_length=MOST)]


class PolygonSection(SectionTable):
    """A polygon with holes; thickness and width are its extents, and the axis of the beam is in the middle of these.

    Area and second moments are exact. Torsion constant, shear coefficients and shear center come from finite elements
    on the cross-section, `saint_venant`, within 1e-4.
    """

    type: Literal["polygon"] = Field(
        description="a closed polygon, with or without holes, as high and wide as the beam"
    )
    points: Corners = Field(
        description="corners [y, z] one after the other, y across and z along the bending direction, measured from "
        "anywhere, m",
        examples=[[[-0.02, 0.0], [0.02, 0.0], [0.012, 0.014], [-0.012, 0.014]]],
    )
    holes: Annotated[tuple[Corners, ...], Field(max_length=MOST_HOLES)] = Field(
        default=(), description="corners of each hole, measured from the same place, m"
    )

    def outline(self, thickness: float, width: float) -> PolygonOutline:  # noqa: ARG002
        """Return its outline, with the axis of the beam in the middle."""
        return self._polygon

    @property
    def _polygon(self) -> PolygonOutline:
        return _outline(self.points, self.holes)

    @property
    def mirrored(self) -> bool:
        """Whether the polygon is symmetric about the bending plane."""
        return self._polygon.mirrored

    @property
    def lattice(self) -> Lattice:
        """Rectangles, if all sides are upright or level."""
        return "rectangles" if self._polygon.upright else "own"

    def area(self, thickness: float, width: float) -> float:
        """Return the area by Green's theorem; that of the extents where it is refused as none."""
        found = self._polygon.moments.area
        return found if found > 0.0 else thickness * width

    def second_moment(self, thickness: float, width: float) -> float:
        """Return int z^2 dA about the centroid by Green's theorem."""
        found = self._polygon.second_moments[1]
        return found if found > 0.0 else width * thickness**3 / 12.0

    def lateral_moment(self, thickness: float, width: float) -> float:
        """Return int y^2 dA about the centroid by Green's theorem."""
        found = self._polygon.second_moments[0]
        return found if found > 0.0 else thickness * width**3 / 12.0

    def height(self, thickness: float, width: float) -> float:
        """Return A over the narrower one of the sides that supports touch."""
        flat = [length for above in (False, True) if (length := self._polygon.flat(above)) > 0.0]
        return self.area(thickness, width) / min([*flat, width])

    def flat(self, above: bool) -> bool:
        """Return whether a side is level there, rather than a corner highest or lowest."""
        return self._polygon.flat(above) > 0.0

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:  # noqa: ARG002
        """Return rectangles between lines through all corners, or quadrilaterals made of triangles."""
        return polygon_patches(self._polygon, through, across)

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:  # noqa: ARG002
        """Return whether a point is in the polygon and in no hole."""
        return bool(self._polygon.contains(np.array([[y, z]]))[0])

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:
        """Return the sizes of a hollow rectangle around the axis, from wall to wall; 0 where there is none."""
        free = self._polygon.free_about_axis()
        high, wide = min(free[1], thickness), min(free[0], width)
        inside = [(0.499 * one * wide, 0.499 * other * high) for one in (-1.0, 1.0) for other in (-1.0, 1.0)]
        if min(high, wide) == 0.0 or self._polygon.contains(np.array(inside)).any():
            return 0.0, 0.0
        return high, wide

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield what makes no polygon, or one of another size."""
        yield from polygon_faults(self.points, self.holes, thickness, width)


@lru_cache(maxsize=256)
def _outline(points: tuple[Place, ...], holes: tuple[tuple[Place, ...], ...]) -> PolygonOutline:
    """Return the outline of corners, once for each polygon."""
    return PolygonOutline.of(points, holes)
