"""Faces around a round section, whose contact points are met across the beam in any direction.

A contact point x across the beam, which meets a wall with the outward normal n, has the gap

    g = R - n . x + n . o,    R = R_b + c + p

with R_b the outer radius of the beam, or how far its points reach toward a flat wall, c the clearance, p what the wall
is farther away than that, and o the offset of the middle of the support from the axis of the beam. A point that moves
by u closes its gap by d . u with d its radius: forces act through the axis, and a beam that turns about it moves no
gap. Radii keep to their points. That errs by c^2 / (2 R_b) in depth and c / R_b in direction, where the play is small
beside the radius.

Directions are angles from straight down, positive toward +y: (sin t, -cos t). Straight walls bound a convex area,
n . o <= b for all walls.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import scipy
from numpy.typing import NDArray

from gapbeam.solver.supports.support import Array, Face, Indices


def centroid(normals: Array, limits: Array) -> tuple[tuple[float, float], float] | None:
    """Return the centroid of the area, m, and its distance to the nearest wall, m; None where the area is open.

    Of an area without a point that is free, the point that all walls overlap least, and by how much, negative.

    Args:
        normals: Outward unit normals n of the walls, (k, 2).
        limits: b of each, (k,), m.
    """
    turns = np.sort(np.arctan2(normals[:, 0], normals[:, 1]))
    if np.max(np.diff(turns, append=turns[0] + 2.0 * np.pi)) >= np.pi * (1.0 - 1.0e-12):
        return None
    unit = float(np.max(np.abs(limits))) or 1.0
    walls = np.column_stack([normals, np.ones(len(normals))])
    inner = scipy.optimize.linprog([0.0, 0.0, -1.0], walls, limits / unit, bounds=[(None, None)] * 3).x
    if inner[2] <= 0.0:
        return (unit * float(inner[0]), unit * float(inner[1])), unit * float(inner[2])
    corners = scipy.spatial.HalfspaceIntersection(np.column_stack([normals, -limits / unit]), inner[:2]).intersections
    corners = corners[scipy.spatial.ConvexHull(corners).vertices]
    following = np.roll(corners, -1, axis=0)
    doubled = corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1]
    middle = unit * (doubled @ (corners + following)) / (3.0 * np.sum(doubled))
    return (float(middle[0]), float(middle[1])), float(np.min(limits - normals @ middle))


LEVEL = 1.0e-6  # less of a normal upward than this is round-off of an angle of 90 degrees

LOOKS = 0.5  # cosine between the radius of a point and the normal of its wall; farther aside it cannot touch


def across(angles: Sequence[float] | Array) -> Array:
    """Return the unit vectors (y, z) of angles from straight down, degrees, (n, 2)."""
    turns = np.radians(angles)
    return np.stack([np.sin(turns), -np.cos(turns)], axis=-1)


def _radii(positions: Array) -> Array:
    """Return the outward unit vectors from the axis of the beam, (m, 2)."""
    return np.asarray(positions[:, 1:] / np.linalg.norm(positions[:, 1:], axis=1)[:, None])


@dataclass(frozen=True)
class AroundFace(Face):
    """The inside of a support around the beam.

    Attributes:
        offset: Height of its middle above the axis of the beam, m.
        lateral: Distance from that axis toward +y, m.
    """

    offset: float = 0.0
    lateral: float = 0.0

    around: ClassVar[bool] = True

    @property
    def carries(self) -> bool:
        """A beam rests on its lower half."""
        return True

    @abstractmethod
    def normals(self, positions: Array) -> Array:
        """Return the outward unit normals n of the walls that contact points meet, (m, 2)."""

    @abstractmethod
    def recess(self, positions: Array) -> Array:
        """Return p, how much farther away than the clearance the wall is that contact points meet, (m,), m."""

    @property
    @abstractmethod
    def outline(self) -> tuple[Array, Array]:
        """Normals n of the walls, (k, 2), and p there, (k,), m: as many as describe the face."""

    @property
    def middle_of_play(self) -> tuple[float, float, float] | None:
        """Centroid (y, z) of the area that the axis may move in, and its distance to the edge, m; None: it is open."""
        normals, recesses = self.outline
        found = centroid(normals, self.gap + recesses)
        if found is None:
            return None
        (lateral, height), left = found
        return self.lateral + lateral, self.offset + height, left

    def room(self, x: float, lateral: float, height: float) -> float:
        """Return the smallest of c + p - n . (u - o), m."""
        normals, recesses = self.outline
        moved = np.array([lateral - self.lateral, height - self.offset - self.tilt * (x - self.middle)])
        return float(np.min(self.gap + recesses - normals @ moved))

    @property
    def shape(self) -> dict[str, Any]:
        """Shape in results: the middle of the face, and values of a subclass."""
        return {**super().shape, "offset": self.offset, "lateral": self.lateral}

    def gaps(self, positions: Array) -> Array:
        """Return R - n . x + n . o, (m,), m."""
        reach = np.einsum("ma,ma->m", self.normals(positions), positions[:, 1:])
        return np.asarray(self.gap + (self.outermost(positions, reach) - reach) + self._moved(positions))

    def outermost(self, positions: Array, reach: Array) -> Array:  # noqa: ARG002
        """Return R_b, where the outermost contact points are, (m,), m.

        Args:
            positions: Contact points, (m, 3), m.
            reach: n . x of each, (m,), m.
        """
        return np.full(len(reach), reach.max())

    def opening(self, positions: Array) -> Array:
        """Return -d, (m, 3)."""
        return np.column_stack([np.zeros(len(positions)), -_radii(positions)])

    def growth(self, old: Face, positions: Array) -> Array:
        """Return the growth by another clearance, offset, tilt or recess, (m,), m."""
        if not isinstance(old, AroundFace):
            raise TypeError(f"{old.name} is not met all around the beam")
        return np.asarray(self.gap - old.gap + self._moved(positions) - old._moved(positions))

    def _moved(self, positions: Array) -> Array:
        """Return p + n . o, (m,), m."""
        along = self.normals(positions)
        lift = self.offset + self.rise(positions)
        return np.asarray(self.recess(positions) + along[:, 0] * self.lateral + along[:, 1] * lift)


@dataclass(frozen=True)
class BoreFace(AroundFace):
    """The inside of a round hole.

    Attributes:
        exact: Whether it is met as a circle by sections that keep their shape, and not at points around them.
    """

    exact: bool = False

    @property
    def circle(self) -> bool:
        """True where contact is met as a circle."""
        return self.exact

    @property
    def outline(self) -> tuple[Array, Array]:
        """Whole degrees."""
        turns = np.linspace(-180.0, 179.0, 360, dtype=np.float64)
        return across(turns), np.zeros(len(turns))

    def normals(self, positions: Array) -> Array:
        """Return the radii of the section."""
        return _radii(positions)

    def recess(self, positions: Array) -> Array:
        """Return zeros."""
        return np.zeros(len(positions))

    @property
    def middle_of_play(self) -> tuple[float, float, float] | None:
        """Middle of the hole."""
        return self.lateral, self.offset, self.gap

    def room(self, x: float, lateral: float, height: float) -> float:
        """Return c - abs(u - o), m."""
        lift = height - self.offset - self.tilt * (x - self.middle)
        return self.gap - float(np.hypot(lateral - self.lateral, lift))

    @property
    def smallest(self) -> float:
        """The clearance less the offset."""
        return self.gap - float(np.hypot(self.offset, self.lateral))


@dataclass(frozen=True)
class ProfileFace(AroundFace):
    """The inside of a hole that is not round: p is linear between angles, and periodic.

    Attributes:
        angles: Degrees from straight down, positive toward +y, in ascending order.
        recesses: p there, m.
    """

    angles: tuple[float, ...] = ()
    recesses: tuple[float, ...] = ()

    def normals(self, positions: Array) -> Array:
        """Return the radii of the section."""
        return _radii(positions)

    @property
    def outline(self) -> tuple[Array, Array]:
        """The given angles and whole degrees between them."""
        turns = np.union1d(np.arange(-180.0, 180.0), self.angles)
        return across(turns), np.interp(turns, self.angles, self.recesses, period=360.0)

    def recess(self, positions: Array) -> Array:
        """Return p between the given angles."""
        turns = np.degrees(np.arctan2(positions[:, 1], -positions[:, 2]))
        return np.asarray(np.interp(turns, self.angles, self.recesses, period=360.0))

    @property
    def smallest(self) -> float:
        """The smallest gap at the given angles and at whole degrees between them."""
        turns = np.union1d(np.arange(-180.0, 180.0), self.angles)
        directions = across(turns)
        return float(np.min(self.gap + self._moved(np.column_stack([np.full(len(turns), self.middle), directions]))))

    @property
    def shape(self) -> dict[str, Any]:
        """Angles and recesses."""
        return {**super().shape, "angles": list(self.angles), "recesses": list(self.recesses)}


@dataclass(frozen=True)
class WallsFace(AroundFace):
    """Flat walls around the beam: every contact point meets the wall that it looks at most, if any.

    Attributes:
        angles: Directions of the walls, degrees from straight down, positive toward +y.
        recesses: Distance of each wall beyond the clearance, m.
    """

    angles: tuple[float, ...] = ()
    recesses: tuple[float, ...] = ()

    @property
    def carries(self) -> bool:
        """A beam rests on a wall that looks up."""
        return bool(np.any(across(self.angles)[:, 1] < -LEVEL))

    @property
    def outline(self) -> tuple[Array, Array]:
        """The walls."""
        return across(self.angles), np.array(self.recesses)

    def wall_of(self, positions: Array) -> Indices:
        """Return the number of the wall that contact points meet, (m,)."""
        return np.asarray(np.argmax(positions[:, 1:] @ across(self.angles).T, axis=1))

    def meets(self, positions: Array) -> NDArray[np.bool_]:
        """Return whether points look at a wall."""
        return np.asarray(np.einsum("ma,ma->m", self.normals(positions), _radii(positions)) > LOOKS)

    def normals(self, positions: Array) -> Array:
        """Return the normals of the walls."""
        return np.asarray(across(self.angles)[self.wall_of(positions)])

    def outermost(self, positions: Array, reach: Array) -> Array:
        """Return the reach of points toward each wall: a wall that lies between points is met without a gap."""
        wall, farthest = self.wall_of(positions), np.zeros(len(self.angles))
        np.maximum.at(farthest, wall, reach)
        return np.asarray(farthest[wall])

    def recess(self, positions: Array) -> Array:
        """Return p of the walls."""
        return np.asarray(np.array(self.recesses)[self.wall_of(positions)])

    @property
    def smallest(self) -> float:
        """The gap at the nearest wall."""
        moved = across(self.angles) @ np.array([self.lateral, self.offset])
        return float(np.min(self.gap + np.array(self.recesses) + moved))

    @property
    def shape(self) -> dict[str, Any]:
        """Angles and recesses of the walls."""
        return {**super().shape, "angles": list(self.angles), "recesses": list(self.recesses), "flat": True}
