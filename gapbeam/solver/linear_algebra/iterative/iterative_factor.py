"""Conjugate gradients instead of a factor, for operators whose factor does not fit in memory.

The preconditioner B is the two-level preconditioner of `Deflation` around a V-cycle: exact on the rigid-body modes R.
Contact that is stiff beside what holds a floating body would leave R to hundreds of iterations.

Errors are measured in the energy norm of the operator A, with the residual r = b - A x and B for A^-1:

    sqrt(r^T B r) ~ sqrt(e^T A e),    against sqrt(x^T A x) of the solution

Source: Hestenes and Stiefel (1952), J. Res. Natl. Bur. Stand. 49, 409: the iteration, for several right sides at once.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from gapbeam.solver.errors import RunError
from gapbeam.solver.linear_algebra.deflation import Deflation, Map
from gapbeam.solver.linear_algebra.interface_springs import add_springs
from gapbeam.solver.linear_algebra.iterative.multigrid import AT_ONCE, Multigrid, columns_product
from gapbeam.solver.system.operators import Array, Interface, Operators, RankOnes, Springs

MOST_ITERATIONS = 2000
PATIENCE = 12  # iterations; to put springs into the preconditioner takes as long as some six
LEAST = 1.0e-13  # of the right side: what round-off leaves of a tolerance


class ConjugateGradients:
    """Solves with A = matrix + added by conjugate gradients.

    Args:
        matrix: The assembled part of A; the factor takes it over.
        space: The function space of its DOFs.
        rigid: The rigid-body modes R, orthonormal, (n, r).
        operators: Sums over ranks.
        prefix: Prefix of PETSc's options.
        tolerance: Error relative to the solution, in the energy norm.
        added: Rank-one terms added to the matrix.
        images: A R, (n, r), with more digits than the product of the matrix has; None: that product.

    Attributes:
        tolerance: As given.
        rigid: As given.
        solves: Solves so far.
        iterations: Their iterations.

    Collective to make and to use.
    """

    def __init__(
        self,
        matrix: PETSc.Mat,
        space: fem.FunctionSpace,
        rigid: Array,
        operators: Operators,
        prefix: str,
        tolerance: float,
        added: RankOnes | None = None,
        images: Array | None = None,
    ) -> None:
        self._operators, self.tolerance, self.rigid = operators, tolerance, rigid
        self.solves = self.iterations = 0
        more = None if added is None else lambda x: _columns(lambda column: added.apply(column, operators), x)
        self._layout = matrix.getSizes(), matrix.getBlockSize(), matrix.comm
        self._levels = Multigrid(matrix, space, prefix, more)
        self._product: Map = self._levels.multiply
        self._deflation = Deflation(rigid, self._product(rigid) if images is None else images, operators.sum)
        if images is not None:
            self._product = self._deflation.product(self._product)
        self._preconditioner = self._deflation.preconditioner(self._levels.precondition)
        self._stiff = self._levels  # with the springs of a solve that iterated too long without them
        self._most = PETSc.Options(prefix).getInt("ksp_max_it", MOST_ITERATIONS)

    def keeps(self, _columns: int) -> bool:
        """Return False: columns A^-1 E X take a solve each."""
        return False

    def multiply(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        return self._product(x)

    def precondition(self, residual: Array) -> Array:
        """Return about A^-1 r, (n, k), some columns at a time: a V-cycle needs ten times their memory. Collective."""
        result = np.empty(residual.shape)
        for first in range(0, residual.shape[1], AT_ONCE):
            part = slice(first, first + AT_ONCE)
            result[:, part] = self._preconditioner(residual[:, part])
        return result

    def sum(self, local: Array) -> Array:
        """Sum a small array over all ranks. Collective."""
        return self._operators.sum(local)

    def dots(self, x: Array, y: Array) -> Array:
        """Return the products x_j^T y_j of columns, (k,). Collective."""
        return self._operators.sum(np.einsum("ij,ij->j", x, y, optimize=False, dtype=float))

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b. Collective."""
        return self.solve_stiffened(right_side, None, None)

    def solve_stiffened(
        self, right_side: Array, springs: Springs | None, size: float | None, start: Array | None = None
    ) -> Array:
        """Return (A + springs)^-1 b. Collective.

        Where that iterates long the preconditioner is given these springs, and keeps them for the solves that follow.

        Args:
            right_side: b, (n,).
            springs: Matrix added to A, positive semi-definite; None: none.
            size: sqrt(x^T A x) that the error is compared with; None: the solution's own.
            start: A guess at the solution, (n,).

        Raises:
            RunError: The iterations did not converge.
        """
        relative, least = (self.tolerance, 0.0) if size is None else (LEAST, self.tolerance * size)
        first = None if start is None else start[:, None]
        right_sides = right_side[:, None]
        if springs is None:
            return self._solved(right_sides, first, relative, least)[:, 0]
        rows = self._rows_of(springs)
        deflation = Deflation(self.rigid, self._deflation.images + columns_product(rows, self.rigid), self.sum)

        def multiply(x: Array) -> Array:
            return self.multiply(x) + columns_product(rows, x)

        precondition = deflation.preconditioner(self._stiff.precondition)
        self.solves += 1
        for most in (PATIENCE, self._most):
            first, iterations, solved = conjugate_gradients(
                multiply, precondition, self.dots, right_sides, first, relative, least, min(most, self._most)
            )
            self.iterations += iterations
            if solved:
                return first[:, 0]
            self._stiff = self._levels.stiffened(rows)
            precondition = deflation.preconditioner(self._stiff.precondition)
        raise self._not_solved()

    def size_of(self, solution: Array, right_side: Array) -> float:
        """Return sqrt(x^T A x) of a solution x of A x = b. Collective."""
        return sqrt(max(float(self._operators.sum(np.array([solution @ right_side]))[0]), 0.0))

    def interface_block(self, _interface: Interface) -> None:
        """Return None: each column takes a solve."""

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X on the interface DOFs, (n, r). Collective."""
        right_sides = np.zeros((self._operators.size, columns.shape[1]))
        right_sides[interface.owned] = columns[interface.slots].toarray()
        return self.solve_block(right_sides)

    def solve_block(self, right_sides: Array, start: Array | None = None, tolerance: float | None = None) -> Array:
        """Return A^-1 B, (n, k). Collective.

        Args:
            right_sides: B, (n, k).
            start: A guess at it, (n, k).
            tolerance: Error over solution, if not that of all solves.
        """
        relative = self.tolerance if tolerance is None else tolerance
        result = np.empty(right_sides.shape)
        for first in range(0, right_sides.shape[1], AT_ONCE):
            part = slice(first, first + AT_ONCE)
            guess = None if start is None else start[:, part]
            result[:, part] = self._solved(right_sides[:, part], guess, relative, 0.0)
        return result

    def _solved(self, right_sides: Array, start: Array | None, relative: float, least: float) -> Array:
        solution, iterations, solved = conjugate_gradients(
            self.multiply, self._preconditioner, self.dots, right_sides, start, relative, least, self._most
        )
        self.solves += right_sides.shape[1]
        self.iterations += iterations
        if not solved:
            raise self._not_solved()
        return solution

    def _not_solved(self) -> RunError:
        return RunError(
            f"conjugate gradients did not solve with the effective operator in {self._most} iterations; try a larger "
            'solver.tolerance, or solver.effective = "factor"'
        )

    def _rows_of(self, springs: Springs) -> PETSc.Mat:
        sizes, block, comm = self._layout
        rows = PETSc.Mat().createAIJ(sizes, bsize=block, comm=comm)
        rows.setUp()
        rows.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        add_springs(rows, springs, self._operators.sum)
        return rows


def _columns(part: Map, x: Array) -> Array:
    """Return the images of columns under a map of vectors."""
    return np.stack([part(column) for column in x.T], axis=1)


def conjugate_gradients(
    multiply: Map,
    precondition: Map,
    dots: Callable[[Array, Array], Array],
    right_sides: Array,
    start: Array | None,
    relative: float,
    least: float,
    most: int,
) -> tuple[Array, int, bool]:
    """Solve A X = B; each column of B has its own iteration.

    A column has converged when sqrt(r^T P r) of its residual r, with the preconditioner P, is below `relative` times
    that of its right side, or below `least`. As P ~ A^-1, this is about the error in the energy norm.

    Args:
        multiply: A, (n, k) -> (n, k), symmetric positive definite.
        precondition: P, likewise.
        dots: x_j^T y_j over all ranks, (n, k), (n, k) -> (k,).
        right_sides: B, (n, k).
        start: A guess at X, (n, k), or None.
        relative: Relative tolerance.
        least: Absolute tolerance.
        most: Largest number of iterations.

    Returns:
        X, the sum of the iterations of all columns, and whether all columns converged.

    Collective.
    """
    x = np.zeros_like(right_sides) if start is None else np.array(start)
    residual = np.array(right_sides) if start is None else right_sides - multiply(x)
    weighed = precondition(residual)
    squares = dots(residual, weighed)
    sizes = squares if start is None else dots(right_sides, precondition(right_sides))
    wanted = np.maximum(relative**2 * sizes, least**2)
    left = np.flatnonzero(~(squares <= wanted))
    residual, squares = residual[:, left], squares[left]
    direction = weighed[:, left]
    iterations = 0
    for _ in range(most):
        if len(left) == 0 or not np.all(np.isfinite(squares)):
            break
        image = multiply(direction)
        lengths = squares / dots(direction, image)
        x[:, left] += lengths * direction
        residual -= lengths * image
        weighed = precondition(residual)
        former, squares = squares, dots(residual, weighed)
        iterations += len(left)
        direction = weighed + (squares / former) * direction
        unsolved = ~(squares <= wanted[left])
        if not np.all(unsolved):
            left, squares = left[unsolved], squares[unsolved]
            residual, direction = residual[:, unsolved], direction[:, unsolved]
    return x, iterations, len(left) == 0
