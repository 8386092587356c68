"""Timoshenko beam elements, and beams of several prismatic parts: with [[segment]], or of graded elements.

    V = 1/2 int E I theta'^2 + kappa G A (w' - theta)^2 + N w'^2 dx,    T = 1/2 int rho A w_t^2 + rho I theta_t^2 dx

with w across the axis and u_x = -z theta. The elements interpolate what a beam without load between its nodes takes
exactly without preload N, so that they do not lock. In plane strain E / (1 - nu^2) replaces E.

Source: Friedman and Kosmatka (1993) for the element; area, I and kappa are those of the cross-section.

Deflection and rotation are continuous where two parts meet; curvature and shear strain jump there with section and
material. The elements do not know that the corners of a shoulder carry nothing: a solid with steps is a bit softer.

Bending in one plane or two, tension and twist have DOFs of their own each,

    u_x = u - (z - z_c) theta - y psi,    u_y = v - z a,    u_z = w + y a

z_c is the centroid, and u its motion. Sections whose bending couples with twist, or with that in the other plane, are
refused, so that these motions do not couple but by contact, friction, loads and joints.
The section keeps its shape, and turns by a small angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite
from typing import ClassVar, Protocol

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.case.beam_profile import BeamPiece
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_choice import graded_places
from gapbeam.solver.loads.attachments import MotionName
from gapbeam.solver.models.elastic_rod import ElasticRod
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact for products of the cubic shapes


@dataclass(frozen=True)
class TimoshenkoBeam:
    """A prismatic beam of equal elements; DOFs w, theta of one node after the other.

    Attributes:
        length: m.
        elements: Number of elements.
        bending: E I, N m^2.
        shear: kappa G A, N; infinite: cross-sections stay normal to the axis.
        mass: rho A, kg/m.
        inertia: rho I, kg m.
        tension: N, an axial preload that the motion does not change, N; below 0: compression.
    """

    length: float
    elements: int
    bending: float
    shear: float
    mass: float
    inertia: float
    tension: float = 0.0

    @classmethod
    def of_piece(
        cls, case: Case, piece: BeamPiece, length: float, elements: int, lateral: bool = False
    ) -> TimoshenkoBeam:
        """Return a beam of some length like a piece of the beam of a case: in its bending plane or, in 3D, across."""
        beam, material = piece.beam, piece.material
        area, second = beam.area, beam.lateral_moment if lateral else beam.second_moment
        young, poisson = material.young_modulus, material.poisson_ratio
        kappa = beam.lateral_shear_coefficient(poisson) if lateral else beam.shear_coefficient(poisson)
        stiffened = young / (1.0 - poisson**2) if case.mesh.dimension == 2 and case.mesh.plane == "strain" else young
        return cls(
            length=length,
            elements=elements,
            bending=stiffened * second,
            shear=kappa * young / (2.0 * (1.0 + poisson)) * area,
            mass=material.density * area,
            inertia=material.density * second,
        )

    @property
    def places(self) -> Array:
        """Places of the nodes, (elements + 1,), m."""
        return np.asarray(np.linspace(0.0, self.length, self.elements + 1))

    def shapes_at(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the shapes of w and theta at places, and the DOFs that they belong to, (k, 4) each."""
        element = self.length / self.elements
        which = np.clip(np.floor(x / element).astype(int), 0, self.elements - 1)
        w, theta, _, _ = self._shapes(x / element - which)
        return w, theta, 2 * which[:, None] + np.arange(4)

    def element_matrices(self) -> tuple[Array, Array]:
        """Return M and K of one element, (4, 4) each."""
        length = self.length / self.elements
        w, theta, slope, curvature = self._shapes(0.5 * (1.0 + POINTS))
        factors = 0.5 * length * WEIGHTS[:, None]
        strain = slope - theta
        stiffness = curvature.T @ (self.bending * factors * curvature)
        if isfinite(self.shear):
            stiffness = stiffness + strain.T @ (self.shear * factors * strain)
        if self.tension:
            stiffness = stiffness + slope.T @ (self.tension * factors * slope)
        mass = w.T @ (self.mass * factors * w) + theta.T @ (self.inertia * factors * theta)
        return mass, stiffness

    def _shapes(self, xi: Array) -> tuple[Array, Array, Array, Array]:
        """Return shapes of w, theta, w' and theta' at xi in [0, 1] of an element, (k, 4) each."""
        length = self.length / self.elements
        phi = 12.0 * self.bending / (self.shear * length**2)
        share, one = 1.0 / (1.0 + phi), np.ones_like(xi)
        w = share * np.stack(
            [
                2.0 * xi**3 - 3.0 * xi**2 - phi * xi + (1.0 + phi),
                length * (xi**3 - (2.0 + 0.5 * phi) * xi**2 + (1.0 + 0.5 * phi) * xi),
                -2.0 * xi**3 + 3.0 * xi**2 + phi * xi,
                length * (xi**3 - (1.0 - 0.5 * phi) * xi**2 - 0.5 * phi * xi),
            ],
            axis=1,
        )
        slope = (share / length) * np.stack(
            [
                6.0 * xi**2 - 6.0 * xi - phi,
                length * (3.0 * xi**2 - (4.0 + phi) * xi + (1.0 + 0.5 * phi)),
                -6.0 * xi**2 + 6.0 * xi + phi,
                length * (3.0 * xi**2 - (2.0 - phi) * xi - 0.5 * phi),
            ],
            axis=1,
        )
        theta = share * np.stack(
            [
                6.0 * (xi**2 - xi) / length,
                3.0 * xi**2 - (4.0 + phi) * xi + (1.0 + phi),
                -6.0 * (xi**2 - xi) / length,
                3.0 * xi**2 - (2.0 - phi) * xi,
            ],
            axis=1,
        )
        curvature = (share / length) * np.stack(
            [
                6.0 * (2.0 * xi - one) / length,
                6.0 * xi - (4.0 + phi),
                -6.0 * (2.0 * xi - one) / length,
                6.0 * xi - (2.0 - phi),
            ],
            axis=1,
        )
        return w, theta, slope, curvature


