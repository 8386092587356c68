"""Patches of a cross-section, four-sided, from which layers of hexahedra are extruded.

Straight lines and arcs bound the patches. Cross-sections of one beam share their patches, so that the same layers of
cells pass through all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import Literal

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.mesh_errors import MeshError

Array = npt.NDArray[np.float64]
Place = tuple[float, float]
Side = Literal["inside", "below", "above"]


@dataclass(frozen=True)
class SectionCurve:
    """A line, or an arc of less than half a turn about the axis of the beam, from one point to another.

    Attributes:
        start: y and z of the first point, m.
        end: y and z of the last point, m.
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
"""Directions that divide a round section: base and gland meet at y = +-R, and the lowest point is a node."""


@dataclass(frozen=True)
class SectionPatches:
    """Patches that fill a cross-section, with its axis at y = z = 0.

    Attributes:
        curves: All sides of patches, each once.
        patches: Numbers of the sides of each patch in turn, and whether it passes the side backward.
    """

    curves: tuple[SectionCurve, ...]
    patches: tuple[tuple[tuple[int, bool], ...], ...]

    @property
    def curved(self) -> bool:
        """True where a side is an arc, which cells of second order follow."""
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
        filled: Whether each rectangle belongs to the section: rows of z from below, in each the columns of y.
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


SAME = 1.0e-9  # of the size of a section: lines this close to each other are one
CLOSE = 1.0e-4  # of the size of a section: lines are not closer than this, or cells between them would be slivers
SLACK = 0.05  # of a cell

Shared = tuple[SectionPatches, tuple[tuple[SectionPatches, tuple[bool, ...]], ...]]
"""All patches, and each section: its own ones, and which of all these are."""


def shared_patches(sections: Sequence[SectionPatches]) -> Shared:
    """Return the patches that some cross-sections have in common.

    Args:
        sections: Sections made of rectangles on a grid all of them, or round about the axis all of them.

    Raises:
        MeshError: Round sections beside others, or surfaces of two sections that almost coincide.
    """
    round_ones = [section.curved for section in sections]
    if all(round_ones):
        return _rings(sections)
    if not any(round_ones):
        return _grids(sections)
    raise MeshError(
        "cross-sections of a beam",
        found="round ones beside others",
        expected="all of them round, or none: layers of cells pass through all of them",
    )


def _merged(values: Sequence[float]) -> list[float]:
    """Return values in increasing order, those once that are the same up to rounding.

    Raises:
        MeshError: Two of them almost coincide.
    """
    ordered = sorted(values)
    found, size = ordered[:1], max(abs(value) for value in ordered)
    for before, value in pairwise(ordered):
        if SAME * size < value - before < CLOSE * size:
            raise MeshError(
                "cross-sections of a beam",
                found=f"surfaces of them {value - before:.2g} m apart, {before:.12g} and {value:.12g} m from the axis",
                expected=f"the same place, or at least {CLOSE * size:.2g} m between them: cells lie in between",
                hint="Walls, webs and flanges count, too.",
            )
        found += [value] if value - before > SAME * size else []
    return found


def _counted(low: float, high: float, parts: Sequence[tuple[float, float, int]]) -> int:
    """Return the cells between two lines, as dense as the densest of the parts there: start, end and cells."""
    dense = [cells * (high - low) / (end - start) for start, end, cells in parts if start < high and end > low]
    return max([1, *(math.ceil(count - SLACK) for count in dense)])


def _grids(sections: Sequence[SectionPatches]) -> Shared:
    """Return sections made of rectangles on the lines of all of them."""
    lines, cells = [], []
    for axis in (0, 1):
        parts = [part for section in sections for part in _intervals(section, axis)]
        lines.append(_merged([end for start, last, _ in parts for end in (start, last)]))
        cells.append([_counted(low, high, parts) for low, high in pairwise(lines[-1])])
    rectangles = [
        (0.5 * (left + right), 0.5 * (low + high))
        for (low, high), (left, right) in product(pairwise(lines[1]), pairwise(lines[0]))
    ]
    holds = [[_holds(section, *middle) for middle in rectangles] for section in sections]
    there = [any(flags) for flags in zip(*holds, strict=True)]
    columns = len(cells[0])
    rows = [there[first : first + columns] for first in range(0, len(there), columns)]
    whole = grid_patches((lines[0], lines[1]), (cells[0], cells[1]), rows)
    found = []
    for section, flags in zip(sections, holds, strict=True):
        filled = tuple(flag for flag, anywhere in zip(flags, there, strict=True) if anywhere)
        found.append((_part(whole, filled, _flat_side(section)), filled))
    return whole, tuple(found)


