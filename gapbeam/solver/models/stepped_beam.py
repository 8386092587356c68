"""Stepped Timoshenko beams of several prismatic parts: beams with [[segment]], and graded elements.

Deflection and rotation are continuous where two parts meet; curvature and shear strain jump there with section and
material. The elements do not know that the corners of a shoulder carry nothing: a solid with steps is a bit softer.

Bending in one plane or two, tension and twist have DOFs of their own each,

    u_x = u - (z - z_c) theta - y psi,    u_y = v - z a,    u_z = w + y a

z_c is the centroid, and u its motion. Sections whose bending couples with twist, or with that in the other plane, are
refused, so that these motions do not couple but by contact, friction, loads and joints.
The section keeps its shape, and turns by a small angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.attachments.mean_motion import MotionName
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.element_spacing import graded_places
from gapbeam.solver.models.elastic_rod import ElasticRod
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam, as_rows, heave_and_pitch_at, of_elements
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class SteppedBeam:
    """Prismatic beams in a row; DOFs w, theta of one node after the other.

    Attributes:
        parts: The prismatic beams; the last node of each is the first one of the next.
        starts: Where they begin, m.
        neutral: Height of the centroid above the axis, where bending gives no axial strain, m.
    """

    parts: tuple[TimoshenkoBeam, ...]
    starts: tuple[float, ...]
    neutral: float = 0.0

    @classmethod
    def of_case(cls, case: Case, elements: int, lateral: bool = False, graded: bool = False) -> SteppedBeam:
        """Return the beam of a case, in its bending plane or, in 3D, across it.

        Args:
            case: The case.
            elements: Their number in all; each piece of the beam has its share, and one at least.
            lateral: Whether it bends across the bending plane.
            graded: Whether elements are shorter in supports than between them; else those of a piece are equal.
        """
        pieces = case.profile.pieces
        neutral = pieces[0].beam.centroid[0 if lateral else 1]
        if graded:
            places = graded_places(case, elements)
            alike = {piece: TimoshenkoBeam.of_piece(case, piece, 1.0, 1, lateral) for piece in pieces}
            parts = [
                alike[case.profile.at(0.5 * (start + end))].of_length(end - start)
                for start, end in pairwise(map(float, places))
            ]
            return cls(tuple(parts), tuple(map(float, places[:-1])), neutral)
        shares = [elements * (piece.end - piece.start) / case.beam.length for piece in pieces]
        counts = [elements] if len(pieces) == 1 else [max(1, round(share)) for share in shares]
        parts = [
            TimoshenkoBeam.of_piece(case, piece, piece.end - piece.start, count, lateral)
            for piece, count in zip(pieces, counts, strict=True)
        ]
        return cls(tuple(parts), tuple(piece.start for piece in pieces), neutral)

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(part.elements for part in self.parts)

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return 2 * (self.elements + 1)

    @property
    def places(self) -> Array:
        """Places of the nodes, (elements + 1,), m."""
        places = [start + part.places for part, start in zip(self.parts, self.starts, strict=True)]
        return np.concatenate([*(one[:-1] for one in places), places[-1][-1:]])

    def rows(self, x: Array) -> tuple[csr_matrix, csr_matrix]:
        """Return the matrices of w and theta at places, (k, n) each."""
        which = np.clip(np.searchsorted(self.starts, x, side="right") - 1, 0, len(self.parts) - 1)
        firsts = 2 * np.cumsum([0, *(part.elements for part in self.parts)])
        order = np.argsort(which, kind="stable")
        w, theta, columns = np.empty((len(x), 4)), np.empty((len(x), 4)), np.empty((len(x), 4), dtype=int)
        breaks = np.flatnonzero(np.diff(which[order])) + 1
        for here in np.split(order, breaks) if len(order) else ():
            number = which[here[0]]
            w[here], theta[here], own = self.parts[number].shapes_at(x[here] - self.starts[number])
            columns[here] = firsts[number] + own
        return as_rows(w, theta, columns, self.size)

    def heave_and_pitch(self) -> Array:
        """Return both rigid motions, (2, n): w = 1, and w = x with theta = 1."""
        return heave_and_pitch_at(self.places)

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return of_elements(self.parts)


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
    """Return the matrix of vectors whose components are factors times a motion, (k dimension, n)."""
    parts = [(axis, csr_matrix(rows.multiply(factor[:, None])).tocoo()) for axis, factor in factors.items()]
    places = np.concatenate([dimension * part.row + axis for axis, part in parts])
    columns = np.concatenate([part.col for _, part in parts])
    shape = (dimension * rows.shape[0], rows.shape[1])
    return csr_matrix((np.concatenate([part.data for _, part in parts]), (places, columns)), shape)
