"""Conjugate gradients and multigrid of PETSc's own, for the operators that `ConjugateGradients` solves with.

KSPCG, preconditioned by PCMG on two levels: a smoother on the elements of degree 2, a Cholesky factor by MUMPS (beyond
400 000 DOFs: GAMG) on those of degree 1. The matrix is stored in blocks (BAIJ). Products and preconditioner are exact
for the rigid-body modes by the same deflation, so that both solve the same system to the same tolerance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from gapbeam.solver.linear_algebra.iterative.deflation import Deflation
from gapbeam.solver.linear_algebra.iterative.multigrid import FACTORED, with_rigid_body_modes
from gapbeam.solver.system.operators import Array

PREFIX = "compared_"
SMOOTHERS = {
    "fourth kind, pbjacobi": {
        "ksp_type": "chebyshev",
        "ksp_chebyshev_kind": "opt_fourth",
        "ksp_chebyshev_esteig": "0,0,0,1.1",
        "ksp_max_it": "4",
        "pc_type": "pbjacobi",
    },
    "first kind, sor": {"ksp_type": "chebyshev", "ksp_max_it": "2", "pc_type": "sor"},
}


class PetscMultigrid:
    """Solves A x = b by KSPCG and PCMG.

    Args:
        matrix: A, assembled; the solver takes it over.
        space: The space of its DOFs.
        deflation: The rigid-body modes R and A R.
        smoother: A name in `SMOOTHERS`.
        tolerance: sqrt(r^T B r) over that of b, B the preconditioner.

    Attributes:
        iterations: Iterations of all solves so far.
    """

    def __init__(
        self, matrix: PETSc.Mat, space: fem.FunctionSpace, deflation: Deflation, smoother: str, tolerance: float
    ) -> None:
        self.iterations = 0
        block = space.dofmap.index_map_bs
        linear = fem.functionspace(space.mesh, ("Lagrange", 1, (block,)))
        prolongation = fem_petsc.interpolation_matrix(linear, space)
        prolongation.assemble()
        coarse = matrix.ptap(prolongation)
        coarse.setBlockSize(block)
        coarse.setOption(PETSc.Mat.Option.SPD, True)
        with_rigid_body_modes(coarse, linear)
        self._matrix = matrix.convert("baij")  # in place
        sizes, comm = matrix.getSizes(), matrix.comm
        _set_options(smoother, coarse.getSize()[0] <= FACTORED)
        self._multigrid = PETSc.PC().create(comm)
        self._multigrid.setOptionsPrefix(PREFIX)
        self._multigrid.setOperators(self._matrix)
        self._multigrid.setType("mg")
        self._multigrid.setMGLevels(2)
        self._multigrid.setMGInterpolation(1, prolongation)
        self._multigrid.getMGCoarseSolve().setOperators(coarse)
        self._multigrid.getMGSmoother(1).setOperators(self._matrix)
        self._multigrid.setFromOptions()
        self._multigrid.setUp()
        self._multigrid.getMGCoarseSolve().setUp()
        self._multigrid.getMGSmoother(1).setUp()
        self._in, self._out = self._matrix.createVecs()
        product = deflation.product(self._product)
        operator = PETSc.Mat().createPython(sizes, _Shell(product), comm=comm)
        operator.setUp()
        self._solver = PETSc.KSP().create(comm)
        self._solver.setType("cg")
        self._solver.setOperators(operator)
        self._solver.getPC().setType("python")
        self._solver.getPC().setPythonContext(_Shell(deflation.preconditioner(self._preconditioned)))
        self._solver.setNormType(PETSc.KSP.NormType.NATURAL)
        self._solver.setTolerances(rtol=tolerance, atol=0.0, max_it=2000)

    def solve_block(self, right_sides: Array) -> Array:
        """Return A^-1 B, (n, k), column by column, as KSPMatSolve does with KSPCG."""
        result = np.empty(right_sides.shape)
        right_side, solution = self._matrix.createVecs()
        for number, column in enumerate(right_sides.T):
            right_side.array[:] = column
            self._solver.solve(right_side, solution)
            self.iterations += self._solver.getIterationNumber()
            if self._solver.getConvergedReason() <= 0:
                raise RuntimeError(f"KSPCG did not converge (reason {self._solver.getConvergedReason()})")
            result[:, number] = solution.array_r
        return result

    def _product(self, x: Array) -> Array:
        self._in.array[:] = x[:, 0]
        self._matrix.mult(self._in, self._out)
        return np.array(self._out.array_r)[:, None]

    def _preconditioned(self, x: Array) -> Array:
        self._in.array[:] = x[:, 0]
        self._multigrid.apply(self._in, self._out)
        return np.array(self._out.array_r)[:, None]


class _Shell:
    """A linear map on blocks of one column, as PETSc's matrix or preconditioner."""

    def __init__(self, image: Callable[[Array], Array]) -> None:
        self._image = image

    def mult(self, _matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array[:] = self._image(np.array(x.array_r)[:, None])[:, 0]

    apply = mult


def _set_options(smoother: str, factored: bool) -> None:
    options = PETSc.Options(PREFIX)
    for key, value in SMOOTHERS[smoother].items():
        options[f"mg_levels_{key}"] = value
    options["mg_coarse_ksp_type"] = "preonly"
    options["mg_coarse_pc_type"] = "cholesky" if factored else "gamg"
    if factored:
        options["mg_coarse_pc_factor_mat_solver_type"] = "mumps"
