"""Polygon section: any closed polygon with holes, and the checks of its corners."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gapbeam.meshes.sections.polygon_cells import polygon_patches
from gapbeam.meshes.sections.section_mesh import PolygonOutline, signed_area
from gapbeam.meshes.sections.section_patches import Array, Place, SectionPatches
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.messages.wording import apart
from gapbeam.solver.schema.table import Number
from gapbeam.solver.sections.section_table import KEY, Lattice, SectionTable

CLOSE = 1.0e-4  # of the larger extent: what is nearer than this touches, or leaves slivers of cells
SHARPEST = 10.0  # degrees
EXACT = 1.0e-6  # relative: extents that differ by more are others
MOST_SIDES = 400
Loop = Sequence[Place]
SIZE = (("beam", "thickness"), ("beam", "width"))


def polygon_faults(points: Loop, holes: Sequence[Loop], thickness: float, width: float) -> Iterator[Fault]:
    """Yield the faults of a polygon.

    Args:
        points: Its corners, m.
        holes: Corners of each hole, m.
        thickness: Size of the beam along z, m.
        width: Size along y, m.
    """
    loops = [points, *holes]
    size = max(np.ptp(np.array(points), axis=0).max(), np.finfo(float).tiny)
    yield from _other_size(points, thickness, width)
    if sum(map(len, loops)) > MOST_SIDES:
        yield _fault(0, f"{sum(map(len, loops))} corners in all", f"at most {MOST_SIDES}", "leave out small details")
        return
    poor = list(_poor_loops(loops, size))
    yield from poor
    if not poor:
        yield from _poor_nesting(loops, size)


def _fault(number: int, found: str, expected: str, hint: str) -> Fault:
    """Return a fault of the polygon, 0, or of one of its holes, from 1."""
    where = (*KEY, "points") if number == 0 else (*KEY, "holes")
    return Fault(where, found if number == 0 else f"hole {number}: {found}", expected, hint, SIZE)


def _other_size(points: Loop, thickness: float, width: float) -> Iterator[Fault]:
    """Yield extents that are not those of the beam."""
    across, through = (float(extent) for extent in np.ptp(np.array(points), axis=0))
    size = max(thickness, width)
    for key, given, extent, axis in (("thickness", thickness, through, "z"), ("width", width, across, "y")):
        if abs(given - extent) > EXACT * max(given, extent):
            in_mm = abs(extent - 1000.0 * given) <= EXACT * extent
            swapped = thickness != width and max(abs(through - width), abs(across - thickness)) <= EXACT * size
            yield Fault(
                (*KEY, "points"),
                f"points {extent:.9g} m apart along {axis}, with {key} = {given:.9g}",
                f"as far apart along {axis} as the beam has {key}",
                "are they in mm? Points are in m"
                if in_mm
                else "points are [y, z]: swap the coordinates?"
                if swapped
                else f"{key} = {extent:.9g}"
                if extent > 0.0
                else "corners of an area",
                SIZE,
            )


def _poor_loops(loops: Sequence[Loop], size: float) -> Iterator[Fault]:
    """Yield the faults of a polygon, or a hole, by itself."""
    for number, loop in enumerate(loops):
        corners = np.array(loop)
        count, near = len(loop), CLOSE * size
        same = [
            (one, other)
            for one, other in combinations(range(count), 2)
            if np.linalg.norm(corners[one] - corners[other]) < near
        ]
        if same:
            one, other = same[0]
            last = (one, other) == (0, count - 1)
            yield _fault(
                number,
                f"points {one + 1} and {other + 1} are {'' if loop[one] == loop[other] else 'nearly '}the same, "
                f"{_shown(loop[other])}",
                f"different points, at least {near:.2g} m apart",
                "leave the last one out: the polygon closes by itself" if last else "leave one of them out",
            )
            continue
        if np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)[1] < near:
            yield _fault(
                number, "points on one line, without area", "corners of an area", "points that are not in line"
            )
            continue
        sides = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        met = next(_meetings(sides, sides, near, True), None)
        if met is not None:
            yield _fault(
                number,
                f"the sides from points {met[0] + 1} and {met[1] + 1} meet each other, at {_shown(met[2])}",
                "sides that meet in corners only",
                "corners one after the other around the polygon, in either direction",
            )
            continue
        outline = PolygonOutline((tuple(loop if signed_area(loop) > 0.0 else loop[::-1]),))
        angles = np.degrees(outline.inner_angles())
        inner = angles if number == 0 else 360.0 - angles
        sharp = int(np.argmin(inner))
        if inner[sharp] < SHARPEST:
            found, least = apart(float(inner[sharp]), SHARPEST)
            yield _fault(
                number,
                f"an angle of {found} degrees at {_shown(outline.loops[0][sharp])}",
                f"at least {least} degrees: cells in a sharper corner are of no use",
                "blunt the corner by one more point",
            )


def _poor_nesting(loops: Sequence[Loop], size: float) -> Iterator[Fault]:
    """Yield holes that are not in the polygon, or not apart from each other."""
    sides = [np.stack([np.array(loop), np.roll(np.array(loop), -1, axis=0)], axis=1) for loop in loops]
    whole = PolygonOutline((tuple(loops[0]),))
    for number in range(1, len(loops)):
        met = next(_meetings(sides[0], sides[number], CLOSE * size, False), None)
        if met is not None:
            hint = "a hole that leaves a wall, or a polygon that goes around the notch"
            yield _fault(number, f"meets the outline at {_shown(met[2])}", "holes within the polygon", hint)
        elif not whole.contains(np.array(loops[number][:1]))[0]:
            found = f"outside of the polygon, at {_shown(loops[number][0])}"
            yield _fault(number, found, "holes within the polygon", "measure all points from the same place")
    for one, other in combinations(range(1, len(loops)), 2):
        met = next(_meetings(sides[one], sides[other], CLOSE * size, False), None)
        within = any(
            PolygonOutline((tuple(loops[a]),)).contains(np.array(loops[b][:1]))[0]
            for a, b in ((one, other), (other, one))
        )
        if met is not None or within:
            found = f"overlaps hole {one}, at {_shown(met[2] if met is not None else loops[other][0])}"
            yield _fault(other, found, "holes apart from each other", "make one hole of both")


def _meetings(ones: Array, others: Array, near: float, same: bool) -> Iterator[tuple[int, int, Place]]:
    """Yield sides that cross or come near to each other: their numbers, and where; of one loop those not adjacent."""
    for number in range(len(ones)):
        first = number + 1 if same else 0
        for other in range(first, len(others)):
            beside = same and (other == number + 1 or (number == 0 and other == len(others) - 1))
            if beside:
                continue
            place = _meeting(ones[number], others[other], near)
            if place is not None:
                yield number, other, place


def _meeting(one: Array, other: Array, near: float) -> Place | None:
    """Return the place where two sides cross, or come near to each other."""
    (a, b), (c, d) = one, other
    along, across, away = b - a, d - c, c - a
    below = along[0] * across[1] - along[1] * across[0]
    if abs(below) > 0.0:
        share = (away[0] * across[1] - away[1] * across[0]) / below
        part = (away[0] * along[1] - away[1] * along[0]) / below
        if 0.0 <= share <= 1.0 and 0.0 <= part <= 1.0:
            return float(a[0] + share * along[0]), float(a[1] + share * along[1])
    for place, start, way in ((a, c, across), (b, c, across), (c, a, along), (d, a, along)):
        part = min(max(float((place - start) @ way / (way @ way)), 0.0), 1.0)
        if float(np.linalg.norm(place - start - part * way)) < near:
            return float(place[0]), float(place[1])
    return None


def _shown(place: Place) -> str:
    return f"[{place[0]:g}, {place[1]:g}]"


MOST = 200  # corners of one loop
MOST_HOLES = 16

Corners = Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3, max_length=MOST)]


class PolygonSection(SectionTable):
    """A polygon with holes; thickness and width are its extents, around the axis of the beam.

    Area and second moments are exact. Torsion constant, shear coefficients and shear center come from finite elements
    on the cross-section, `saint_venant`, within 1e-4.
    """

    type: Literal["polygon"] = Field(
        description="a closed polygon, with or without holes, as high and wide as the beam"
    )
    points: Corners = Field(
        description="corners [y, z] in order, y across and z along the bending direction, from any origin, m",
        examples=[[[-0.02, 0.0], [0.02, 0.0], [0.012, 0.014], [-0.012, 0.014]]],
    )
    holes: Annotated[tuple[Corners, ...], Field(max_length=MOST_HOLES)] = Field(
        default=(), description="corners of each hole, from the same origin, m"
    )

    def outline(self, thickness: float, width: float) -> PolygonOutline:  # noqa: ARG002
        """Return its outline, with the axis of the beam in the middle."""
        return self._polygon

    @property
    def _polygon(self) -> PolygonOutline:
        return _outline(self.points, self.holes)

    @property
    def mirrored(self) -> bool:
        """True where the polygon is symmetric about the bending plane."""
        return self._polygon.mirrored

    @property
    def lattice(self) -> Lattice:
        """Rectangles, if all sides are upright or level."""
        return "rectangles" if self._polygon.upright else "own"

    def area(self, thickness: float, width: float) -> float:
        """Return the area by Green's theorem; the product of the extents for a polygon that is refused."""
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
        """Yield the faults of a polygon by itself and against the size of the beam."""
        yield from polygon_faults(self.points, self.holes, thickness, width)


@lru_cache(maxsize=256)
def _outline(points: tuple[Place, ...], holes: tuple[tuple[Place, ...], ...]) -> PolygonOutline:
    """Return the outline of corners, once for each polygon."""
    return PolygonOutline.of(points, holes)
