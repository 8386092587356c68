"""Stations of round sections in round holes, whose directions of contact turn as the sections move.

The equations are those of `gapbeam.solver.contact.formulations.circle_contact`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from gapbeam.solver.system.operators import Array, Indices

DOWN = np.array([0.0, -1.0])  # the direction of an axis that stands in the middle of its hole


def unit_vectors(vectors: Array, instead: Array) -> Array:
    """Return vectors, (k, 2), over their lengths, and another one instead of those without a length."""
    lengths = np.hypot(*vectors.T)[:, None]
    return np.where(lengths > 0.0, vectors / np.where(lengths > 0.0, lengths, 1.0), instead)


@dataclass(frozen=True)
class Circles:
    """The k stations.

    Attributes:
        points: Number of the contact point of each station, (k,).
        members: The points around each section that it stands for, among the points around all sections.
        plane: Rows that give the motion of each axis along y and z, (2k, interface.size).
        surface: Rows that give the motion of the surface: along x on the axis, its change along y and z, and the
            rotation about x, (4k, interface.size); None: not needed.
        radii: Outer radius of each section, (k,), m.
        middles: Middle of each hole, y and z from the axis of the undeformed beam, (k, 2), m.
        clearances: c, (k,), m.
        shifts: Shifts of middle and clearance of each hole by a unit of each motion of walls, (walls, k, 3).
    """

    points: Indices
    members: tuple[Indices, ...]
    plane: scipy.sparse.csr_matrix
    surface: scipy.sparse.csr_matrix | None
    radii: Array
    middles: Array
    clearances: Array
    shifts: Array = field(default_factory=lambda: np.zeros((0, 1, 3)))

    def __len__(self) -> int:
        """Return k."""
        return len(self.points)

    def moved(self, walls: Array) -> Circles:
        """Return the stations with their holes elsewhere.

        Args:
            walls: Displacement of each motion of walls, (walls,).
        """
        if len(self.shifts) == 0:
            return self
        change = np.einsum("w,wka->ka", walls, self.shifts)
        return replace(self, middles=self.middles + change[:, :2], clearances=self.clearances + change[:, 2])

    def growths(self, opening: Array) -> Array:
        """Return by how much a unit of each motion of walls opens gaps along directions, (k, 2): (walls, k)."""
        return np.asarray(self.shifts[:, :, 2] - np.einsum("wka,ka->wk", self.shifts[:, :, :2], opening))

    def places(self, interface_values: Array) -> Array:
        """Return r, (k, 2), m."""
        return np.asarray((self.plane @ interface_values).reshape(-1, 2) - self.middles)

    def penetrations(self, places: Array) -> Array:
        """Return |r| - c, (k,), m."""
        return np.asarray(np.hypot(*places.T) - self.clearances)

    def directions(self, places: Array) -> Array:
        """Return r / |r|, (k, 2); down where r is 0."""
        return unit_vectors(places, DOWN)

    def forces(self, across: Array, normal: Array, friction: Array | None) -> Array:
        """Return the forces on each section, (k, 6).

        Forces along y and z, the friction f along x, f n_y, f n_z, and the friction around the section, N, with n the
        direction in which the gap opens. The surface touches at -R n from the axis.

        Args:
            across: n, (k, 2).
            normal: Normal forces, (k,), N.
            friction: Friction along x and around the section, (k, 2), N; None: nothing rubs.
        """
        along, around = np.zeros((2, len(self))) if friction is None else friction.T
        pushed = normal[:, None] * across + around[:, None] * np.column_stack([-across[:, 1], across[:, 0]])
        return np.column_stack([pushed, along, along[:, None] * across, around])

    def opening(self, before: Array, after: Array) -> Array:
        """Return o = -z / s of a step from r0 to r1, (k, 2); 0 where both are 0."""
        lengths = (np.hypot(*before.T) + np.hypot(*after.T))[:, None]
        return np.asarray(-(before + after) / np.where(lengths > 0.0, lengths, 1.0))


def no_circles(size: int) -> Circles:
    """Return the stations of contact without round holes, on an interface of a size: none."""
    none, rows = np.zeros(0), scipy.sparse.csr_matrix((0, size))
    return Circles(none.astype(np.int64), (), rows, rows, none, none.reshape(0, 2), none)
