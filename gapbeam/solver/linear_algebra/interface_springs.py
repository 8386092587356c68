"""Springs between DOFs of the interface, added to a distributed matrix that only multiplies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from gapbeam.solver.system.operators import Array, Springs


def add_springs(matrix: PETSc.Mat, springs: Springs, total: Callable[[Array], Array]) -> None:
    """Add springs to a matrix on the DOFs of the body that has room for them; `total` sums over ranks. Collective."""
    interface, added = springs.interface, springs.matrix
    first = matrix.getOwnershipRange()[0]
    place = interface.numbers(first, total)
    for slot, owned in zip(interface.slots, interface.owned, strict=True):
        entries = slice(added.indptr[slot], added.indptr[slot + 1])
        columns = place[added.indices[entries]].astype(PETSc.IntType)
        matrix.setValues([int(owned + first)], columns, added.data[entries], addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()


def enlarge_by_springs(matrix: PETSc.Mat, springs: Springs, total: Callable[[Array], Array]) -> None:
    """Add springs to a matrix that may have no room for them, so that it grows once; as `add_springs`. Collective."""
    interface, added = springs.interface, springs.matrix
    first, end = matrix.getOwnershipRange()
    place = interface.numbers(first, total)
    counts = np.zeros(end - first, dtype=PETSc.IntType)
    counts[interface.owned] = np.diff(added.indptr)[interface.slots]
    order = np.argsort(interface.owned)
    rows = [slice(added.indptr[slot], added.indptr[slot + 1]) for slot in np.asarray(interface.slots)[order]]
    columns = np.concatenate([place[added.indices[row]] for row in rows] or [np.empty(0)]).astype(PETSc.IntType)
    values = np.concatenate([added.data[row] for row in rows] or [np.empty(0)])
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
    sparse = PETSc.Mat().createAIJ(matrix.getSizes(), csr=(starts, columns, values), comm=matrix.comm)
    matrix.axpy(1.0, sparse, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    sparse.destroy()


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
