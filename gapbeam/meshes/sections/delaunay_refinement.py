"""Triangles that fill a region with straight sides: Delaunay's, with points added until they are good and small enough.

Source: Ruppert (1995), J. Algorithms 18, 548-585, for the refinement; circumcenters of many triangles enter at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import floor, log2

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.polygon_outline import BoolArray
from gapbeam.meshes.sections.section_patches import Array

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


def refined_delaunay(
    sides: Array, inside: Callable[[Array], BoolArray], wanted: Callable[[Array], Array], area: float
) -> Triangulation:
    """Return triangles of a region.

    Args:
        sides: Start and end of the sides around the region, and of lines in it that edges follow, (n, 2, 2), m.
        inside: Whether places, (k, 2), are in the region, (k,).
        wanted: Length of edges at places, (k,), m.
        area: Of the region, m^2.

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
        filled = 0.5 * float(np.abs(_doubled_areas(points, triangles)).sum())
        edges, numbers = edges_of(triangles)
        rim = edges[np.bincount(numbers.reshape(-1)) == 1]
        around = float(np.linalg.norm(points[rim[:, 1]] - points[rim[:, 0]], axis=1).sum())
        if abs(filled - area) > 1.0e-8 * area or abs(around - self.around) > 1.0e-8 * self.around:
            raise MeshError(
                "cross-section",
                found=f"a polygon whose triangles fill {filled:.6g} of {area:.6g} m^2",
                expected="sides that are apart from each other, beside the size of the polygon",
                hint="Leave out details far smaller than the section.",
            )
        used, numbered = np.unique(triangles, return_inverse=True)
        return Triangulation(points[used], numbered.reshape(-1, 3))

    def _kept(self, points: Array, triangles: Indices) -> Indices:
        """Return the triangles of the region, counterclockwise."""
        doubled = _doubled_areas(points, triangles)
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
        thin = np.where((shortest > 0.02 * length) & ~self._at_acute(triangles), radii / (WORST * shortest), 0.0)
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

    def _at_acute(self, triangles: Indices) -> BoolArray:
        """Return True for triangles that have an acute corner of the region as one of theirs."""
        return np.asarray(np.isin(triangles, list(self.acute)).any(axis=1))

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


def _doubled_areas(points: Array, triangles: Indices) -> Array:
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
