"""The motions that a beam is made of: bending in one plane or two, tension and twist, with DOFs of their own each.

    u_x = u - (z - z_c) theta - y psi,    u_y = v - z a,    u_z = w + y a

z_c is the centroid, and u its motion. Sections whose bending couples with twist, or with that in the other plane, are
refused, so that these motions do not couple but by contact, friction, loads and joints.
The section keeps its shape, and turns by a small angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.attachments.mean_motion import MotionName
from gapbeam.solver.models.elastic_rod import ElasticRod
from gapbeam.solver.models.stepped_beam import SteppedBeam
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.sparse_operators import SparseOperators

NO_ARM = 1.0e-12  # of the distance from the axis: what round-off leaves of a force through it


class BeamPart(Protocol):
    """One motion of a beam."""

    @property
    def size(self) -> int:
        """Number of DOFs."""

    def operators(self) -> SparseOperators:
        """Return M and K."""

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return the motion of points of the beam along directions, (k, size).

        Args:
            places: The points, (k, 3) or, of a slice, (k, 2) and more, m.
            directions: (k, dimension).
        """

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (k dimension, size)."""

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of a motion of the cross-section at a place, (size,); None: it is not one of this part."""

    def uniform(self, direction: Array) -> Array:
        """Return the motion of all sections by a vector, (size,)."""

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return the rigid motions of this part by what the section at x = 0 does, (size,) each."""


@dataclass(frozen=True)
class BendingPart:
    """Bending in one plane.

    Attributes:
        beam: The plane beam.
        axis: Component of its deflection.
        dimension: Of displacements, 2 or 3.
        names: Of its deflection and rotation.
    """

    beam: SteppedBeam
    axis: int
    dimension: int
    names: tuple[MotionName, MotionName]

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return self.beam.size

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return self.beam.operators()

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return w e_z - (z - z_c) theta e_x, (k, size)."""
        w, theta = self.beam.rows(places[:, 0])
        moved = w.multiply(directions[:, self.axis, None])
        if np.any(directions[:, 0]):
            arms = self.beam.neutral - places[:, self.axis]
            moved = moved + theta.multiply((arms * directions[:, 0])[:, None])
        return csr_matrix(moved)

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (k dimension, size)."""
        w, theta = self.beam.rows(places[:, 0])
        along, bending = w.tocoo(), csr_matrix(theta.multiply(self.beam.neutral - places[:, self.axis, None])).tocoo()
        rows = np.concatenate([self.dimension * along.row + self.axis, self.dimension * bending.row])
        entries = np.concatenate([along.data, bending.data]), (rows, np.concatenate([along.col, bending.col]))
        return csr_matrix(entries, (self.dimension * len(places), self.size))

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of w or theta at a place, (size,)."""
        if name not in self.names:
            return None
        return np.asarray(self.beam.rows(np.array([x]))[self.names.index(name)].toarray()[0])

    def uniform(self, direction: Array) -> Array:
        """Return w of all nodes, (size,)."""
        return np.tile([direction[self.axis], 0.0], self.beam.elements + 1)

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return w = 1, and w = x with theta = 1, (size,)."""
        return dict(zip(self.names, self.beam.heave_and_pitch(), strict=True))


@dataclass(frozen=True)
class AxialPart:
    """Tension and compression.

    Attributes:
        rod: The rod.
        dimension: Of displacements, 2 or 3.
    """

    rod: ElasticRod
    dimension: int

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return self.rod.size

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return self.rod.operators()

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return u e_x, (k, size)."""
        return csr_matrix(self.rod.rows(places[:, 0]).multiply(directions[:, 0, None]))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (k dimension, size)."""
        return in_components(self.rod.rows(places[:, 0]), {0: np.ones(len(places))}, self.dimension)

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of u at a place, (size,)."""
        return self.rod.rows(np.array([x])).toarray()[0] if name == "axial" else None

    def uniform(self, direction: Array) -> Array:
        """Return u of all nodes, (size,)."""
        return np.full(self.size, float(direction[0]))

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return u = 1, (size,)."""
        return {"axial": np.ones(self.size)}


@dataclass(frozen=True)
class TorsionPart:
    """Twist about the axis, in 3D.

    Attributes:
        rod: The shaft.
    """

    rod: ElasticRod

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return self.rod.size

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return self.rod.operators()

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return a (y e_z - z e_y), (k, size)."""
        y, z = places[:, 1], places[:, 2]
        arms = y * directions[:, 2] - z * directions[:, 1]
        arms = np.where(np.abs(arms) > NO_ARM * np.hypot(y, z), arms, 0.0)
        return csr_matrix(self.rod.rows(places[:, 0]).multiply(arms[:, None]))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (3 k, size)."""
        return in_components(self.rod.rows(places[:, 0]), {1: -places[:, 2], 2: places[:, 1]}, 3)

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of a at a place, (size,)."""
        return self.rod.rows(np.array([x])).toarray()[0] if name == "twist" else None

    def uniform(self, direction: Array) -> Array:  # noqa: ARG002
        """Return zeros: a section that moves as a whole does not turn."""
        return np.zeros(self.size)

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return a = 1, (size,)."""
        return {"twist": np.ones(self.size)}


def in_components(rows: csr_matrix, factors: dict[int, Array], dimension: int) -> csr_matrix:
    """Return what gives vectors whose components are factors times a motion, (k dimension, n)."""
    parts = [(axis, csr_matrix(rows.multiply(factor[:, None])).tocoo()) for axis, factor in factors.items()]
    places = np.concatenate([dimension * part.row + axis for axis, part in parts])
    columns = np.concatenate([part.col for _, part in parts])
    shape = (dimension * rows.shape[0], rows.shape[1])
    return csr_matrix((np.concatenate([part.data for _, part in parts]), (places, columns)), shape)
