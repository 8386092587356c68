"""Multigrid preconditioner of effective operators by PETSc: p-multigrid in the degree of the elements, then GAMG.

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

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from gapbeam.solver.linear_algebra.rigid_body_modes import rigid_body_modes
from gapbeam.solver.system.operators import Array

AT_ONCE = 16  # columns that one pass through a matrix multiplies
FACTORED = 400_000  # DOFs of the coarse elements, above which their factor would be what iterations avoid
SMOOTHER = {
    "ksp_type": "chebyshev",
    "ksp_chebyshev_kind": "opt_fourth",
    "ksp_chebyshev_esteig": "0,0,0,1.1",
    "ksp_max_it": "4",
    "pc_type": "pbjacobi",
}
Part = Callable[[Array], Array]


class Multigrid:
    """Products with A = matrix + added, and the preconditioner, which leaves `added` to the iterations.

    Args:
        matrix: The assembled part of A, symmetric positive definite, in rows; it is taken over.
        space: The space of its DOFs.
        prefix: Prefix of PETSc's options.
        added: What is added to the matrix, as a product on blocks of columns; None: nothing.

    Collective to make and to use.
    """

    def __init__(self, matrix: PETSc.Mat, space: fem.FunctionSpace, prefix: str, added: Part | None = None) -> None:
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
    lifting = fem_petsc.interpolation_matrix(linear, space)
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
