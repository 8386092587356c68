"""A linear map on the vectors of a rank as PETSc's matrix, which knows nothing but its products."""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

from gapbeam.solver.system.operators import Array


class _Product:
    def __init__(self, product: Callable[[Array], Array]) -> None:
        self._product = product

    def mult(self, _matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        y.array[:] = self._product(x.array_r)


def as_matrix(product: Callable[[Array], Array], like: PETSc.Mat) -> PETSc.Mat:
    """Return a symmetric linear map as PETSc's matrix, laid out like another one. Collective."""
    matrix = PETSc.Mat().createPython(like.getSizes(), _Product(product), comm=like.comm)
    matrix.setUp()
    return matrix
