"""Multigrid preconditioner of effective operators: p-multigrid in the degree of the elements, then algebraic multigrid.

    degree 2 and more: a V-cycle of two levels. The fine level smooths on the elements of the mesh; the coarse level
    solves on elements of degree 1, with an eighth of the DOFs (3D), by a factor, or beyond `FACTORED` DOFs by
    smoothed aggregation (GAMG)
    degree 1: smoothed aggregation with the rigid-body modes as near-null space

Smoothed aggregation alone takes six times as many iterations on elements of degree 2.
Coarse solves and aggregation read PETSc's options under the prefix of the solver; options of the user take precedence.

Chebyshev smoother of the fourth kind for A x = b, with the nodal diagonal blocks D of A (block Jacobi).

    z_j = (2j-3)/(2j+1) z_j-1 + (8j-4)/((2j+1) s) D^-1 r_j-1,    r_j = r_j-1 - A z_j,    x_j = x_j-1 + beta_j z_j

with s the largest eigenvalue of D^-1 A. The factors beta_j minimize the bound on the V-cycle. A sweep takes one product
with A, for many columns at once, and unlike Gauss-Seidel does not depend on the number of ranks.

Source: Lottes (2023), Numer. Linear Algebra Appl. 30, e2518; beta for four sweeps are those of its table.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from math import sqrt

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc
from scipy.linalg import eigvalsh_tridiagonal

from gapbeam.solver.linear_algebra.iterative.block_matrix import BlockMatrix, in_full, pieces
from gapbeam.solver.linear_algebra.iterative.block_product import block_residual, relax
from gapbeam.solver.linear_algebra.rigid_body_modes import rigid_body_modes
from gapbeam.solver.system.operators import Array

BETA = (1.00391310427285, 1.04035811188593, 1.14863498546254, 1.38268869241000)
SAFETY = 1.1  # of the estimate of s, which is from below
ESTIMATED = 10  # iterations for it
ROUND_OFF = 1.0e-12  # of a square: nothing is left to see in single precision


class Smoother:
    """Four sweeps on A = matrix + added.

    Args:
        matrix: In the precision that is computed in.
        added: Operator added to it, on blocks of columns; None: none.
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
    """Return about the largest eigenvalue of D^-1 A, from below: the largest of the tridiagonal matrix of Lanczos.

    Args:
        inverse: D^-1.
        multiply: A.
        dots: As in `Smoother`.
        noise: Start vector, (n, 1).

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


FACTORED = 400_000  # DOFs of the coarse elements, above which their factor would be what iterations avoid

FACTOR = "cholesky"
AGGREGATION = "gamg"
SINGLE = np.dtype(np.float32)
Part = Callable[[Array], Array]
Dots = Callable[[Array, Array], Array]


class Aggregation:
    """A = matrix + added on elements of degree 1, preconditioned by smoothed aggregation.

    Args:
        matrix: The assembled part of A, symmetric positive definite, in rows; it is taken over.
        space: The space of its DOFs.
        prefix: Prefix of PETSc's options.
        added: Operator added to the matrix, as a product on blocks of columns; None: none.

    Collective to make and to use.
    """

    def __init__(self, matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str, added: Part | None = None) -> None:
        self._added, self._rows, self._space, self._prefix = added, matrix, space, prefix
        with_rigid_body_modes(matrix, space)
        self._matrix = BlockMatrix.of(matrix.copy(), space.dofmap.index_map_bs)
        self._inverse = _Preconditioner(matrix, prefix, AGGREGATION)

    def multiply(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        return self._matrix(x) if self._added is None else self._matrix(x) + self._added(x)

    def precondition(self, residual: Array) -> Array:
        """Return about A^-1 r, (n, k). Collective."""
        return self._inverse(residual)

    def stiffened(self, springs: PETSc.Mat, product: BlockMatrix) -> Aggregation:
        """Return the same for A + springs, a matrix in rows of a few DOFs and its product. Collective."""
        other = copy(self)
        other._added = _sum(self._added, product)
        rows = self._rows.copy()
        rows.axpy(1.0, springs, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        with_rigid_body_modes(rows, self._space)
        other._inverse = _Preconditioner(rows, self._prefix, AGGREGATION)
        return other


class Multigrid:
    """A = matrix + added on elements of degree 2 and more, preconditioned by a V-cycle.

    The V-cycle computes in single precision, except for the coarse solve: it need not be exact, and reads half as much.

    Args:
        matrix: As of `Aggregation`, and so are space, prefix and added.
        dots: x_j^T y_j over all ranks, (n, k), (n, k) -> (k,).

    Collective to make and to use.
    """

    def __init__(
        self, matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str, dots: Dots, added: Part | None = None
    ) -> None:
        self._added, self._dots, self._prefix = added, dots, f"{prefix}mg_coarse_"
        block = space.dofmap.index_map_bs
        self._space = fem.functionspace(space.mesh, ("Lagrange", 1, (block,)))
        self._lifting = fem_petsc.interpolation_matrix(self._space, space)
        self._lifting.assemble()
        self._small = matrix.ptap(self._lifting)
        self._matrix = BlockMatrix.of(matrix, block)
        self._diagonal = self._matrix.diagonal
        self._restricted = BlockMatrix.of(self._lifting.transpose(PETSc.Mat()), block).single()
        self._lifted = BlockMatrix.of(self._lifting.copy(), block).single()
        self._single = self._matrix.single()
        self._set_up(self._small, self._diagonal)

    def _set_up(self, small: PETSc.Mat, diagonal: Array) -> None:
        small.setBlockSize(self._matrix.size)
        small.setOption(PETSc.Mat.Option.SPD, True)
        with_rigid_body_modes(small, self._space)
        kind = FACTOR if small.getSize()[0] <= FACTORED else AGGREGATION
        self._coarse = _Preconditioner(small, self._prefix, kind)
        self._smoother = Smoother(self._single, self._added, diagonal, self._dots)

    def multiply(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        return self._matrix(x) if self._added is None else self._matrix(x) + self._added(x)

    def precondition(self, residual: Array) -> Array:
        """Return about A^-1 r, (n, k), each column scaled, as single precision has a narrow range. Collective."""
        result = np.empty_like(residual)
        sizes = np.sqrt(self._dots(residual, residual))
        scale = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
        for part in pieces(residual.shape[1]):
            count = part.stop - part.start
            found = self._cycle(in_full(residual[:, part] * scale[part], SINGLE))
            np.multiply(found[:, :count], sizes[part], out=result[:, part])
        return result

    def _cycle(self, right_side: Array) -> Array:
        x, missing = self._smoother.smooth(right_side)
        lifted = self._lifted(self._coarse(self._restricted(missing)))
        x += lifted
        missing -= self._smoother.multiply(lifted)
        x += self._smoother.smooth(missing, last=True)[0]
        return x

    def stiffened(self, springs: PETSc.Mat, product: BlockMatrix) -> Multigrid:
        """Return the same for A + springs: both levels see them. See `Aggregation`. Collective."""
        other = copy(self)
        other._added = _sum(self._added, product)
        small = self._small.copy()
        small.axpy(1.0, springs.ptap(self._lifting), PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        other._set_up(small, self._diagonal + product.diagonal)
        return other


class _Preconditioner:
    """One of PETSc's, set up, on blocks of columns."""

    def __init__(self, matrix: PETSc.Mat, prefix: str, kind: str) -> None:
        self._matrix, self._inner = matrix, PETSc.PC().create(matrix.comm)
        self._inner.setOptionsPrefix(prefix)
        self._inner.setOperators(matrix)
        self._inner.setType(kind)
        if kind == FACTOR:
            self._inner.setFactorSolverType("mumps")
        self._inner.setFromOptions()
        self._inner.setUp()
        self._in, self._out = matrix.createVecs()

    def __call__(self, x: Array) -> Array:
        if x.shape[1] == 1:
            self._in.array[:] = x[:, 0]
            self._inner.apply(self._in, self._out)
            return np.array(self._out.array_r)[:, None]
        sizes = self._in.getSizes(), (PETSc.DECIDE, x.shape[1])
        given = PETSc.Mat().createDense(sizes, array=np.array(x, float, order="F"), comm=self._matrix.comm)
        found = PETSc.Mat().createDense(sizes, comm=self._matrix.comm)
        found.setUp()
        for made in (given, found):
            made.assemble()
        self._inner.matApply(given, found)
        result = np.array(found.getDenseArray(), order="C")
        for made in (given, found):
            made.destroy()
        return result


def multigrid(
    matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str, dots: Dots, added: Part | None = None
) -> Aggregation | Multigrid:
    """Return products with an effective operator and its preconditioner; arguments as of `Multigrid`. Collective."""
    if space.element.basix_element.degree == 1:
        return Aggregation(matrix, space, prefix, added)
    return Multigrid(matrix, space, prefix, dots, added)


def _sum(one: Part | None, other: Part) -> Part:
    return other if one is None else lambda x: one(x) + other(x)


def with_rigid_body_modes(matrix: PETSc.Mat, space: fem.FunctionSpace) -> None:
    """Give an operator the rigid-body modes as its near-null space. Collective."""
    modes = rigid_body_modes(space).T
    vectors = [PETSc.Vec().createWithArray(np.ascontiguousarray(mode), comm=matrix.comm) for mode in modes]
    matrix.setNearNullSpace(PETSc.NullSpace().create(vectors=vectors, comm=matrix.comm))
