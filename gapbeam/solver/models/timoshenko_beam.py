"""Timoshenko beam elements that bend in one plane.

    V = 1/2 int E I theta'^2 + kappa G A (w' - theta)^2 dx,    T = 1/2 int rho A w_t^2 + rho I theta_t^2 dx

with w across the axis and u_x = -z theta. The elements interpolate what a beam without load between its nodes takes
exactly, so that they do not lock. In plane strain E / (1 - nu^2) replaces E.

Source: Friedman and Kosmatka (1993) for the element; area, I and kappa are those of the cross-section.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.case.beam_profile import BeamPiece
from gapbeam.solver.case.case import Case
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
    """

    length: float
    elements: int
    bending: float
    shear: float
    mass: float
    inertia: float

    @classmethod
    def of_case(cls, case: Case, elements: int, lateral: bool = False) -> TimoshenkoBeam:
        """Return a beam that is all along as the one of a case is at x = 0: in its bending plane or, in 3D, across."""
        return cls.of_piece(case, case.profile.pieces[0], case.beam.length, elements, lateral)

    @classmethod
    def of_piece(
        cls, case: Case, piece: BeamPiece, length: float, elements: int, lateral: bool = False
    ) -> TimoshenkoBeam:
        """Return a beam of some length with cross-section and material of a piece of the beam of a case."""
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

    def of_length(self, length: float) -> TimoshenkoBeam:
        """Return the beam with another length, m."""
        return replace(self, length=length)

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return 2 * (self.elements + 1)

    @property
    def places(self) -> Array:
        """Places of the nodes, (elements + 1,), m."""
        return np.asarray(np.linspace(0.0, self.length, self.elements + 1))

    def rows(self, x: Array) -> tuple[csr_matrix, csr_matrix]:
        """Return the matrices of w and theta at places, (k, n) each."""
        return as_rows(*self.shapes_at(x), self.size)

    def shapes_at(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the shapes of w and theta at places, and the DOFs that they belong to, (k, 4) each."""
        element = self.length / self.elements
        which = np.clip(np.floor(x / element).astype(int), 0, self.elements - 1)
        w, theta, _, _ = self._shapes(x / element - which)
        return w, theta, 2 * which[:, None] + np.arange(4)

    def heave_and_pitch(self) -> Array:
        """Return both rigid motions, (2, n): w = 1, and w = x with theta = 1."""
        return heave_and_pitch_at(self.places)

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return of_elements([self])

    def element_matrices(self) -> tuple[Array, Array]:
        """Return M and K of one element, (4, 4) each."""
        length = self.length / self.elements
        w, theta, slope, curvature = self._shapes(0.5 * (1.0 + POINTS))
        factors = 0.5 * length * WEIGHTS[:, None]
        strain = slope - theta
        stiffness = curvature.T @ (self.bending * factors * curvature)
        if isfinite(self.shear):
            stiffness = stiffness + strain.T @ (self.shear * factors * strain)
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
