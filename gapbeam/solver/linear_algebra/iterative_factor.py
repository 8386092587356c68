"""Conjugate gradients instead of a factor, for operators whose factor does not fit in memory.

The preconditioner B is the two-level preconditioner of `Deflation` around a V-cycle: exact on the rigid-body modes R.
Contact that is stiff beside what holds a floating body would leave R to hundreds of iterations.

Errors are measured in the energy norm of the operator A, with the residual r = b - A x and B for A^-1:

    sqrt(r^T B r) ~ sqrt(e^T A e),    against sqrt(x^T A x) of the solution

Source: Hestenes and Stiefel (1952), J. Res. Natl. Bur. Stand. 49, 409: the iteration, for several right sides at once.

The V-cycle is PETSc's: p-multigrid in the degree of the elements, then GAMG.

    degree 2 and more: a V-cycle of two levels (PCMG). The fine level smooths on the elements of the mesh by four
    sweeps of Chebyshev's method of the fourth kind on the nodal blocks; the coarse level solves on elements of degree
    1, with an eighth of the DOFs (3D), by a factor, or beyond `FACTORED` DOFs by smoothed aggregation (GAMG)
    degree 1: smoothed aggregation with the rigid-body modes as near-null space

Smoothed aggregation alone takes six times as many iterations on elements of degree 2. Both read PETSc's options under
the prefix of the solver; options of the user take precedence.

Source: Lottes (2023), Numer. Linear Algebra Appl. 30, e2518: the smoother and its factors.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from math import sqrt

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from gapbeam.meshes.versions.mesh_geometry import let_go
from gapbeam.solver.linear_algebra.smooth_modes import Deflation, Map, add_springs, rigid_body_modes
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.system.operators import Array, Interface, Operators, RankOnes, Springs

AT_ONCE = 16  # columns that one pass through a matrix multiplies
FACTORED = 400_000  # DOFs of the coarse elements, above which their factor would be what iterations avoid
SMOOTHER = {
    "ksp_type": "chebyshev",
    "ksp_chebyshev_kind": "opt_fourth",
    "ksp_chebyshev_esteig": "0,0,0,1.1",
    "ksp_max_it": "4",
    "pc_type": "pbjacobi",
}


class Multigrid:
    """Products with A = matrix + added, and the preconditioner, which leaves `added` to the iterations.

    Args:
        matrix: The assembled part of A, symmetric positive definite, in rows; it is taken over.
        space: The space of its DOFs.
        prefix: Prefix of PETSc's options.
        added: Terms added to the matrix, as a product on blocks of columns; None: nothing.

    Collective to make and to use.
    """

    def __init__(self, matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str, added: Map | None = None) -> None:
        self._matrix, self._space, self._prefix, self._added = matrix, space, prefix, added
        self._inverse = _preconditioner(matrix, space, prefix)
        self._in, self._out = matrix.createVecs()

    def multiply(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        image = columns_product(self._matrix, x)
        return image if self._added is None else image + self._added(x)

    def precondition(self, residual: Array) -> Array:
        """Return about A^-1 r, (n, k). Collective."""
        result = np.empty_like(residual)
        for number, column in enumerate(residual.T):
            self._in.array[:] = column
            self._inverse.apply(self._in, self._out)
            result[:, number] = self._out.array_r
        return result

    def stiffened(self, springs: PETSc.Mat) -> Multigrid:
        """Return the same for A + springs, a matrix in rows of a few DOFs. Collective."""
        other = copy(self)
        other._matrix = self._matrix.copy()
        other._matrix.axpy(1.0, springs, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        other._inverse = _preconditioner(other._matrix, self._space, self._prefix)
        return other


def columns_product(matrix: PETSc.Mat, x: Array) -> Array:
    """Return A X, (n, k), of which the entries of A are read once for `AT_ONCE` columns. Collective."""
    if x.shape[1] == 1:
        given, made = matrix.createVecs()
        given.array[:] = x[:, 0]
        matrix.mult(given, made)
        return np.array(made.array_r)[:, None]
    rows, total = matrix.getSizes()[1]
    result = np.empty((rows, x.shape[1]), order="F")
    for start in range(0, x.shape[1], AT_ONCE):
        columns = x[:, start : start + AT_ONCE]
        given = PETSc.Mat().createDense(((rows, total), (PETSc.DECIDE, columns.shape[1])), comm=matrix.comm)
        given.setUp()
        given.getDenseArray()[:] = columns
        given.assemble()
        made = matrix.matMult(given)
        result[:, start : start + AT_ONCE] = made.getDenseArray()
        given.destroy()
        made.destroy()
    return result


def _preconditioner(matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str) -> PETSc.PC:
    inverse = PETSc.PC().create(matrix.comm)
    inverse.setOptionsPrefix(prefix)
    inverse.setOperators(matrix)
    if space.element.basix_element.degree == 1:
        _with_rigid_body_modes(matrix, space)
        inverse.setType("gamg")
    else:
        _set_levels(inverse, matrix, space, prefix)
    inverse.setFromOptions()
    inverse.setUp()
    return inverse


def _set_levels(inverse: PETSc.PC, matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str) -> None:
    block = space.dofmap.index_map_bs
    linear = fem.functionspace(space.mesh, ("Lagrange", 1, (block,)))
    lifting = let_go(fem_petsc.interpolation_matrix(linear, space))
    lifting.assemble()
    coarse = matrix.ptap(lifting)
    coarse.setBlockSize(block)
    coarse.setOption(PETSc.Mat.Option.SPD, True)
    _with_rigid_body_modes(coarse, linear)
    options, factored = PETSc.Options(prefix), coarse.getSize()[0] <= FACTORED
    wanted = {f"mg_levels_{key}": value for key, value in SMOOTHER.items()}
    wanted |= {"mg_coarse_ksp_type": "preonly", "mg_coarse_pc_type": "cholesky" if factored else "gamg"}
    if factored:
        wanted["mg_coarse_pc_factor_mat_solver_type"] = "mumps"
    for key, value in wanted.items():
        if not options.hasName(key):
            options[key] = value
    inverse.setType("mg")
    inverse.setMGLevels(2)
    inverse.setMGInterpolation(1, lifting)
    inverse.getMGCoarseSolve().setOperators(coarse)
    inverse.getMGSmoother(1).setOperators(matrix)


def _with_rigid_body_modes(matrix: PETSc.Mat, space: fem.FunctionSpace) -> None:
    """Give an operator the rigid-body modes as its near-null space. Collective."""
    modes = rigid_body_modes(space).T
    vectors = [PETSc.Vec().createWithArray(np.ascontiguousarray(mode), comm=matrix.comm) for mode in modes]
    matrix.setNearNullSpace(PETSc.NullSpace().create(vectors=vectors, comm=matrix.comm))


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
        result = np.empty(right_sides.shape)
        for first in range(0, right_sides.shape[1], AT_ONCE):
            part = slice(first, first + AT_ONCE)
            result[:, part] = self._solved(right_sides[:, part], None, self.tolerance, 0.0)
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
