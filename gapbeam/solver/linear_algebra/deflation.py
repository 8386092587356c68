"""Deflation: products and solves with A that are exact on a few known vectors Z.

Z, (n, k), is orthonormal and nearly in the null space of A: the rigid-body modes R of a floating body, or motions that
vary slowly along a slender one. In a product A z large entries of A cancel, so that round-off outweighs A z itself. The
images A Z are therefore given, with more digits, and used in three places. With P = 1 - Z Z^T and E = Z^T A Z:

    product                     A x = P A P x + Z (A Z)^T P x + (A Z) Z^T x
    correction of x ~ A^-1 b    x' = x + Z E^-1 (Z^T b - (A Z)^T x)
    two-level preconditioner    c = E^-1 Z^T b,   x = B (b - A Z c),   then the correction of x

The product is symmetric. The two-level preconditioner Q + (1 - Q A) B (1 - A Q), Q = Z E^-1 Z^T, is symmetric where B
is, and solves exactly for right sides in the span of A Z.

Source: Nicolaides (1987), SIAM J. Numer. Anal. 24, 355: deflation; Mandel (1993), Comm. Numer. Methods Eng. 9, 233: the
two-level ("balancing") preconditioner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_solve, lu_factor, lu_solve

from gapbeam.solver.system.operators import Array

Map = Callable[[Array], Array]


@dataclass(frozen=True)
class Deflation:
    """A basis Z and its images under a symmetric operator A.

    Attributes:
        basis: Z, (n, k), orthonormal over all ranks.
        images: A Z, (n, k).
        total: Sums an array over the ranks.

    Collective to use.
    """

    basis: Array
    images: Array
    total: Map

    def product(self, multiply: Map) -> Map:
        """Return products with A on vectors, (n,), or blocks, (n, k), exact on Z; `multiply` has round-off there."""

        def exact(x: Array) -> Array:
            coefficients = self.total(self.basis.T @ x)
            rest = x - self.basis @ coefficients
            image = multiply(rest)
            image += self.basis @ self.total(self.images.T @ rest - self.basis.T @ image)
            image += self.images @ coefficients
            return image

        return exact

    def coarse_solve(self, right_side: Array) -> Array:
        """Return E^-1 b, (k,) or (k, r), for the share of this rank in b; takes one sum over ranks."""
        return self._inverse(self.total(right_side))

    def coarse_residual(self, right_side: Array, solution: Array) -> Array:
        """Return the share of this rank in Z^T b - (A Z)^T x, (k,) or (k, r)."""
        return np.asarray(self.basis.T @ right_side - self.images.T @ solution)

    def preconditioner(self, inner: Map) -> Map:
        """Return the two-level preconditioner with B = `inner`, on blocks (n, r)."""

        def two_level(right_side: Array) -> Array:
            solution = inner(right_side - self.images @ self.coarse_solve(self.basis.T @ right_side))
            solution += self.basis @ self.coarse_solve(self.coarse_residual(right_side, solution))
            return solution

        return two_level

    @cached_property
    def _inverse(self) -> Map:
        """E^-1 on (k,) or (k, r). Where A Z has no digits beyond round-off, E may be indefinite: LU then."""
        energies = self.total(self.basis.T @ self.images)
        symmetric = 0.5 * (energies + energies.T)
        try:
            lower = np.asarray(np.linalg.cholesky(symmetric), dtype=float)
        except LinAlgError:
            return partial(lu_solve, lu_factor(symmetric), check_finite=False)
        return partial(cho_solve, (lower, True), check_finite=False)


def rigid_body_modes(space: Any) -> Array:
    """Return the rigid-body modes R, orthonormal, on a blocked vector Lagrange space: (n, 3) in 2D, (n, 6) in 3D.

    Translations, and rotations about the center as displacements linear in the coordinates; orthonormal over all
    ranks.

    Collective.
    """
    comm, block = space.mesh.comm, space.dofmap.index_map_bs
    places = space.tabulate_dof_coordinates()[: space.dofmap.index_map.size_local, :block]
    count = space.dofmap.index_map.size_global
    places = places - sum(comm.allgather(places.sum(axis=0))) / count
    axes = [np.broadcast_to(axis, places.shape) for axis in np.eye(block)]
    for first in range(block):
        for second in range(first + 1, block):
            turn = np.zeros_like(places)
            turn[:, first], turn[:, second] = -places[:, second], places[:, first]
            axes.append(turn)
    motions = np.stack([motion.reshape(-1) for motion in axes], axis=1)
    motions /= np.sqrt(sum(comm.allgather((motions**2).sum(axis=0))))
    for _ in range(2):  # twice is enough (Cholesky-QR)
        gram = sum(comm.allgather(motions.T @ motions))
        motions = np.linalg.solve(np.linalg.cholesky(gram), motions.T).T
    return np.ascontiguousarray(motions)
