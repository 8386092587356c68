"""Conjugate gradients in the place of a factor, for operators whose factor does not fit in memory.

Errors are told in the energy norm of the operator, for which the residual r and the preconditioner B stand:
sqrt(r^T B r) against sqrt(x^T A x) of the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from solver.added_springs import add_springs
from solver.block_matrix import AT_ONCE, BlockMatrix
from solver.conjugate_gradients import conjugate_gradients
from solver.errors import RunError
from solver.exact_motions import ExactMotions
from solver.multigrid import multigrid
from solver.operators import Array, Interface, Operators, RankOnes, Springs

MOST_ITERATIONS = 2000
PATIENCE = 12  # iterations; to put springs into the preconditioner takes as long as some six
LEAST = 1.0e-13  # of the right side: what round-off leaves of a tolerance
Part = Callable[[Array], Array]


class _Deflated:
    """A preconditioner B that solves exactly for the rigid motions R, on blocks of columns.

        Q + (1 - Q A) B (1 - A Q),    Q = R (R^T A R)^-1 R^T

    Contact that is stiff beside what holds a floating body would leave them to hundreds of iterations.
    Source: Mandel (1993), the balancing of domain decomposition.
    """

    def __init__(self, inner: Part, motions: Array, images: Array, operators: Operators) -> None:
        self._inner, self._motions, self._images, self._operators = inner, motions, images, operators
        energy = operators.sum(np.ascontiguousarray(motions.T @ images))
        self._inverse = np.linalg.inv(0.5 * (energy + energy.T))

    def __call__(self, x: Array) -> Array:
        share = self._inverse @ self._operators.sum(np.ascontiguousarray(self._motions.T @ x))
        y = self._inner(x - self._images @ share)
        turned = self._inverse @ self._operators.sum(np.ascontiguousarray(self._images.T @ y))
        y += self._motions @ (share - turned)
        return y


class IterativeFactor:
    """What solves with A = matrix + added by conjugate gradients.

    Args:
        matrix: The assembled part of A; it is taken over.
        space: The space of its DOFs.
        motions: Its rigid motions, orthonormal, (n, r).
        operators: They sum over ranks.
        prefix: Of PETSc's options.
        tolerance: Error over solution.
        added: What is added to the matrix.
        images: A R of the rigid motions R, (n, r), where it is known better than round-off leaves it to the matrix.

    Attributes:
        tolerance: As given.
        motions: As given.
        solves: Solves so far.
        iterations: Their iterations.

    Collective to make and to use.
    """

    def __init__(
        self,
        matrix: PETSc.Mat,
        space: fem.FunctionSpace,
        motions: Array,
        operators: Operators,
        prefix: str,
        tolerance: float,
        added: RankOnes | None = None,
        images: Array | None = None,
    ) -> None:
        self._operators, self.tolerance, self.motions = operators, tolerance, motions
        self.solves = self.iterations = 0
        more = None if added is None else lambda x: _columns(lambda column: added.apply(column, operators), x)
        layout = matrix.getSizes(), matrix.getBlockSize(), matrix.comm
        self._levels = multigrid(matrix, space, prefix, self.dots, more)
        self._layout = layout
        self._product: Part = self._levels.multiply
        if images is None:
            self._images = self._product(motions)
        else:
            self._images = images
            self._product = ExactMotions(self._product, motions, images, self.sum)
        self._plain = self._deflated(self._levels.precondition, self._images)
        self._stiff = self._levels  # with the springs of a solve that iterated too long without them
        self._most = PETSc.Options(prefix).getInt("ksp_max_it", MOST_ITERATIONS)

    def keeps(self, _columns: int) -> bool:
        """Return False: columns A^-1 E X take a solve each."""
        return False

    def multiply(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        return self._product(x)

    def precondition(self, residual: Array) -> Array:
        """Return about A^-1 r, (n, k), of few columns at a time: a V-cycle holds ten times as many. Collective."""
        result = np.empty(residual.shape)
        for first in range(0, residual.shape[1], AT_ONCE):
            part = slice(first, first + AT_ONCE)
            result[:, part] = self._plain(residual[:, part])
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
            springs: What is added to A, positive semi-definite; None: nothing.
            size: sqrt(x^T A x) of what the error is small against; None: that of the solution itself.
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
        product = BlockMatrix.of(rows.copy(), self._layout[1])
        images = self._images + product(self.motions)

        def multiply(x: Array) -> Array:
            return self.multiply(x) + product(x)

        precondition = self._deflated(self._stiff.precondition, images)
        self.solves += 1
        for most in (PATIENCE, self._most):
            first, iterations, solved = conjugate_gradients(
                multiply, precondition, self.dots, right_sides, first, relative, least, min(most, self._most)
            )
            self.iterations += iterations
            if solved:
                return first[:, 0]
            self._stiff = self._levels.stiffened(rows, product)
            precondition = self._deflated(self._stiff.precondition, images)
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
            self.multiply, self._plain, self.dots, right_sides, start, relative, least, self._most
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

    def _deflated(self, inner: Part, images: Array) -> _Deflated:
        return _Deflated(inner, self.motions, images, self._operators)

    def _rows_of(self, springs: Springs) -> PETSc.Mat:
        sizes, block, comm = self._layout
        rows = PETSc.Mat().createAIJ(sizes, bsize=block, comm=comm)
        rows.setUp()
        rows.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        add_springs(rows, springs, self._operators.sum)
        return rows


def _columns(part: Part, x: Array) -> Array:
    """Return the images of columns under a map of vectors."""
    return np.stack([part(column) for column in x.T], axis=1)
