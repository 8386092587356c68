"""Chebyshev smoother of the fourth kind for A x = b, with the nodal diagonal blocks D of A (block Jacobi).

    z_j = (2j-3)/(2j+1) z_j-1 + (8j-4)/((2j+1) s) D^-1 r_j-1,    r_j = r_j-1 - A z_j,    x_j = x_j-1 + beta_j z_j

with s the largest eigenvalue of D^-1 A. The factors beta_j minimize the bound on the V-cycle. A sweep takes one product
with A, for many columns at once, and unlike Gauss-Seidel does not depend on the number of ranks.

Source: Lottes (2023), Numer. Linear Algebra Appl. 30, e2518; beta for four sweeps are those of its table.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np
from scipy.linalg import eigvalsh_tridiagonal

from gapbeam.solver.linear_algebra.iterative.block_matrix import BlockMatrix
from gapbeam.solver.linear_algebra.iterative.block_product import block_residual
from gapbeam.solver.linear_algebra.iterative.smoothing_kernel import relax
from gapbeam.solver.system.operators import Array

BETA = (1.00391310427285, 1.04035811188593, 1.14863498546254, 1.38268869241000)
SAFETY = 1.1  # of the estimate of s, which is from below
ESTIMATED = 10  # iterations for it
ROUND_OFF = 1.0e-12  # of a square: nothing is left to see in single precision
Part = Callable[[Array], Array]
Dots = Callable[[Array, Array], Array]


class Smoother:
    """Four sweeps on A = matrix + added.

    Args:
        matrix: In the precision that is computed in.
        added: What is added to it, on blocks of columns; None: nothing.
        diagonal: D, (nodes, b, b).
        dots: x_j^T y_j over all ranks, (n, k), (n, k) -> (k,).

    Collective to make and to use.
    """

    def __init__(self, matrix: BlockMatrix, added: Part | None, diagonal: Array, dots: Dots) -> None:
        self._matrix, self._added = matrix, added
        self._inverse = np.linalg.inv(diagonal).astype(matrix.values.dtype)
        noise = np.random.default_rng(0).standard_normal((matrix.rows, 1))
        self._largest = SAFETY * largest_eigenvalue(self._weighed, self.multiply, dots, noise)

    def smooth(self, right_side: Array, last: bool = False) -> tuple[Array, Array]:
        """Return x, from 0, and b - A x, which at the `last` of a cycle nobody needs: it is not that then.

        Args:
            right_side: b, (n, k), in the precision of the matrix; k = 1 or `AT_ONCE`.
            last: See above.

        Collective.
        """
        real = self._matrix.values.dtype.type
        size, count = self._matrix.size, right_side.shape[1]
        x, z = np.zeros_like(right_side), np.zeros_like(right_side)
        residual = right_side.copy()
        missing = residual if last else right_side.copy()
        relaxed, taken_away = relax(size, count), block_residual(size, count)
        for number, beta in enumerate(map(real, BETA), 1):
            kept, taken = (2 * number - 3) / (2 * number + 1), (8 * number - 4) / ((2 * number + 1) * self._largest)
            relaxed(self._inverse, residual, z, x, real(kept), real(taken), beta)
            if last and number == len(BETA):
                break
            matrix, there = self._matrix, self._matrix.with_others(z)
            taken_away(matrix.starts, matrix.columns, matrix.values, there, residual, missing, beta, not last)
            if self._added is not None:
                more = self._added(z).astype(real)
                residual -= more
                if not last:
                    missing -= beta * more
        return x, missing

    def multiply(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        return self._matrix(x) if self._added is None else self._matrix(x) + self._added(x)

    def _weighed(self, x: Array) -> Array:
        blocks = x.reshape(len(self._inverse), self._matrix.size, -1)
        return np.asarray(np.einsum("nij,njk->nik", self._inverse, blocks)).reshape(x.shape)


def largest_eigenvalue(inverse: Part, multiply: Part, dots: Dots, noise: Array) -> float:
    """Return about the largest eigenvalue of D^-1 A, from below: that of the tridiagonal matrix of Lanczos.

    Args:
        inverse: D^-1.
        multiply: A.
        dots: As in `Smoother`.
        noise: What to start from, (n, 1).

    Collective. Source: Golub and Van Loan, Matrix Computations, section on Lanczos and conjugate gradients.
    """
    residual = noise.copy()
    direction = inverse(residual)
    square = float(dots(residual, direction)[0])
    diagonal, beside, carried = list[float](), list[float](), 0.0
    for _ in range(ESTIMATED):
        image = multiply(direction)
        length = square / float(dots(direction, image)[0])
        residual -= length * image
        weighed = inverse(residual)
        former, square = square, float(dots(residual, weighed)[0])
        diagonal.append(1.0 / length + carried)
        ratio = square / former
        beside.append(sqrt(max(ratio, 0.0)) / length)
        carried = ratio / length
        if ratio < ROUND_OFF:
            break
        direction = weighed + ratio * direction
    return float(eigvalsh_tridiagonal(diagonal, beside[:-1])[-1])
