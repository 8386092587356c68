"""A direct solver on several ranks that computes the same bits in every run: factors on every rank, and one between.

Unknowns s part the ranks (`solver.separators`); the others, i, of a rank are coupled with its own and with s:

    W = A_ii^-1 A_is on each rank,    S = A_ss - sum A_si W,
    x_s = S^-1 (b_s - sum W^T b_i),   x_i = A_ii^-1 (b_i - A_is x_s)

A_ii is factored by MUMPS on one rank, which does the same in the same order each time. On several, MUMPS adds up what
ranks send in the order in which it arrives. Slices of a slender body have few s: S is whole on every rank, and a solve
takes one sum over ranks.

Source: Przemieniecki (1963), AIAA J. 1: substructures.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import csr_matrix

from solver.errors import RunError
from solver.mumps_inverse import gives_inverse
from solver.operators import Array, Factor, Indices, Interface
from solver.out_of_memory import is_out_of_memory
from solver.own_slice import OwnSlice, own_slices
from solver.petsc_factor import SOLVE_BLOCK, PetscFactor
from solver.separators import separators

LOG = logging.getLogger("gapbeam")
MOST_SEPARATORS = 4000  # unknowns: S has 128 MB then, on every rank, and takes as long as a step with 50 000 DOFs

Sum = Callable[[Array], Array]


class SlicedFactor:
    """Solves with a symmetric positive definite matrix on several ranks, to the same bits in every run.

    Args:
        rows: The rows of this rank, (n, N).
        starts: First row of each rank and the number of all, (ranks + 1,).
        parting: Unknowns that part the ranks, by number over all ranks, (s,).
        prefix: Of PETSc's options for the factor of each rank.
        comm: The ranks.
        add: Sums an array over the ranks, to the same bits on all.
        columns_limit: Bytes that W and columns A^-1 E X may take over all ranks; None: no limit.

    Raises:
        RunError: A factorization failed, on whichever rank; on all ranks.

    Collective to make and to use.
    """

    tolerance = 0.0

    def __init__(
        self,
        rows: csr_matrix,
        starts: Indices,
        parting: Indices,
        prefix: str,
        comm: MPI.Comm,
        add: Sum,
        columns_limit: float | None = None,
    ) -> None:
        self._sum, self._total, self._limit = add, int(starts[-1]), columns_limit
        first, end = starts[comm.rank : comm.rank + 2]
        self._slots = np.flatnonzero((parting >= first) & (parting < end))  # of the separators that this rank owns
        self._parting = np.asarray(parting[self._slots] - first)
        self._count = len(parting)
        inside = np.setdiff1d(np.arange(end - first), self._parting)
        inner, border = rows[inside], rows[self._parting]
        order, self._own = self._factored(
            csr_matrix(inner[:, inside + first]), csr_matrix(inner[:, parting]), prefix, comm
        )
        self._inside = inside[order]
        size = comm.allreduce(sum(one.bytes for one in self._own))
        keeps = columns_limit is None or size <= columns_limit
        if columns_limit is not None and keeps:
            self._limit = columns_limit - size
        schur = np.zeros((self._count, self._count))
        schur[self._slots] = border[:, parting].toarray()
        for one in self._own:
            schur[np.ix_(one.near, one.near)] -= one.respond(keeps)
        whole = add(schur)
        try:
            self._schur = cho_factor(0.5 * (whole + whole.T), lower=True, overwrite_a=True)
        except (LinAlgError, ValueError) as error:
            raise not_factored(self._total, str(error)) from error

    def _factored(
        self, inner: csr_matrix, coupling: csr_matrix, prefix: str, comm: MPI.Comm
    ) -> tuple[Indices, list[OwnSlice]]:
        """Return the slices of this rank as `own_slices` does. Collective."""
        found: tuple[Indices, list[OwnSlice]] = np.empty(0, dtype=np.int64), []
        fault: Exception | None = None
        try:
            if inner.shape[0]:
                found = own_slices(inner, coupling, prefix)
        except (PETSc.Error, MemoryError) as error:
            fault = error
        told = comm.allgather(None if fault is None else (str(fault), is_out_of_memory(fault)))
        faults = [one for one in told if one is not None]
        if faults:
            words, of_memory = faults[0]
            raise not_factored(self._total, words) from (fault or (MemoryError(words) if of_memory else None))
        return found

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self._limit is None or 8.0 * self._total * columns <= self._limit

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b. Collective."""
        inner, pull = right_side[self._inside], np.zeros(self._count)
        for one in self._own:
            pull[one.near] += one.pull(inner[one.rows])
        between = self._between(right_side[self._parting], pull)
        result = np.empty_like(right_side)
        result[self._parting] = between[self._slots]
        for one in self._own:
            inner[one.rows] = one.solve(inner[one.rows] - one.coupling @ between[one.near])
        result[self._inside] = inner
        return result

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X on the interface DOFs, (n, r), column-major. Collective."""
        loaded, inside, border, on_border = self._places(interface)
        own = np.zeros((len(self._parting), columns.shape[1]))
        own[on_border] = columns[border].toarray()
        result = np.zeros((len(self._inside) + len(self._parting), columns.shape[1]), order="F")
        pull = np.zeros((self._count, columns.shape[1]))
        for one in self._own:  # each rank its own, all at the same time
            there = self._there(one, inside)
            here = csr_matrix(columns[loaded[there]])
            mine = np.unique(here.indices)
            for begin in range(0, len(mine), SOLVE_BLOCK):
                part = mine[begin : begin + SOLVE_BLOCK]
                solved = one.solve_columns(inside[there] - one.rows.start, csr_matrix(here[:, part]))
                pull[np.ix_(one.near, part)] += one.coupling.T @ solved
                result[np.ix_(self._inside[one.rows], part)] = solved
        between = self._between(own, pull)
        result[self._parting] = between[self._slots]
        for one in self._own:
            places = self._inside[one.rows]
            for begin in range(0, columns.shape[1] * (len(one.near) > 0), SOLVE_BLOCK):
                part = slice(begin, begin + SOLVE_BLOCK)
                result[places, part] -= one.push(between[one.near, part])
        return result

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E, (interface.size, interface.size), symmetric; None without MUMPS's function. Collective.

        E^T A^-1 E = E_i^T A_ii^-1 E_i + Z S^-1 Z^T,    Z = E_s^T - E_i^T W
        """
        if not gives_inverse():
            return None
        loaded, inside, border, on_border = self._places(interface)
        block: Array = np.zeros((interface.size, interface.size))
        seen: Array = np.zeros((interface.size, self._count))
        for one in self._own:
            there = self._there(one, inside)
            if len(there):
                rows = inside[there] - one.rows.start
                block[np.ix_(loaded[there], loaded[there])] = one.interface_block(rows)
                seen[np.ix_(loaded[there], one.near)] = -one.responses_at(rows)
        seen[border, self._slots[on_border]] = 1.0
        seen = self._sum(seen)
        whole = self._sum(block) + seen @ cho_solve(self._schur, seen.T, check_finite=False)
        return np.asarray(0.5 * (whole + whole.T))

    def _places(self, interface: Interface) -> tuple[Indices, Indices, Indices, Indices]:
        """Return where interface DOFs of this rank stand.

        Slots of those inside, their numbers; slots of those that part ranks, their numbers.
        """
        place = np.full(len(self._inside) + len(self._parting), -1)
        place[self._inside] = np.arange(len(self._inside))
        inside = place[interface.owned]
        loaded = inside >= 0
        on_border = np.searchsorted(self._parting, interface.owned[~loaded])
        return interface.slots[loaded], inside[loaded], interface.slots[~loaded], on_border

    def _there(self, one: OwnSlice, inside: Indices) -> Indices:
        """Return which of some unknowns, by their numbers inside, are those of a slice."""
        return np.flatnonzero((inside >= one.rows.start) & (inside < one.rows.stop))

    def _between(self, own: Array, pull: Array) -> Array:
        """Return x_s from b_s of this rank and what its other unknowns take off, (s,) or (s, r). Collective."""
        right_side = -pull
        right_side[self._slots] += own
        return np.asarray(cho_solve(self._schur, self._sum(right_side), overwrite_b=True, check_finite=False))


