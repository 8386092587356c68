"""Outline of a cross-section with straight sides, holes and exact moments, and the triangles that fill it.

Outlines come from corners or from patches: the sides that only one patch has, joined to loops.

The triangles are Delaunay's, with points added until they are good and small enough.

Source: Ruppert (1995), J. Algorithms 18, 548-585, for the refinement; circumcenters of many triangles enter at once.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import atan2, ceil, cos, floor, hypot, log2, pi, sin

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_patches import Array, Place, SectionCurve, SectionPatches

SAME = 1.0e-9  # of the size: places this close to each other are one
BoolArray = npt.NDArray[np.bool_]
Loop = tuple[Place, ...]


@dataclass(frozen=True)
class OutlineMoments:
    """Area and moments of area about the axis of the beam, by Green's theorem.

    Attributes:
        area: m^2.
        y: int y dA, m^3.
        z: int z dA, m^3.
        yy: int y^2 dA, m^4.
        zz: int z^2 dA, m^4.
        yz: int y z dA, m^4.
    """

    area: float
    y: float
    z: float
    yy: float
    zz: float
    yz: float


@dataclass(frozen=True)
class PolygonOutline:
    """A closed polygon with holes. The axis of the beam is in the middle of its extents, at y = z = 0.

    Attributes:
        loops: Its corners, the outer ones counterclockwise first, those of each hole clockwise, (y, z), m.
    """

    loops: tuple[Loop, ...]

    @classmethod
    def of(cls, points: Sequence[Place], holes: Sequence[Sequence[Place]]) -> PolygonOutline:
        """Return the outline of corners that are measured from anywhere, in either direction around.

        Args:
            points: Corners of the polygon, m.
            holes: Corners of each hole, m.
        """
        middle = [0.5 * (min(values) + max(values)) for values in zip(*points, strict=True)]
        found = []
        for number, loop in enumerate((points, *holes)):
            moved = tuple((y - middle[0], z - middle[1]) for y, z in loop)
            counterclockwise = signed_area(moved) > 0.0
            found.append(moved if counterclockwise == (number == 0) else moved[::-1])
        return cls(tuple(found))

    @cached_property
    def extents(self) -> tuple[float, float]:
        """Size along y and z, m."""
        sides = zip(*self.loops[0], strict=True)
        across, through = (max(values) - min(values) for values in sides)
        return across, through

    @property
    def size(self) -> float:
        """The larger extent, m."""
        return max(self.extents)

    @cached_property
    def sides(self) -> Array:
        """Start and end of all sides, (n, 2, 2), m; the material is on their left."""
        return np.array([side for loop in self.loops for side in pairwise((*loop, loop[0]))])

    @cached_property
    def moments(self) -> OutlineMoments:
        """Area and moments about the axis."""
        (y0, z0), (y1, z1) = np.moveaxis(self.sides, 0, 2)
        cross = y0 * z1 - y1 * z0
        return OutlineMoments(
            math.fsum(cross) / 2.0,
            math.fsum(cross * (y0 + y1)) / 6.0,
            math.fsum(cross * (z0 + z1)) / 6.0,
            math.fsum(cross * (y0**2 + y0 * y1 + y1**2)) / 12.0,
            math.fsum(cross * (z0**2 + z0 * z1 + z1**2)) / 12.0,
            math.fsum(cross * (2.0 * y0 * z0 + y0 * z1 + y1 * z0 + 2.0 * y1 * z1)) / 24.0,
        )

    @cached_property
    def centroid(self) -> Place:
        """Centroid relative to the axis, m."""
        found = self.moments
        return (found.y / found.area, found.z / found.area) if found.area > 0.0 else (0.0, 0.0)

    @cached_property
    def second_moments(self) -> tuple[float, float, float]:
        """Moments of area int y^2 dA, int z^2 dA and int y z dA about the centroid, m^4."""
        found, (y, z) = self.moments, self.centroid
        return found.yy - found.area * y**2, found.zz - found.area * z**2, found.yz - found.area * y * z

    @cached_property
    def mirrored(self) -> bool:
        """True where corners and sides are symmetric about the bending plane, y = 0."""
        places = np.concatenate([self.sides[:, 0], self.sides.mean(axis=1)])
        apart = np.linalg.norm(places[:, None] * [-1.0, 1.0] - places[None], axis=2)
        return bool(np.all(apart.min(axis=1) <= SAME * self.size))

    @cached_property
    def upright(self) -> bool:
        """True where all sides are parallel to y or z."""
        along = np.abs(self.sides[:, 1] - self.sides[:, 0])
        return bool(np.all(along.min(axis=1) <= SAME * self.size))

    def flat(self, above: bool) -> float:
        """Return the length of the sides that a plane above, or below, touches, m: 0 where it touches a corner."""
        end = 0.5 * self.extents[1] * (1.0 if above else -1.0)
        touching = np.all(np.abs(self.sides[:, :, 1] - end) <= SAME * self.size, axis=1)
        along = np.abs(self.sides[:, 1, 0] - self.sides[:, 0, 0])
        return float(along[touching].sum())

    def contains(self, places: Array) -> BoolArray:
        """Return whether places, (k, 2), are in the material or on a side, (k,)."""
        (y0, z0), (y1, z1) = np.moveaxis(self.sides, 0, 2)
        y, z = places[:, :1], places[:, 1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = y0 + (z - z0) * (y1 - y0) / (z1 - z0)
        passed = ((z0 <= z) != (z1 <= z)) & (crossing > y)
        odd = passed.sum(axis=1) % 2 == 1
        return np.asarray(odd | (self.distance(places) <= SAME * self.size))

    def distance(self, places: Array) -> Array:
        """Return the distance of places, (k, 2), from the nearest side, (k,), m."""
        start, along = self.sides[:, 0], self.sides[:, 1] - self.sides[:, 0]
        lengths = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
        away = places[:, None] - start
        share = np.clip(np.sum(away * along, axis=2) / lengths, 0.0, 1.0)
        found: Array = np.linalg.norm(away - share[:, :, None] * along, axis=2).min(axis=1)
        return found

    def free_about_axis(self) -> tuple[float, float]:
        """Return the free lengths along y and z from wall to wall around the axis, m; 0 where the axis is in a wall."""
        if self.contains(np.zeros((1, 2)))[0]:
            return 0.0, 0.0
        found = []
        for axis in (0, 1):
            start, end = self.sides[:, 0], self.sides[:, 1]
            level = (start[:, 1 - axis] <= 0.0) != (end[:, 1 - axis] <= 0.0)
            start, along = start[level], (end - start)[level]
            met = start[:, axis] - start[:, 1 - axis] * along[:, axis] / along[:, 1 - axis]
            both = [np.abs(met[met * side > 0.0]) for side in (-1.0, 1.0)]
            found.append(2.0 * min(float(np.min(one, initial=np.inf)) for one in both))
        return found[0], found[1]

    def walls(self, spacing: float) -> tuple[Array, Array]:
        """Return places on the sides, (k, 2), m, and how far it is from there straight through the material, (k,), m.

        Args:
            spacing: Largest distance between two places on a side, m.
        """
        found = []
        for start, end in self.sides:
            count = max(1, math.ceil(float(np.linalg.norm(end - start)) / spacing))
            shares = (np.arange(count) + 0.5) / count
            normal = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
            found += [(start + share * (end - start), normal) for share in shares]
        places, inward = (np.array(values) for values in zip(*found, strict=True))
        start, along = self.sides[:, 0], self.sides[:, 1] - self.sides[:, 0]
        away = start - places[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            below = inward[:, :1] * along[:, 1] - inward[:, 1:] * along[:, 0]
            reach = (away[..., 0] * along[:, 1] - away[..., 1] * along[:, 0]) / below
            share = (away[..., 0] * inward[:, 1:] - away[..., 1] * inward[:, :1]) / below
        met = (reach > SAME * self.size) & (share >= 0.0) & (share <= 1.0)
        return places, np.where(met, reach, np.inf).min(axis=1)

    def inner_angles(self) -> Array:
        """Return the angle of the material at the start of each side, (n,), rad: more than pi at re-entrant ones."""
        found = []
        for loop in self.loops:
            corners = np.array(loop)
            after, before = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
            turns = np.arctan2(before[:, 1], before[:, 0]) - np.arctan2(after[:, 1], after[:, 0])
            found.append(turns % (2.0 * math.pi))
        return np.concatenate(found)


def signed_area(loop: Sequence[Place]) -> float:
    """Return the area within corners, positive where they go around counterclockwise, m^2."""
    y, z = np.array(loop, dtype=float).T
    y, z = y - y.mean(), z - z.mean()
    return 0.5 * math.fsum(y * np.roll(z, -1) - np.roll(y, -1) * z)


CHORD = pi / 90.0  # rad: angle of a chord of an arc


def outline_of(patches: SectionPatches) -> PolygonOutline:
    """Return the outline of the cross-section that patches fill, arcs as chords.

    Args:
        patches: About the axis of the beam.

    Raises:
        ValueError: The free sides of the patches form no closed loops.
    """
    uses = Counter(number for patch in patches.patches for number, _ in patch)
    free = [patches.curves[number] for patch in patches.patches for number, _ in patch if uses[number] == 1]
    backward = [turned for patch in patches.patches for number, turned in patch if uses[number] == 1]
    following = {
        (curve.end if turned else curve.start): _places(curve, turned)
        for curve, turned in zip(free, backward, strict=True)
    }
    if len(following) != len(free):
        raise ValueError("two loops of free sides of the patches meet at one point")
    loops: list[Loop] = []
    while following:
        loop: list[Place] = []
        place = next(iter(following))
        while place in following:
            *passed, place = following.pop(place)
            loop += passed
        if place != loop[0]:
            raise ValueError(f"the free sides of the patches end at y = {place[0]:g}, z = {place[1]:g} m")
        loops.append(tuple(loop))
    outer, *holes = sorted(loops, key=lambda one: -abs(signed_area(one)))
    return PolygonOutline.of(outer, holes)


def _places(curve: SectionCurve, backward: bool) -> list[Place]:
    """Return the ends of a side with points between them on an arc, in the direction of its patch."""
    start, end = (curve.end, curve.start) if backward else (curve.start, curve.end)
    if not curve.arc:
        return [start, end]
    radius, first = hypot(*start), atan2(start[1], start[0])
    turn = (atan2(end[1], end[0]) - first + pi) % (2.0 * pi) - pi
    count = ceil(abs(turn) / CHORD)
    angles = [first + turn * number / count for number in range(1, count)]
    return [start, *((radius * cos(angle), radius * sin(angle)) for angle in angles), end]


Indices = npt.NDArray[np.int64]
ROUNDS = 200
MOST_POINTS = 60_000
WORST = 1.42  # circumradius over the shortest side: no angle below 20.6 degrees
LARGEST = 0.75  # circumradius over the wanted length: 0.577 where all sides are as long
ACUTE = 0.52  # cosine of an angle between sides, from which on points keep to circles around their corner
FLAT = 1.0e-12  # of the size squared: triangles smaller than this are of round-off
APART = 0.8  # of the circumradius: circumcenters nearer to each other than this do not enter at once


@dataclass(frozen=True)
class Triangulation:
    """Triangles of a region.

    Attributes:
        points: Their corners, (n, 2), m.
        triangles: Three corners of each, counterclockwise, (k, 3).
    """

    points: Array
    triangles: Indices

    def halved(self) -> Triangulation:
        """Return four triangles for each."""
        edges, numbers = edges_of(self.triangles)
        middles = 0.5 * (self.points[edges[:, 0]] + self.points[edges[:, 1]])
        a, b, c = self.triangles.T
        ab, bc, ca = len(self.points) + numbers.T
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return Triangulation(
            np.concatenate([self.points, middles]), np.concatenate([np.stack(part, axis=1) for part in parts])
        )


def edges_of(triangles: Indices) -> tuple[Indices, Indices]:
    """Return the edges of triangles, each once, (e, 2), and the numbers of the edges ab, bc, ca of each, (k, 3)."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, numbers = np.unique(sides, axis=0, return_inverse=True)
    return edges, numbers.reshape(-1, 3)


