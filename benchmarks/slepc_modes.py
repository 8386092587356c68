"""The lowest modes by SLEPc's LOBPCG, with products and preconditioner of `ConjugateGradients` on blocks of columns."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from gapbeam.solver.linear_algebra.iterative.iterative_factor import ConjugateGradients
from gapbeam.solver.system.operators import Array

GUARDS = (1.2, 1.3, 2.0)  # size of the block over the number of modes: as in gapbeam, and where LOBPCG breaks down


class _Blocks:
    """A linear map on blocks of columns, as PETSc's matrix or preconditioner, which multiply dense matrices with it."""

    def __init__(self, image: Callable[[Array], Array]) -> None:
        self._image = image

    def mult(self, _matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array[:] = self._image(np.array(x.array_r)[:, None])[:, 0]

    apply = mult

    def matApply(self, _preconditioner: PETSc.PC, x: PETSc.Mat, y: PETSc.Mat) -> None:  # noqa: N802
        y.getDenseArray()[:] = self._image(np.ascontiguousarray(x.getDenseArray(readonly=True)))

    def productSetFromOptions(self, *_: object) -> bool:  # noqa: N802
        return True

    def productSymbolic(  # noqa: N802
        self, _matrix: PETSc.Mat, product: PETSc.Mat, _kind: str, a: PETSc.Mat, b: PETSc.Mat, _c: object
    ) -> None:
        product.setType("dense")
        product.setSizes((a.getSizes()[0], b.getSizes()[1]))
        product.setUp()
        product.assemble()

    def productNumeric(  # noqa: N802
        self, _matrix: PETSc.Mat, product: PETSc.Mat, _kind: str, _a: PETSc.Mat, b: PETSc.Mat, _c: object
    ) -> None:
        product.getDenseArray()[:] = self._image(np.ascontiguousarray(b.getDenseArray(readonly=True)))


def slepc_modes(
    factor: ConjugateGradients, multiply_mass: Callable[[Array], Array], count: int, residual: float
) -> tuple[Array, Array]:
    """Return the lowest eigenvalues of A x = s M x, (count,), and shapes, (n, count), on one rank.

    SLEPc's LOBPCG breaks down for some sizes of the block, where its vectors become dependent (LAPACK sygvd); the next
    size is taken then.

    Args:
        factor: Products with A and its preconditioner.
        multiply_mass: M on blocks of columns.
        count: Their number.
        residual: Tolerance of SLEPc: norm of A x - s M x over s.
    """
    for guards in GUARDS[:-1]:
        with suppress(PETSc.Error):
            return _modes(factor, multiply_mass, count, residual, int(guards * count))
    return _modes(factor, multiply_mass, count, residual, int(GUARDS[-1] * count))


def _modes(
    factor: ConjugateGradients, multiply_mass: Callable[[Array], Array], count: int, residual: float, block: int
) -> tuple[Array, Array]:
    """Return the modes as `slepc_modes` does, by blocks of a size."""
    size = len(factor.rigid)
    solver = SLEPc.EPS().create(MPI.COMM_SELF)
    solver.setOptionsPrefix("compared_modes_")
    solver.setOperators(_matrix(factor.multiply, size), _matrix(multiply_mass, size))
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setType(SLEPc.EPS.Type.LOBPCG)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
    solver.setDimensions(nev=count)
    solver.setTolerances(residual, 1000)
    solver.setLOBPCGBlockSize(block)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.PRECOND)
    transform.getKSP().setType("preonly")
    transform.getKSP().getPC().setType("python")
    transform.getKSP().getPC().setPythonContext(_Blocks(factor.precondition))
    solver.setInitialSpace([PETSc.Vec().createWithArray(np.array(mode), comm=MPI.COMM_SELF) for mode in factor.rigid.T])
    solver.solve()
    if solver.getConverged() < count:
        raise RuntimeError(f"SLEPc found {solver.getConverged()} of {count} modes")
    values = np.array([solver.getEigenvalue(number).real for number in range(count)])
    shapes, shape = np.empty((size, count)), PETSc.Vec().createSeq(size)
    for number in range(count):
        solver.getEigenvector(number, shape)
        shapes[:, number] = shape.array_r
    return values, shapes


def _matrix(image: Callable[[Array], Array], size: int) -> PETSc.Mat:
    matrix = PETSc.Mat().createPython((size, size), _Blocks(image), comm=MPI.COMM_SELF)
    matrix.setUp()
    return matrix