def _rings(sections: Sequence[SectionPatches]) -> Shared:
    """Return round sections on the circles of all of them, with a square in the middle where one of them is solid."""
    outlines = [(_circles(section), _is_filled(section)) for section in sections]
    radii = _merged([radius for circles, _ in outlines for radius in circles])
    quarter = max(curve.cells for section in sections for curve in section.curves if curve.arc)
    curves, corners = list[SectionCurve](), list[list[Place]]()
    cores = [section for section in sections if _is_filled(section)]
    solid, levels = bool(cores), list(radii)
    if solid:
        share = min(min(math.hypot(*place) for place in one.points) / max(_circles(one)) for one in cores)
        levels = [share * radii[0], *radii]
    parts = [part for section in sections for part in _radial(section)]
    circles = [[(radius * y, radius * z) for y, z in QUADRANTS] for radius in levels]
    sides = range(len(QUADRANTS))
    for number, places in enumerate(circles):
        curved = number > 0 or not solid
        curves += [SectionCurve(places[one], places[(one + 1) % 4], quarter, curved) for one in sides]
    for (inside, outside), (low, high) in zip(pairwise(circles), pairwise(levels), strict=True):
        count = _counted(low, high, parts)
        curves += [SectionCurve(inside[one], outside[one], count) for one in sides]
        corners += [[inside[one], outside[one], outside[(one + 1) % 4], inside[(one + 1) % 4]] for one in sides]
    if solid:
        corners.append(circles[0])
    whole = patches_of(curves, corners)
    found = []
    for rings, is_solid in outlines:
        near = SAME * radii[-1]
        bore, outer = (0.0 if is_solid else min(rings)), max(rings)
        between = [low >= bore - near and high <= outer + near for low, high in pairwise(levels)]
        filled = tuple(flag for flag in between for _ in sides) + ((is_solid,) if solid else ())
        found.append((_part(whole, filled, _round_side(outer, near)), filled))
    return whole, tuple(found)


def _part(whole: SectionPatches, filled: Sequence[bool], side: Callable[[SectionCurve], Side]) -> SectionPatches:
    """Return some of the patches, with the sides of their own outline."""
    kept = [patch for patch, flag in zip(whole.patches, filled, strict=True) if flag]
    used = sorted({number for patch in kept for number, _ in patch})
    numbers = {number: place for place, number in enumerate(used)}
    curves = tuple(replace(whole.curves[number], side=side(whole.curves[number])) for number in used)
    return SectionPatches(curves, tuple(tuple((numbers[one], back) for one, back in patch) for patch in kept))


def _intervals(section: SectionPatches, axis: int) -> list[tuple[float, float, int]]:
    """Return start, end and cells of the lines along an axis."""
    ends = [(curve.start[axis], curve.end[axis], curve.cells) for curve in section.curves]
    return [(min(one, other), max(one, other), cells) for one, other, cells in ends if one != other]


def _holds(section: SectionPatches, y: float, z: float) -> bool:
    """Return whether a place is in one of the rectangles of a section."""
    for patch in section.patches:
        places = [place for number, _ in patch for place in (section.curves[number].start, section.curves[number].end)]
        (left, low), (right, high) = (tuple(map(pick, *places)) for pick in (min, max))
        if left <= y <= right and low <= z <= high:
            return True
    return False


def _flat_side(section: SectionPatches) -> Callable[[SectionCurve], Side]:
    """Return a finder of the lowest and highest sides of a section among lines of all sections."""
    heights = [place[1] for place in section.points]
    low, high = min(heights), max(heights)
    near = SAME * (high - low)

    def side(curve: SectionCurve) -> Side:
        ends = curve.start[1], curve.end[1]
        if all(abs(end - low) <= near for end in ends):
            return "below"
        return "above" if all(abs(end - high) <= near for end in ends) else "inside"

    return side


def _round_side(radius: float, near: float) -> Callable[[SectionCurve], Side]:
    """Return a finder of the upper and lower arcs of a round section among those of all sections."""

    def side(curve: SectionCurve) -> Side:
        if not curve.arc or abs(math.hypot(*curve.start) - radius) > near:
            return "inside"
        return "above" if curve.start[1] + curve.end[1] > 0.0 else "below"

    return side


def _circles(section: SectionPatches) -> list[float]:
    """Return the radii of the arcs of a round section."""
    return _merged([math.hypot(*curve.start) for curve in section.curves if curve.arc])


def _is_filled(section: SectionPatches) -> bool:
    """Return whether a round section has no bore: its inner patch has straight sides."""
    return len(_circles(section)) == 1


def _radial(section: SectionPatches) -> list[tuple[float, float, int]]:
    """Return start, end and cells of the lines along radii."""
    found = []
    for curve in section.curves:
        low, high = sorted((math.hypot(*curve.start), math.hypot(*curve.end)))
        if high - low > SAME * high:
            found.append((low, high, curve.cells))
    return found