def factor_on_ranks(matrix: PETSc.Mat, prefix: str, add: Sum, columns_limit: float | None = None) -> Factor:
    """Return what solves with a symmetric positive definite matrix, the same bits in every run where that pays.

    Args:
        matrix: The matrix, which may be destroyed afterwards.
        prefix: Of PETSc's options.
        add: Sums an array over the ranks, to the same bits on all.
        columns_limit: Bytes that kept columns may take over all ranks; None: no limit.

    Raises:
        RunError: A factorization failed.
        PETSc.Error: That of MUMPS on all ranks did.

    Collective.
    """
    comm = matrix.comm.tompi4py()
    if comm.size == 1:
        return PetscFactor.of(matrix, prefix, columns_limit)
    starts = np.asarray(matrix.getOwnershipRanges(), dtype=np.int64)
    indptr, indices, values = matrix.getValuesCSR()
    rows = csr_matrix((values, indices, indptr), (len(indptr) - 1, int(starts[-1])))
    parting = separators(comm, rows, starts, matrix.getBlockSize())
    if len(parting) > MOST_SEPARATORS:
        LOG.warning(
            "%d unknowns lie between slices of the ranks, more than %d: MUMPS solves on all ranks together, and two "
            "runs, or a run and its resume, differ by round-off; fewer ranks, or fewer cells across, would make them "
            "the same to the last bit",
            len(parting),
            MOST_SEPARATORS,
        )
        return PetscFactor.of(matrix, prefix, columns_limit)
    return SlicedFactor(rows, starts, parting, prefix, comm, add, columns_limit)


def not_factored(size: int, reason: object) -> RunError:
    """Return the error that tells why an operator has no factor."""
    return RunError(
        f"the effective operator with {size} DOFs could not be factored ({reason}); "
        'solver.effective = "iterative" and a coarser mesh need less memory'
    )
