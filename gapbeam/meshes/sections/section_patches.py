"""A cross-section as patches with four sides each, from which layers of hexahedra are extruded.

The curves that bound the patches of a cross-section: straight lines and arcs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Place = tuple[float, float]
Side = Literal["inside", "below", "above"]


@dataclass(frozen=True)
class SectionCurve:
    """A line, or an arc of less than half a turn about the axis of the beam, from one point to another.

    Attributes:
        start: y and z of the first point, m.
        end: Those of the last one, m.
        cells: Number of cells along it.
        arc: Whether it is an arc about y = z = 0.
        side: Whether supports below or above the beam can touch it; "inside": neither of them.
    """

    start: Place
    end: Place
    cells: int
    arc: bool = False
    side: Side = "inside"


CELLS_THROUGH = 4
"""Default number of structured cells through the thickness and across the width."""

QUADRANTS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Where the circumference of a round section is divided: base and gland meet at y = +-R, the lowest point is a node."""


@dataclass(frozen=True)
class SectionPatches:
    """Patches that fill a cross-section, with its axis at y = z = 0.

    Attributes:
        curves: All sides of patches, each once.
        patches: For each patch the numbers of its sides in turn, and whether it passes the side backward.
    """

    curves: tuple[SectionCurve, ...]
    patches: tuple[tuple[tuple[int, bool], ...], ...]

    @property
    def curved(self) -> bool:
        """Whether a side is an arc, which cells of second order follow."""
        return any(curve.arc for curve in self.curves)

    @cached_property
    def points(self) -> tuple[Place, ...]:
        """The ends of all sides, each once."""
        return tuple(dict.fromkeys(place for curve in self.curves for place in (curve.start, curve.end)))

    @property
    def cells(self) -> int:
        """Number of cells."""
        return sum(along * across for along, across in self._sizes())

    def nodes(self, degree: int) -> int:
        """Return the number of nodes of Lagrange elements of a degree."""
        inside = sum((degree * along - 1) * (degree * across - 1) for along, across in self._sizes())
        return len(self.points) + sum(degree * curve.cells - 1 for curve in self.curves) + inside

    def _sizes(self) -> Iterator[tuple[int, int]]:
        for patch in self.patches:
            yield self.curves[patch[0][0]].cells, self.curves[patch[1][0]].cells


def patches_of(curves: Sequence[SectionCurve], corners: Sequence[Sequence[Place]]) -> SectionPatches:
    """Return the patches with these corners in turn, whose sides are the curves between them."""
    numbers = {(curve.start, curve.end): number for number, curve in enumerate(curves)}
    found = []
    for patch in corners:
        sides = pairwise((*patch, patch[0]))
        found.append(tuple((numbers.get((a, b), numbers.get((b, a), -1)), (a, b) not in numbers) for a, b in sides))
    return SectionPatches(tuple(curves), tuple(found))


def grid_patches(
    lines: tuple[Sequence[float], Sequence[float]],
    cells: tuple[Sequence[int], Sequence[int]],
    filled: Sequence[Sequence[bool]],
) -> SectionPatches:
    """Return the patches of a section made of rectangles, whose lowest and highest sides face the supports.

    Args:
        lines: Increasing y and z of the lines between rectangles, m.
        cells: Number of cells between these lines, along y and z.
        filled: Which rectangles belong to the section: rows of z from below, in each the columns of y.
    """
    (across, up), (columns, rows) = lines, cells
    found: dict[tuple[Place, Place], SectionCurve] = {}
    corners = []
    for row, column in product(range(len(rows)), range(len(columns))):
        if not filled[row][column]:
            continue
        left, right, low, high = across[column], across[column + 1], up[row], up[row + 1]
        corners.append(((left, low), (right, low), (right, high), (left, high)))
        below: Side = "below" if row == 0 else "inside"
        above: Side = "above" if row == len(rows) - 1 else "inside"
        for start, end, count, side in (
            ((left, low), (right, low), columns[column], below),
            ((right, low), (right, high), rows[row], "inside"),
            ((left, high), (right, high), columns[column], above),
            ((left, low), (left, high), rows[row], "inside"),
        ):
            found.setdefault((start, end), SectionCurve(start, end, count, side=side))
    return patches_of(list(found.values()), corners)


def rectangle_patches(thickness: float, width: float, through: int, across: int) -> SectionPatches:
    """Return a solid rectangle as one patch.

    Args:
        thickness: Its height, m.
        width: m.
        through: Cells through the thickness.
        across: Cells across the width.
    """
    y, z = 0.5 * width, 0.5 * thickness
    return grid_patches(((-y, y), (-z, z)), ((across,), (through,)), ((True,),))


def ring_patches(outer: float, inner: float, quarter: int, through: int, filled: bool) -> SectionPatches:
    """Return the patches of a tube, or of a solid round bar: four patches around a square one.

    Args:
        outer: Radius of the section, m.
        inner: Radius of the bore, or of the corners of the square, m.
        quarter: Cells along a quarter of the circumference.
        through: Cells between both radii.
        filled: Whether it is a solid bar.
    """
    outside = [(outer * y, outer * z) for y, z in QUADRANTS]
    inside = [(inner * y, inner * z) for y, z in QUADRANTS]
    sides: tuple[Side, ...] = ("above", "above", "below", "below")
    curves = [SectionCurve(a, b, through) for a, b in zip(inside, outside, strict=True)]
    corners = []
    for number, side in enumerate(sides):
        after = (number + 1) % len(sides)
        curves.append(SectionCurve(outside[number], outside[after], quarter, True, side))
        curves.append(SectionCurve(inside[number], inside[after], quarter, not filled))
        corners.append([inside[number], outside[number], outside[after], inside[after]])
    return patches_of(curves, [*corners, inside] if filled else corners)
