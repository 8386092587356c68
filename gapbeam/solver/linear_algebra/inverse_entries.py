"""Entries of an inverse from MUMPS's factor, without the columns that they lie in.

A column of A^-1 takes a solve: up the tree of the factor from where the column's one is, and down the whole tree. The
entries that are wanted lie on few branches, those of the interface; MUMPS leaves out all others, up and down (its
ICNTL(30)).

Source: Amestoy, Duff, L'Excellent, Robert, Rouet and Ucar (2012), SIAM J. Sci. Comput. 34, A1975.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from gapbeam.meshes.versions.mumps_functions import gives_inverse, mumps_inverse
from gapbeam.solver.errors import RunError
from gapbeam.solver.system.operators import Array, Indices

AT_ONCE = 64  # columns
_AT_ONCE, _ENTRIES = 27, 30  # settings of MUMPS: how many columns at once; that entries of the inverse are wanted
_CHANGED = (20, 21, _AT_ONCE, _ENTRIES)  # settings that are not the same afterwards: forms of right sides and solutions


def inverse_entries(factored: PETSc.Mat, numbers: Indices) -> Array | None:
    """Return the block of A^-1 between some rows of A, symmetric, the same on all ranks.

    Args:
        factored: MUMPS's factor of A, symmetric, as PETSc's matrix.
        numbers: The rows of A, each once, (k,).

    Returns:
        The block, (k, k); None where PETSc does not give access to MUMPS's function.

    Raises:
        RunError: MUMPS did not compute it, from lack of memory.

    Collective.
    """
    if not gives_inverse():
        return None
    comm = factored.comm.tompi4py()
    order = np.argsort(numbers)
    rows = np.asarray(numbers)[order].astype(PETSc.IntType)
    wanted, seen = _wanted(factored, rows, comm)
    before = {setting: factored.getMumpsIcntl(setting) for setting in _CHANGED}
    factored.setMumpsIcntl(_AT_ONCE, AT_ONCE)
    try:
        mumps_inverse(factored, seen)
    except RuntimeError as error:
        raise RunError(f"the responses of the contact faces were not found ({error})") from error
    finally:
        for setting, value in before.items():
            factored.setMumpsIcntl(setting, value)
    block = np.zeros((len(rows), len(rows)))
    if comm.rank == 0:
        _fill(block, order, wanted.getDiagonalBlock().getValuesCSR()[2])
    for made in (seen, wanted):
        made.destroy()
    comm.Bcast(block)
    return block


def _wanted(factored: PETSc.Mat, rows: Indices, comm: MPI.Comm) -> tuple[PETSc.Mat, PETSc.Mat]:
    """Return the upper triangle that is asked for, whole on rank 0, and the transpose of it that MUMPS takes."""
    total, here = factored.getSize()[0], comm.rank == 0
    starts, columns = np.zeros(total * here + 1, dtype=PETSc.IntType), np.empty(0, dtype=PETSc.IntType)
    if here:
        counts = np.zeros(total, dtype=PETSc.IntType)
        counts[rows] = np.arange(len(rows), 0, -1)
        np.cumsum(counts, out=starts[1:])
        columns = np.concatenate([rows[first:] for first in range(len(rows))])
    sizes = ((total * here, total), (total * here, total))
    wanted = PETSc.Mat().createAIJ(sizes, csr=(starts, columns, np.zeros(len(columns))), comm=factored.comm)
    return wanted, PETSc.Mat().createTranspose(wanted)


def _fill(block: Array, order: Indices, values: Array) -> None:
    """Set a symmetric block from the rows of its upper triangle, which are in another order."""
    end = 0
    for place, row in enumerate(order):
        start, end = end, end + len(order) - place
        block[row, order[place:]] = block[order[place:], row] = values[start:end]
