"""Operators of a model: products with M and K, factors, and the interface DOFs that gaps depend on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

Array = NDArray[np.float64]
Indices = NDArray[np.integer[Any]]


class Factor(Protocol):
    """What solves with an effective operator."""

    @property
    def tolerance(self) -> float:
        """Error over solution that iterations leave, in the energy norm; 0 where there is only round-off."""

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b; both arrays hold the owned part (n,). Collective."""

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X (interface.size, r) on the interface DOFs: (n, r), column-major. Collective."""

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E, (interface.size, interface.size), symmetric, the same on all ranks. Collective.

        None: no quicker way to it is known than by columns.
        """


@runtime_checkable
class IterativeFactor(Factor, Protocol):
    """Iterative solves with an effective operator, also with springs added to the operator.

    Attributes:
        tolerance: Relative error of a solve in the energy norm.
        solves: Number of solves so far.
        iterations: Number of iterations in these solves.
    """

    tolerance: float
    solves: int
    iterations: int

    def size_of(self, solution: Array, right_side: Array) -> float:
        """Return sqrt(x^T A x) of a solution x of A x = b. Collective."""

    def solve_stiffened(
        self, right_side: Array, springs: Springs | None, size: float | None, start: Array | None = None
    ) -> Array:
        """Return (A + springs)^-1 b. Collective.

        Args:
            right_side: b, (n,).
            springs: What is added to A, positive semi-definite; None: nothing.
            size: sqrt(x^T A x) of what the error is small against; None: that of the solution itself.
            start: A guess at the solution, (n,).

        Raises:
            RunError: The iterations did not converge.
        """


class Operators(Protocol):
    """M and K of a model, in whatever form they are kept.

    Attributes:
        size: Number of DOFs that this rank owns, n.
        massless: Which of them have no mass, (n,): rows and columns of M that are zero.
    """

    size: int
    massless: NDArray[np.bool_]

    def apply_mass(self, x: Array) -> Array:
        """Return M x, (n,) or, of several columns, (n, k). Collective."""

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x, (n,) or, of several columns, (n, k). Collective."""

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off, (n,): eps diag(K) |x|."""

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the weak restraint adds, (n,) or, of several columns, (n, k). Collective."""

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Factor mass M + stiffness K + springs + added; if stiffness = 0, massless rows are those of K. Collective."""

    def sum(self, local: Array) -> Array:
        """Sum a small array over all ranks. Collective."""


@dataclass(frozen=True)
class Interface:
    """The DOFs that gaps depend on, replicated on all ranks.

    Attributes:
        size: Number of interface DOFs, over all ranks.
        owned: Position in the owned vector of those that this rank owns.
        slots: Their numbers 0 ... size-1.
    """

    size: int
    owned: Indices
    slots: Indices

    def trace(self, x: Array, operators: Operators) -> Array:
        """Return the interface values (size,) of a vector on every rank. Collective."""
        values = np.zeros(self.size)
        values[self.slots] = x[self.owned]
        return operators.sum(values)

    def numbers(self, first: int, total: Callable[[Array], Array]) -> Indices:
        """Return the numbers of all interface DOFs over all ranks, (size,). Collective.

        Args:
            first: That of this rank's first DOF.
            total: Sums an array over ranks.
        """
        mine = np.zeros(self.size)
        mine[self.slots] = self.owned + first
        return np.asarray(total(mine).astype(np.int64))

    def add(self, x: Array, values: Array) -> None:
        """Add interface values (size,) to a vector in place; local."""
        x[self.owned] += values[self.slots]


@dataclass(frozen=True)
class Springs:
    """A sparse matrix (size, size) on the interface DOFs, N/m, with entries between DOFs of one cell only."""

    interface: Interface
    matrix: csr_matrix


@dataclass(frozen=True)
class RankOnes:
    """A sum of terms a_j b_j b_j^T: what springs, dampers or masses at places of a body add to its operators.

    Attributes:
        patterns: b_j on the DOFs of this rank, (k, n).
        coefficients: a_j, (k,).
    """

    patterns: Array
    coefficients: Array

    def apply(self, x: Array, operators: Operators) -> Array:
        """Return sum_j a_j b_j (b_j . x), (n,). Collective."""
        return np.asarray((self.coefficients * operators.sum(self.patterns @ x)) @ self.patterns)

    def times(self, factor: float) -> RankOnes:
        """Return the sum times a factor."""
        return RankOnes(self.patterns, factor * self.coefficients)

    def and_also(self, other: RankOnes | None) -> RankOnes:
        """Return both sums together."""
        if other is None:
            return self
        return RankOnes(
            np.concatenate([self.patterns, other.patterns]), np.concatenate([self.coefficients, other.coefficients])
        )

    @property
    def matrix(self) -> Array:
        """The sum as an array, (n, n), on one rank."""
        return np.asarray(self.patterns.T @ (self.coefficients[:, None] * self.patterns))