FILLED = 1.0e-8  # relative


def refuse_gaps(points: Array, triangles: Indices, area: float, other_rim: bool = False) -> None:
    """Refuse triangles that fill another area than that of their polygon, m^2, or have another rim.

    Raises:
        MeshError: The triangles do not fill the polygon.
    """
    filled = 0.5 * float(np.abs(doubled_areas(points, triangles)).sum())
    if abs(filled - area) > FILLED * area or other_rim:
        raise MeshError(
            "cross-section",
            found=f"a polygon whose triangles fill {filled:.6g} of {area:.6g} m^2",
            expected="sides that are apart from each other, beside the size of the polygon",
            hint="Leave out details far smaller than the section.",
        )


def refined_delaunay(
    sides: Array, inside: Callable[[Array], BoolArray], wanted: Callable[[Array], Array], area: float
) -> Triangulation:
    """Return triangles of a region.

    Args:
        sides: Start and end of the sides around the region, and of lines in it that edges follow, (n, 2, 2), m.
        inside: Whether places, (k, 2), are in the region, (k,).
        wanted: Length of edges at places, (k,), m.
        area: Area of the region, m^2.

    Raises:
        MeshError: The triangles do not fill the region, or are too many.
    """
    return _Refinement(sides, inside, wanted).triangulated(area)


