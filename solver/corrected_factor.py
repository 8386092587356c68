"""A factor whose solves are exact for smooth motions, which round-off of the factor would disturb the most.

Entries of A = c_m M + c_k K are those of c_k K but for some digits, and so are those of its factor. What K hardly feels
has only c_m M to hold it, in the last digits. With Z and K Z known to more of them (`solver.smooth_motions`), what
smooth motions still lack is found among them,

    x' = x + Z (Z^T A Z)^-1 (Z^T b - (A Z)^T x),

so that momentum and the balance of all low frequencies hold however A was factored.

Source: Nicolaides (1987), SIAM J. Numer. Anal. 24: deflation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.linalg import cho_solve
from scipy.sparse import csr_matrix

from solver.operators import Array, Factor, Interface
from solver.petsc_factor import SOLVE_BLOCK
from solver.smooth_motions import SmoothMotions


@dataclass(frozen=True)
class CorrectedFactor:
    """Solves with A, the more exactly the smoother the solution.

    Attributes:
        factor: That of A.
        motions: Z.
        images: A Z, (n, k).
        inner: Cholesky factor of Z^T A Z, (k, k), lower.
    """

    factor: Factor
    motions: SmoothMotions
    images: Array
    inner: Array
    tolerance: ClassVar[float] = 0.0

    @classmethod
    def of(cls, factor: Factor, motions: SmoothMotions, images: Array) -> CorrectedFactor:
        """Return the corrected factor from A Z, (n, k). Collective."""
        energies = motions.total(motions.shapes.T @ images)
        return cls(factor, motions, images, np.asarray(np.linalg.cholesky(0.5 * (energies + energies.T)), dtype=float))

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self.factor.keeps(columns)

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b, (n,). Collective."""
        solved = self.factor.solve(right_side)
        lacking = self.motions.shapes.T @ right_side - self.images.T @ solved
        solved += self.motions.shapes @ self._shares(lacking)
        return solved

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X, (n, r), column-major. Collective."""
        solved = self.factor.solve_columns(interface, columns)
        here = np.asarray((columns[interface.slots].T @ self.motions.shapes[interface.owned]).T)
        shares = self._shares(here - self.images.T @ solved)
        for begin in range(0, solved.shape[1], SOLVE_BLOCK):  # as all at once would take their memory again
            part = slice(begin, begin + SOLVE_BLOCK)
            solved[:, part] += self.motions.shapes @ shares[:, part]
        return solved

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E as the factor has it, or None. Collective."""
        return self.factor.interface_block(interface)

    def _shares(self, lacking: Array) -> Array:
        """Return how much of each smooth motion is lacking, from what this rank lacks of their forces. Collective."""
        return np.asarray(cho_solve((self.inner, True), self.motions.total(lacking), check_finite=False))
