"""Arnoldi's method and GMRES for I - L in the energy product, on vectors that are shared by ranks.

Source: Saad and Schultz (1986).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from gapbeam.solver.periodic.floquet import Stability, ordered
from gapbeam.solver.system.operators import Array

BREAKDOWN = 1.0e-14  # of the image: what is left of it lies in the span
Apply = Callable[[Array], Array]
Inner = Callable[[list[tuple[Array, Array]]], Array]
"""Scalar products of pairs of vectors."""


@dataclass
class Arnoldi:
    """An orthonormal basis V of a Krylov space of L, with L V_k = V_k+1 H.

    Attributes:
        apply: L.
        inner: Scalar products.
        basis: V, one vector more than columns of H unless the space is invariant.
        columns: Columns of H, the j-th of j + 2 entries.
        size: Length of the vector that the space was started with.
    """

    apply: Apply
    inner: Inner
    basis: list[Array] = field(default_factory=list)
    columns: list[Array] = field(default_factory=list)
    size: float = 0.0

    def start(self, vector: Array) -> None:
        """Start the space. Collective."""
        self.size = float(np.sqrt(max(self.inner([(vector, vector)])[0], 0.0)))
        self.basis = [np.asarray(vector / self.size)] if self.size > 0.0 else []
        self.columns = []

    def extend(self) -> bool:
        """Add a vector; return False where the space is invariant already. Collective."""
        image = self.apply(self.basis[-1])
        column = np.zeros(len(self.basis) + 1)
        before = float(np.sqrt(max(self.inner([(image, image)])[0], 0.0)))
        for _ in range(2):  # once more, against round-off
            parts = self.inner([(image, vector) for vector in self.basis])
            column[:-1] += parts
            image = image - sum(part * vector for part, vector in zip(parts, self.basis, strict=True))
        column[-1] = float(np.sqrt(max(self.inner([(image, image)])[0], 0.0)))
        self.columns.append(column)
        if column[-1] <= BREAKDOWN * before:
            return False
        self.basis.append(image / column[-1])
        return True

    @property
    def hessenberg(self) -> Array:
        """H, (k + 1, k)."""
        count = len(self.columns)
        matrix = np.zeros((count + 1, count))
        for j, column in enumerate(self.columns):
            matrix[: j + 2, j] = column
        return matrix

    def solve(self) -> tuple[Array, float]:
        """Return the vector x of the space with the least |r - (I - L) x|, r the start, and that over |r|."""
        matrix = -self.hessenberg
        matrix[np.diag_indices(matrix.shape[1])] += 1.0
        right = np.zeros(len(matrix))
        right[0] = self.size
        parts = np.linalg.lstsq(matrix, right, rcond=None)[0]
        left = float(np.linalg.norm(right - matrix @ parts)) / self.size
        vectors = self.basis[: len(parts)]
        return np.asarray(sum(part * vector for part, vector in zip(parts, vectors, strict=True))), left

    def ritz_values(self) -> tuple[Stability, float]:
        """Return the eigenvalues of H, and how far the largest may be off."""
        matrix = self.hessenberg
        values, vectors = np.linalg.eig(matrix[:-1])
        leading = int(np.argmax(np.abs(values)))
        return ordered(values), float(abs(matrix[-1, -1] * vectors[-1, leading]))


def solve_identity_minus(apply: Apply, inner: Inner, right: Array, tolerance: float, most: int) -> tuple[Array, float]:
    """Solve (I - L) x = r by GMRES.

    Args:
        apply: L.
        inner: Scalar products.
        right: r.
        tolerance: Largest |r - (I - L) x| over |r|.
        most: Limit of products with L.

    Returns:
        x and what is left over |r|, which may be more than the tolerance.

    Collective.
    """
    space = Arnoldi(apply, inner)
    space.start(right)
    if not space.basis:
        return right, 0.0
    for _ in range(most):
        more = space.extend()
        solution, left = space.solve()
        if left <= tolerance or not more:
            break
    return solution, left


def leading_multipliers(
    apply: Apply, inner: Inner, start: Array, tolerance: float, most: int
) -> tuple[Stability, float]:
    """Return the leading eigenvalues of L, and how far the largest may be off.

    Args:
        apply: L.
        inner: Scalar products.
        start: A vector.
        tolerance: Of the largest.
        most: Limit of products with L.

    Collective.
    """
    space = Arnoldi(apply, inner)
    space.start(start)
    if not space.basis:
        return ordered(np.zeros(0)), 0.0
    for _ in range(most):
        more = space.extend()
        values, off = space.ritz_values()
        if off <= tolerance or not more:
            break
    return values, off if more else 0.0
