"""MUMPS factors of distributed matrices, corrected on the deflation basis Z, and entries of inverses from them.

A = c_m M + c_k K is assembled and factored with round-off of the entries of c_k K. On the slow motions Z of a slender
body K is nearly zero, and c_m M lies in the last digits of A. With A Z known to more digits (`smooth_modes`)

    x = F b,    x' = x + Z (Z^T A Z)^-1 (Z^T b - (A Z)^T x),    F ~ A^-1 the factor

keeps momentum and the balance of low frequencies to more digits than the factor alone. A seat has rigid motions for Z:
where their restraint is less than the round-off of K, F has no digit on them, and right sides are corrected as well.

Source: Nicolaides (1987), SIAM J. Numer. Anal. 24, 355; Mandel (1993), Comm. Numer. Methods Eng. 9, 233.

A column of A^-1 takes a solve: up the tree of the factor from where the column's one is, and down the whole tree. The
entries that are wanted lie on few branches, those of the interface; MUMPS leaves out all others, up and down (its
ICNTL(30)).

Source: Amestoy, Duff, L'Excellent, Robert, Rouet and Ucar (2012), SIAM J. Sci. Comput. 34, A1975.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from gapbeam.meshes.versions.mumps_functions import gives_inverse, mumps_inverse
from gapbeam.solver.linear_algebra.smooth_modes import Deflation
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.system.operators import Array, Factor, Indices, Interface

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


SOLVE_BLOCK = 64  # right sides at once when the Delassus operator is made


class PetscFactor:
    """MUMPS Cholesky factor of an effective operator.

    Args:
        factored: The factor, as PETSc's matrix.
        right_side: A vector of the layout of A.
        columns_limit: Bytes that columns A^-1 E X may take over all ranks; None: no limit.
    """

    tolerance = 0.0

    def __init__(self, factored: PETSc.Mat, right_side: PETSc.Vec, columns_limit: float | None = None) -> None:
        self._factored, self._limit = factored, columns_limit
        self._right_side, self._solution = right_side, right_side.duplicate()
        self._comm: MPI.Comm = right_side.comm.tompi4py()

    @classmethod
    def of(cls, matrix: PETSc.Mat, prefix: str, columns_limit: float | None = None) -> PetscFactor:
        """Factor a matrix, with a prefix for PETSc's options; the matrix itself is no longer needed. Collective."""
        preconditioner = PETSc.PC().create(matrix.comm)
        preconditioner.setOptionsPrefix(prefix)
        preconditioner.setOperators(matrix)
        preconditioner.setType("cholesky")
        preconditioner.setFactorSolverType("mumps")
        preconditioner.setFromOptions()
        preconditioner.setUp()
        return cls(preconditioner.getFactorMatrix(), matrix.createVecLeft(), columns_limit)

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self._limit is None or 8.0 * self._right_side.getSize() * columns <= self._limit

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b. Collective."""
        self._right_side.array[:] = right_side
        self._factored.solve(self._right_side, self._solution)
        return np.array(self._solution.array_r)

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X on the interface DOFs, (n, r), column-major. Collective.

        The columns are given to MUMPS as the sparse ones that they are: it leaves out what they do not reach.
        """
        local, total = self._right_side.getSizes()
        numbers = self._numbers(interface)
        transposed = columns.T.tocsr()
        result = np.empty((local, columns.shape[1]), order="F")
        for first in range(0, columns.shape[1], SOLVE_BLOCK):
            sides = self._right_sides(transposed[first : first + SOLVE_BLOCK], numbers)
            count = sides.getSize()[1]
            solved = PETSc.Mat().createDense(((local, total), (PETSc.DECIDE, count)), comm=self._right_side.comm)
            solved.setUp()
            solved.assemble()
            self._factored.matSolve(sides, solved)
            result[:, first : first + count] = solved.getDenseArray()
            for made in (sides, solved):
                made.destroy()
        return result

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E, (interface.size, interface.size), symmetric, the same on all ranks. Collective.

        Raises:
            RunError: MUMPS did not compute it, from lack of memory.
        """
        return inverse_entries(self._factored, self._numbers(interface))

    def _numbers(self, interface: Interface) -> Indices:
        """Return the row of A of each interface DOF, (interface.size,). Collective."""
        first = self._right_side.getOwnershipRange()[0]
        return np.asarray(interface.numbers(first, self._comm.allreduce).astype(PETSc.IntType))

    def _right_sides(self, rows: csr_matrix, numbers: Indices) -> PETSc.Mat:
        """Return the transpose of rows (r, interface.size), whole on rank 0, where MUMPS takes sparse right sides."""
        total, here = self._right_side.getSize(), self._comm.rank == 0
        entries: tuple[Any, ...] = (np.zeros(1, dtype=PETSc.IntType), np.empty(0, dtype=PETSc.IntType), np.empty(0))
        if here:
            entries = (rows.indptr.astype(PETSc.IntType), numbers[rows.indices], rows.data)
        sizes = ((rows.shape[0] * here, rows.shape[0]), (total * here, total))
        whole = PETSc.Mat().createAIJ(sizes, csr=entries, comm=self._right_side.comm)
        return PETSc.Mat().createTranspose(whole)


@dataclass(frozen=True)
class DeflatedFactor:
    """Solves with A by its factor and a correction on Z.

    Attributes:
        factor: The factor of A.
        deflation: Z and A Z.
        answers: F A Z, (n, k): right sides are then corrected as well, so that the solver is symmetric even where the
            factor has hardly a digit on Z; None: the factor has digits enough.
    """

    factor: Factor
    deflation: Deflation
    answers: Array | None = None
    tolerance: ClassVar[float] = 0.0

    @classmethod
    def symmetric(cls, factor: Factor, deflation: Deflation) -> DeflatedFactor:
        """Return the two-level solver x' = x + Z E^-1 (Z^T b - (A Z)^T x), x = F (b - A Z E^-1 Z^T b). Collective."""
        return cls(factor, deflation, np.column_stack([factor.solve(image) for image in deflation.images.T.copy()]))

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self.factor.keeps(columns)

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b, (n,). Collective."""
        deflation, solved = self.deflation, self.factor.solve(right_side)
        if self.answers is not None:
            solved -= self.answers @ deflation.coarse_solve(deflation.basis.T @ right_side)
        solved += deflation.basis @ deflation.coarse_solve(deflation.coarse_residual(right_side, solved))
        return solved

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X, (n, r), column-major. Collective."""
        deflation, solved = self.deflation, self.factor.solve_columns(interface, columns)
        loaded = np.asarray((columns[interface.slots].T @ deflation.basis[interface.owned]).T)
        if self.answers is not None:
            solved -= self.answers @ deflation.coarse_solve(loaded)
        coefficients = deflation.coarse_solve(loaded - deflation.images.T @ solved)
        for begin in range(0, solved.shape[1], SOLVE_BLOCK):  # all columns at once would take their memory again
            part = slice(begin, begin + SOLVE_BLOCK)
            solved[:, part] += deflation.basis @ coefficients[:, part]
        return solved

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E as the factor has it, or None. Collective."""
        return self.factor.interface_block(interface) if self.answers is None else None
