"""Rods under tension, and shafts under torsion, in quadratic elements.

    V = 1/2 int E A u'^2 dx,  T = 1/2 int rho A u_t^2 dx;    V = 1/2 int G J a'^2 dx,  T = 1/2 int rho I_p a_t^2 dx

with u along the axis, and a the angle about it. Sections turn without changing their shape and are free to warp
(Saint-Venant); the inertia of warping and the bracing of it at joints are left out. The frequency of a mode with k
waves in 2 pi of length is too high by (k h)^4 / 1440, h the length of an element. In plane strain E / (1 - nu^2) stands
instead of E.

Source: Timoshenko and Goodier (1970), Theory of Elasticity, 3rd ed., ch. 10, for J; Hughes (1987), The Finite Element
Method, sec. 9.1, for the frequencies of quadratic rods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.case.beam_profile import BeamPiece
from gapbeam.solver.case.case import Case
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

STIFFNESS = np.array([[7.0, -8.0, 1.0], [-8.0, 16.0, -8.0], [1.0, -8.0, 7.0]]) / 3.0
MASS = np.array([[4.0, 2.0, -1.0], [2.0, 16.0, 2.0], [-1.0, 2.0, 4.0]]) / 30.0


@dataclass(frozen=True)
class ElasticRod:
    """A rod of quadratic elements; DOFs at their ends and middles, one after the other.

    Attributes:
        ends: Ends of the elements, (elements + 1,), m.
        stiffness: E A, N, or G J, N m^2, of each element, (elements,).
        inertia: rho A, kg/m, or rho I_p, kg m, of each element, (elements,).
    """

    ends: Array
    stiffness: Array
    inertia: Array

    @classmethod
    def of_case(cls, case: Case, ends: Array, twists: bool) -> ElasticRod:
        """Return the rod of a case with given elements.

        Args:
            case: The case.
            ends: Ends of the elements, (elements + 1,), m; segments end there, too.
            twists: Whether it twists; else it is pulled.
        """
        pieces = [case.profile.at(float(x)) for x in 0.5 * (ends[1:] + ends[:-1])]
        figures = np.array([_torsion(piece) if twists else _tension(case, piece) for piece in pieces])
        return cls(ends, figures[:, 0], figures[:, 1])

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return 2 * len(self.stiffness) + 1

    def rows(self, x: Array) -> csr_matrix:
        """Return the matrix of the motion at places, (k, n)."""
        which = np.clip(np.searchsorted(self.ends, x, side="right") - 1, 0, len(self.stiffness) - 1)
        xi = (x - self.ends[which]) / (self.ends[which + 1] - self.ends[which])
        shapes = np.stack([(1.0 - xi) * (1.0 - 2.0 * xi), 4.0 * xi * (1.0 - xi), xi * (2.0 * xi - 1.0)], axis=1)
        columns = 2 * which[:, None] + np.arange(3)
        places = (np.repeat(np.arange(len(x)), 3), columns.reshape(-1))
        return csr_matrix((shapes.reshape(-1), places), (len(x), self.size))

    def operators(self) -> SparseOperators:
        """Return M and K."""
        lengths = np.diff(self.ends)
        firsts = 2 * np.arange(len(lengths))
        rows, columns = (firsts[:, None, None] + one for one in np.meshgrid(np.arange(3), np.arange(3), indexing="ij"))
        places = (rows.reshape(-1), columns.reshape(-1))
        mass = (self.inertia * lengths)[:, None, None] * MASS
        stiffness = (self.stiffness / lengths)[:, None, None] * STIFFNESS
        shape = (self.size, self.size)
        return SparseOperators(*(csr_matrix((one.reshape(-1), places), shape) for one in (mass, stiffness)))


def _tension(case: Case, piece: BeamPiece) -> tuple[float, float]:
    """Return E A, N, and rho A, kg/m."""
    material, area = piece.material, piece.beam.area
    strain = case.mesh.dimension == 2 and case.mesh.plane == "strain"
    young = material.young_modulus / (1.0 - material.poisson_ratio**2) if strain else material.young_modulus
    return young * area, material.density * area


def _torsion(piece: BeamPiece) -> tuple[float, float]:
    """Return G J, N m^2, and rho I_p, kg m."""
    material, constant = piece.material, piece.beam.torsion_constant
    assert constant is not None  # the case was refused
    return material.shear_modulus * constant, material.density * piece.beam.polar_moment
