"""Outline of a cross-section bounded by straight sides: from its corners or its patches, with holes and exact moments.

The outline of patches consists of the sides that only one patch has, joined to loops.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import atan2, ceil, cos, hypot, pi, sin

import numpy as np
import numpy.typing as npt

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
            holes: Those of each hole, m.
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
