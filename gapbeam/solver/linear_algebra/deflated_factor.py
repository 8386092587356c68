"""Factors whose solutions are corrected on the deflation basis Z.

A = c_m M + c_k K is assembled and factored with round-off of the entries of c_k K. On the slow motions Z of a slender
body K is nearly zero, and c_m M lies in the last digits of A. With A Z known to more digits (`smooth_modes`)

    x = F b,    x' = x + Z (Z^T A Z)^-1 (Z^T b - (A Z)^T x),    F ~ A^-1 the factor

keeps momentum and the balance of low frequencies to more digits than the factor alone.

Source: Nicolaides (1987), SIAM J. Numer. Anal. 24, 355.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.linear_algebra.deflation import Deflation
from gapbeam.solver.linear_algebra.mumps_factor import SOLVE_BLOCK
from gapbeam.solver.system.operators import Array, Factor, Interface


@dataclass(frozen=True)
class DeflatedFactor:
    """Solves with A by its factor and a correction on Z.

    Attributes:
        factor: The factor of A.
        deflation: Z and A Z.
    """

    factor: Factor
    deflation: Deflation
    tolerance: ClassVar[float] = 0.0

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self.factor.keeps(columns)

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b, (n,). Collective."""
        deflation, solved = self.deflation, self.factor.solve(right_side)
        solved += deflation.basis @ deflation.coarse_solve(deflation.coarse_residual(right_side, solved))
        return solved

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X, (n, r), column-major. Collective."""
        deflation, solved = self.deflation, self.factor.solve_columns(interface, columns)
        loaded = np.asarray((columns[interface.slots].T @ deflation.basis[interface.owned]).T)
        coefficients = deflation.coarse_solve(loaded - deflation.images.T @ solved)
        for begin in range(0, solved.shape[1], SOLVE_BLOCK):  # all columns at once would take their memory again
            part = slice(begin, begin + SOLVE_BLOCK)
            solved[:, part] += deflation.basis @ coefficients[:, part]
        return solved

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E as the factor has it, or None. Collective."""
        return self.factor.interface_block(interface)