class _Refinement:
    """Points and pieces of sides while points are added."""

    def __init__(self, sides: Array, inside: Callable[[Array], BoolArray], wanted: Callable[[Array], Array]) -> None:
        places: dict[tuple[float, float], int] = {}
        self.segments = [tuple(places.setdefault((float(y), float(z)), len(places)) for y, z in side) for side in sides]
        self.points = [np.array(place) for place in places]
        self.inside, self.wanted = inside, wanted
        self.size = float(np.ptp(np.array(self.points), axis=0).max())
        self.around = float(np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1).sum())
        self.acute = self._acute_corners()

    def triangulated(self, area: float) -> Triangulation:
        """Return the triangles once nothing is left to be split."""
        from scipy.spatial import Delaunay

        for _ in range(ROUNDS):
            points = np.array(self.points)
            triangles = self._kept(points, np.asarray(Delaunay(points).simplices, dtype=np.int64))
            if len(points) > MOST_POINTS:
                break
            if self._split(self._poor_segments(points, triangles)):
                continue
            if not self._add_centers(points, triangles):
                break
        edges, numbers = edges_of(triangles)
        rim = edges[np.bincount(numbers.reshape(-1)) == 1]
        around = float(np.linalg.norm(points[rim[:, 1]] - points[rim[:, 0]], axis=1).sum())
        refuse_gaps(points, triangles, area, abs(around - self.around) > FILLED * self.around)
        used, numbered = np.unique(triangles, return_inverse=True)
        return Triangulation(points[used], numbered.reshape(-1, 3))

    def _kept(self, points: Array, triangles: Indices) -> Indices:
        """Return the triangles of the region, counterclockwise."""
        doubled = doubled_areas(points, triangles)
        triangles = np.where((doubled < 0.0)[:, None], triangles[:, ::-1], triangles)
        large = np.abs(doubled) > FLAT * self.size**2
        triangles = triangles[large]
        kept: Indices = triangles[self.inside(points[triangles].mean(axis=1))]
        return kept

    def _poor_segments(self, points: Array, triangles: Indices) -> list[int]:
        """Return the segments that are no edge, too long, or seen from a corner at more than 90 degrees."""
        pairs = np.sort(np.array(self.segments), axis=1)
        edges = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        tips = triangles.reshape(-1)
        count = len(points)
        keys, own = edges[:, 0] * count + edges[:, 1], pairs[:, 0] * count + pairs[:, 1]
        ends = points[edges]
        seen = np.sum((ends[:, 0] - points[tips]) * (ends[:, 1] - points[tips]), axis=1)
        wide = keys[seen < -1.0e-9 * np.sum((ends[:, 1] - ends[:, 0]) ** 2, axis=1)]
        lengths = np.linalg.norm(points[pairs[:, 1]] - points[pairs[:, 0]], axis=1)
        poor = ~np.isin(own, keys) | np.isin(own, wide)
        poor |= lengths > 1.05 * self.wanted(points[pairs].mean(axis=1))
        return [int(number) for number in np.flatnonzero(poor)]

    def _split(self, numbers: list[int]) -> bool:
        """Halve segments; those at an acute corner where a circle around it passes."""
        for number in numbers:
            start, end = self.segments[number]
            share = 0.5
            if (start in self.acute) != (end in self.acute):
                length = float(np.linalg.norm(self.points[end] - self.points[start]))
                share = 2.0 ** floor(log2(0.75 * length / self.size)) * self.size / length
                share = share if start in self.acute else 1.0 - share
            new = len(self.points)
            self.points.append(self.points[start] + share * (self.points[end] - self.points[start]))
            self.segments[number] = (start, new)
            self.segments.append((new, end))
        return bool(numbers)

    def _add_centers(self, points: Array, triangles: Indices) -> bool:
        """Add circumcenters of bad triangles, far from each other, or split the segments that they come too near to."""
        corners = points[triangles]
        middles, radii = _circles(corners)
        shortest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min(axis=1)
        length = self.wanted(corners.mean(axis=1))
        long = radii / (LARGEST * length)
        at_acute = np.isin(triangles, list(self.acute)).any(axis=1)
        thin = np.where((shortest > 0.02 * length) & ~at_acute, radii / (WORST * shortest), 0.0)
        badness = np.maximum(long, thin)
        worst = [int(number) for number in np.argsort(-badness, kind="stable") if badness[number] > 1.0]
        ends = points[np.array(self.segments)]
        halves, centers = 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), ends.mean(axis=1)
        taken = np.zeros((0, 2))
        poor, found = set[int](), list[Array]()
        for number in worst:
            place, radius = middles[number], radii[number]
            if len(taken) and np.min(np.sum((taken - place) ** 2, axis=1)) < (APART * radius) ** 2:
                continue
            near = np.flatnonzero(np.sum((centers - place) ** 2, axis=1) < halves**2 * (1.0 - 1.0e-9))
            taken = np.vstack([taken, place])
            if len(near):
                poor.update(int(one) for one in near)
            elif self.inside(place[None])[0]:
                found.append(place)
        self.points += found
        return self._split(sorted(poor)) or bool(found)

    def _acute_corners(self) -> set[int]:
        """Return the points at which two sides meet at a small angle."""
        found = set()
        for one, (start, end) in enumerate(self.segments):
            for other in self.segments[one + 1 :]:
                for shared in {start, end} & set(other):
                    first, second = (
                        self.points[sum(pair) - shared] - self.points[shared] for pair in ((start, end), other)
                    )
                    if first @ second > ACUTE * np.linalg.norm(first) * np.linalg.norm(second):
                        found.add(shared)
        return found


def doubled_areas(points: Array, triangles: Indices) -> Array:
    """Return twice the areas of triangles, (k,), m^2; negative of those that run clockwise."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return np.asarray((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def _circles(corners: Array) -> tuple[Array, Array]:
    """Return centers and radii of the circles through corners of triangles."""
    a, b, c = np.moveaxis(corners, 1, 0)
    b, c = b - a, c - a
    doubled = 2.0 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    bb, cc = np.sum(b**2, axis=1), np.sum(c**2, axis=1)
    center = np.stack([c[:, 1] * bb - b[:, 1] * cc, b[:, 0] * cc - c[:, 0] * bb], axis=1) / doubled[:, None]
    return a + center, np.linalg.norm(center, axis=1)
