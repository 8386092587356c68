"""Springs between DOFs of the interface, added to a distributed matrix."""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

from gapbeam.solver.system.operators import Array, Springs


def add_springs(matrix: PETSc.Mat, springs: Springs, total: Callable[[Array], Array]) -> None:
    """Add springs to a matrix on the DOFs of the body; `total` sums over ranks. Collective."""
    interface, added = springs.interface, springs.matrix
    first = matrix.getOwnershipRange()[0]
    place = interface.numbers(first, total)
    for slot, owned in zip(interface.slots, interface.owned, strict=True):
        entries = slice(added.indptr[slot], added.indptr[slot + 1])
        columns = place[added.indices[entries]].astype(PETSc.IntType)
        matrix.setValues([int(owned + first)], columns, added.data[entries], addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()
