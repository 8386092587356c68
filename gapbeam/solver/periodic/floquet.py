"""Floquet multipliers: growth factors of small disturbances of a periodic response over one period.

They are the eigenvalues of the monodromy matrix, the derivative of the state after a period by the state at its start.
The response is stable if all lie inside the unit circle. As a parameter moves, a real one leaves through +1 (fold: two
responses meet and vanish), a real one through -1 (period doubling) or a pair elsewhere (Neimark-Sacker: a second
frequency appears). The multipliers of a motion that nothing damps lie on the circle, where round-off decides at which
side a computed one is: whether such a response is stable is not known.

Arnoldi's method and GMRES for I - L work in the energy product, on vectors that are shared by ranks. Multipliers that
come from an approximate motion can be off by any factor while the motion itself converges: a contact of a few instants
decides about them, and a truncated series places it by chance. They are known where every way of finding the largest
one says the same, to a share of it, and none of them is as near to the unit circle as they are apart.

Source: Saad and Schultz (1986).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.system.operators import Array

Multipliers = NDArray[np.complex128]
REAL = 1.0e-6  # a multiplier with a smaller imaginary part, relative to it, is real

NEAR_ONE = 1.0e-8  # a multiplier as near to the unit circle may lie at either side of it

STABLE = "stable"
UNKNOWN = "not known"
FOLD = "fold"
PERIOD_DOUBLING = "period doubling"
NEIMARK_SACKER = "Neimark-Sacker"
PITCHFORK = "pitchfork"
BRANCH_POINT = "branch point"
GRAZING = "grazing"


@dataclass(frozen=True)
class Stability:
    """Stability of a response from its multipliers.

    Attributes:
        multipliers: All, or the leading ones, by falling absolute value.
    """

    multipliers: Multipliers

    @property
    def largest(self) -> float:
        """Largest absolute value."""
        return float(np.abs(self.multipliers[0])) if len(self.multipliers) else 0.0

    @property
    def stable(self) -> bool | None:
        """True where all multipliers lie inside the unit circle; None where the largest is too close to 1 to decide."""
        return None if abs(self.largest - 1.0) <= NEAR_ONE else self.largest < 1.0

    @property
    def kind(self) -> str:
        """`STABLE`, `UNKNOWN`, or where the largest multiplier has left: fold, period doubling, Neimark-Sacker."""
        if self.stable is None:
            return UNKNOWN
        if self.stable:
            return STABLE
        leading = self.multipliers[0]
        if not _is_real(leading):
            return NEIMARK_SACKER
        return FOLD if leading.real > 0.0 else PERIOD_DOUBLING

    @property
    def doubling_test(self) -> float:
        """The product of 1 + mu_i, which changes its sign where one multiplier passes -1."""
        return float(np.prod(1.0 + self.multipliers).real)

    @property
    def unit_test(self) -> float:
        """The product of 1 - mu_i, which changes its sign where one multiplier passes +1."""
        return float(np.prod(1.0 - self.multipliers).real)

    @property
    def unstable(self) -> int:
        """Number of multipliers outside of the unit circle."""
        return int(np.sum(np.abs(self.multipliers) > 1.0 + NEAR_ONE))

    def distance(self, place: complex) -> float:
        """Return the distance of the nearest multiplier from a place on the unit circle."""
        return float(np.min(np.abs(self.multipliers - place), initial=np.inf))

    @property
    def unstable_pairs(self) -> int:
        """Number of complex pairs outside of the unit circle."""
        return sum(abs(one) > 1.0 + NEAR_ONE and one.imag > 0.0 and not _is_real(one) for one in self.multipliers)


def stability_of(monodromy: Array) -> Stability:
    """Return the multipliers of a monodromy matrix, (2n, 2n)."""
    return ordered(np.asarray(np.linalg.eigvals(monodromy), dtype=complex))


def ordered(multipliers: NDArray[np.complex128] | Array) -> Stability:
    """Return multipliers by falling absolute value."""
    found = np.asarray(multipliers, dtype=complex)
    return Stability(found[np.argsort(-np.abs(found), kind="stable")])


def _is_real(multiplier: complex) -> bool:
    return abs(multiplier.imag) <= REAL * abs(multiplier)


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
        tolerance: Relative to the largest.
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


MOST_APART = 0.1  # between two ways, relative to the larger of 1 and the largest multiplier


@dataclass(frozen=True)
class Judgment:
    """Multipliers of one response as several methods find them, compared.

    Attributes:
        stability: The multipliers that are reported, where they are known.
        error: Error of the largest one: the largest difference between two ways.
        doubts: Why the multipliers are not known, one clause each; none where they are.
    """

    stability: Stability
    error: float
    doubts: tuple[str, ...] = ()

    @property
    def known(self) -> bool:
        """True where there is no doubt about the multipliers."""
        return not self.doubts


def judged(stability: Stability, others: Mapping[str, Stability], way: str = "these harmonics") -> Judgment:
    """Return multipliers that were found in one way, judged by those of other ways.

    Args:
        stability: Multipliers found in the best way.
        others: Multipliers found in other ways, by name.
        way: Name of the best way.
    """
    found = {way: stability, **others}
    largest = {name: one.largest for name, one in found.items()}
    apart = max(largest.values()) - min(largest.values())
    words = ", ".join(f"{value:.4g} by {name}" for name, value in largest.items())
    if not apart <= MOST_APART * max(1.0, stability.largest):
        return Judgment(stability, apart, (f"the largest multiplier is {words}",))
    doubts = doubts_near_one(stability.largest, apart)
    if len({one.kind for one in found.values()}) > 1 and not doubts:
        kinds = ", ".join(f"{one.kind} by {name}" for name, one in found.items())
        doubts = (f"the response is {kinds}",)
    return Judgment(stability, apart, doubts)


def with_error(stability: Stability, error: float) -> Judgment:
    """Return multipliers whose largest one may be off by an error, judged by that."""
    if not error <= MOST_APART * max(1.0, stability.largest):
        return Judgment(
            stability, error, (f"the largest multiplier, {stability.largest:.4g}, may be off by {error:.2g}",)
        )
    return Judgment(stability, error, doubts_near_one(stability.largest, error))


def doubts_near_one(largest: float, error: float) -> tuple[str, ...]:
    """Return the doubt about a multiplier that may lie at either side of the unit circle; none where it cannot."""
    if abs(largest - 1.0) <= NEAR_ONE:
        return ("the largest multiplier is 1 to round-off, as for an undamped motion",)
    if abs(largest - 1.0) > error:
        return ()
    return (f"the largest multiplier, {largest:.4g}, may be off by {error:.2g}: at either side of 1",)