def heave_and_pitch_at(places: Array) -> Array:
    """Return both rigid motions of nodes at places, (2, n): w = 1, and w = x with theta = 1."""
    ones, zeros = np.ones_like(places), np.zeros_like(places)
    return np.stack([np.stack(pair, axis=1).reshape(-1) for pair in ((ones, zeros), (places, ones))])


def as_rows(w: Array, theta: Array, columns: Array, size: int) -> tuple[csr_matrix, csr_matrix]:
    """Return shapes of w and theta, (k, 4), on their DOFs, (k, 4), as rows on all DOFs, (k, size) each."""
    places = (np.repeat(np.arange(len(w)), 4), columns.reshape(-1))
    shape = (len(w), size)
    return csr_matrix((w.reshape(-1), places), shape), csr_matrix((theta.reshape(-1), places), shape)


def of_elements(parts: Sequence[TimoshenkoBeam]) -> SparseOperators:
    """Return M and K of prismatic beams, one behind the other."""
    counts = np.array([part.elements for part in parts])
    each = zip(*(part.element_matrices() for part in parts), strict=True)
    firsts = 2 * np.arange(counts.sum())
    rows, columns = (firsts[:, None, None] + one for one in np.meshgrid(np.arange(4), np.arange(4), indexing="ij"))
    size, places = 2 * int(counts.sum() + 1), (rows.reshape(-1), columns.reshape(-1))
    whole = (np.repeat(np.array(matrices), counts, axis=0).reshape(-1) for matrices in each)
    return SparseOperators(*(csr_matrix((entries, places), (size, size)) for entries in whole))


@dataclass(frozen=True)
class SteppedBeam:
    """Prismatic beams in a row; DOFs w, theta of one node after the other.

    Attributes:
        parts: The prismatic beams; the last node of each is the first one of the next.
        starts: Places at which they begin, m.
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
                replace(alike[case.profile.at(0.5 * (start + end))], length=end - start)
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
    """One motion of a beam.

    Attributes:
        nodal: DOFs at a node; the first ones of neighboring nodes are two apart.
    """

    nodal: ClassVar[int]

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
        """Return the rigid motions of this part by the motions of the section at x = 0, (size,) each."""


@dataclass(frozen=True)
class BendingPart:
    """Bending in one plane.

    Attributes:
        beam: The plane beam.
        axis: Component of its deflection.
        dimension: Dimension of displacements, 2 or 3.
        names: Names of its deflection and rotation.
    """

    beam: SteppedBeam
    axis: int
    dimension: int
    names: tuple[MotionName, MotionName]
    nodal: ClassVar[int] = 2

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
class _RodPart:
    rod: ElasticRod
    motion: ClassVar[MotionName]
    nodal: ClassVar[int] = 1

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return self.rod.size

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return self.rod.operators()

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of u or a at a place, (size,)."""
        return self.rod.rows(np.array([x])).toarray()[0] if name == self.motion else None

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return u or a = 1, (size,)."""
        return {self.motion: np.ones(self.size)}


@dataclass(frozen=True)
class AxialPart(_RodPart):
    """Tension and compression.

    Attributes:
        rod: The rod.
        dimension: Dimension of displacements, 2 or 3.
    """

    dimension: int
    motion: ClassVar[MotionName] = "axial"

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return u e_x, (k, size)."""
        return csr_matrix(self.rod.rows(places[:, 0]).multiply(directions[:, 0, None]))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (k dimension, size)."""
        return in_components(self.rod.rows(places[:, 0]), {0: np.ones(len(places))}, self.dimension)

    def uniform(self, direction: Array) -> Array:
        """Return u of all nodes, (size,)."""
        return np.full(self.size, float(direction[0]))


class TorsionPart(_RodPart):
    """Twist about the axis, in 3D.

    Attributes:
        rod: The shaft.
    """

    motion: ClassVar[MotionName] = "twist"

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return a (y e_z - z e_y), (k, size)."""
        y, z = places[:, 1], places[:, 2]
        arms = y * directions[:, 2] - z * directions[:, 1]
        arms = np.where(np.abs(arms) > NO_ARM * np.hypot(y, z), arms, 0.0)
        return csr_matrix(self.rod.rows(places[:, 0]).multiply(arms[:, None]))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (3 k, size)."""
        return in_components(self.rod.rows(places[:, 0]), {1: -places[:, 2], 2: places[:, 1]}, 3)

    def uniform(self, direction: Array) -> Array:  # noqa: ARG002
        """Return zeros: a section that moves as a whole does not turn."""
        return np.zeros(self.size)


def in_components(rows: csr_matrix, factors: dict[int, Array], dimension: int) -> csr_matrix:
    """Return the matrix of vectors whose components are factors times a motion, (k dimension, n)."""
    parts = [(axis, csr_matrix(rows.multiply(factor[:, None])).tocoo()) for axis, factor in factors.items()]
    places = np.concatenate([dimension * part.row + axis for axis, part in parts])
    columns = np.concatenate([part.col for _, part in parts])
    shape = (dimension * rows.shape[0], rows.shape[1])
    return csr_matrix((np.concatenate([part.data for _, part in parts]), (places, columns)), shape)
