"""A direct solver on several ranks that computes the same bits in every run: a factor on every rank, and one between.

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
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from solver.errors import RunError
from solver.mumps_inverse import gives_inverse
from solver.operators import Array, Factor, Indices, Interface
from solver.out_of_memory import is_out_of_memory
from solver.petsc_factor import SOLVE_BLOCK, PetscFactor
from solver.separators import separators

LOG = logging.getLogger("gapbeam")
MOST_SEPARATORS = 4000  # unknowns: S has 128 MB then, on every rank, and takes as long as a step with 50 000 DOFs

Sum = Callable[[Array], Array]


@dataclass
class _Piece:
    """Unknowns of a rank that are coupled with each other: a slice in the support, or one outside of it.

    Attributes:
        rows: Which of those that do not part ranks.
        near: The separators that they are coupled with.
        responses: W, (rows, near); empty where it is not kept.
    """

    rows: slice
    near: Indices
    responses: Array = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def bytes(self) -> float:
        """What W takes."""
        return float(8 * (self.rows.stop - self.rows.start) * len(self.near))


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
        _, piece = connected_components(rows[inside][:, inside + first], directed=False)
        self._inside = inside[np.argsort(piece, kind="stable")]
        ends = np.cumsum(np.bincount(piece))
        inner, border = rows[self._inside], rows[self._parting]
        self._coupling = csr_matrix(inner[:, parting])
        self._rows = np.flatnonzero(np.diff(self._coupling.indptr))
        self._factor = self._factored(csr_matrix(inner[:, self._inside + first]), prefix, comm)
        self._pieces = [
            _Piece(slice(before, end), np.unique(self._coupling[before:end].indices))
            for before, end in zip(ends - np.bincount(piece), ends, strict=True)
            if self._coupling.indptr[before] < self._coupling.indptr[end]
        ]
        size = comm.allreduce(sum(one.bytes for one in self._pieces))
        self._keeps = columns_limit is None or size <= columns_limit
        if columns_limit is not None and self._keeps:
            self._limit = columns_limit - size
        schur = np.zeros((self._count, self._count))
        schur[self._slots] = border[:, parting].toarray()
        for one in self._pieces:
            schur[np.ix_(one.near, one.near)] -= self._respond(one)
        whole = add(schur)
        try:
            self._schur = cho_factor(0.5 * (whole + whole.T), lower=True, overwrite_a=True)
        except (LinAlgError, ValueError) as error:
            raise not_factored(self._total, str(error)) from error

    def _factored(self, inner: csr_matrix, prefix: str, comm: MPI.Comm) -> Factor | None:
        """Return the factor of this rank; None where there is nothing to factor. Collective."""
        factor: Factor | None = None
        fault: Exception | None = None
        try:
            factor = _factored(inner, prefix) if inner.shape[0] else None
        except (PETSc.Error, MemoryError) as error:
            fault = error
        told = comm.allgather(None if fault is None else (str(fault), is_out_of_memory(fault)))
        faults = [one for one in told if one is not None]
        if faults:
            words, of_memory = faults[0]
            raise not_factored(self._total, words) from (fault or (MemoryError(words) if of_memory else None))
        return factor

    def _respond(self, piece: _Piece) -> Array:
        """Return A_si W of a piece, and keep W where there is room for it."""
        coupling = self._coupling[piece.rows]
        coupled = np.empty((len(piece.near), len(piece.near)))
        if self._keeps:
            piece.responses = np.empty((coupling.shape[0], len(piece.near)), order="F")
        for part, solved in self._solved(piece):
            coupled[:, part] = (coupling.T @ solved)[piece.near]
            if self._keeps:
                piece.responses[:, part] = solved
        return coupled

    def _solved(self, piece: _Piece) -> Iterator[tuple[slice, Array]]:
        """Yield W of a piece, some columns at a time."""
        coupling = self._coupling[piece.rows]
        touched = np.flatnonzero(np.diff(coupling.indptr))
        for begin in range(0, len(piece.near), SOLVE_BLOCK):
            part = slice(begin, begin + SOLVE_BLOCK)
            columns = csr_matrix(coupling[touched][:, piece.near[part]])
            yield part, self._inner_columns(piece.rows.start + touched, columns)[piece.rows]

    def _responses_at(self, piece: _Piece, rows: Indices) -> Array:
        """Return some rows of W of a piece, which are solved for where they are not kept."""
        if self._keeps:
            return piece.responses[rows]
        responses = np.empty((len(rows), len(piece.near)))
        for part, solved in self._solved(piece):
            responses[:, part] = solved[rows]
        return responses

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self._limit is None or 8.0 * self._total * columns <= self._limit

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b. Collective."""
        inner = right_side[self._inside]
        if self._keeps:
            pull = np.zeros(self._count)
            for piece in self._pieces:
                pull[piece.near] += piece.responses.T @ inner[piece.rows]
        else:
            pull = self._coupling.T @ self._inner(inner)
        between = self._between(right_side[self._parting], pull)
        result = np.empty_like(right_side)
        result[self._parting] = between[self._slots]
        result[self._inside] = self._inner(inner - self._coupling @ between)
        return result

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X on the interface DOFs, (n, r), column-major. Collective."""
        loaded, inside, border, on_border = self._places(interface)
        here = csr_matrix(columns[loaded])
        own = np.zeros((len(self._parting), columns.shape[1]))
        own[on_border] = columns[border].toarray()
        result = np.zeros((len(self._inside) + len(self._parting), columns.shape[1]), order="F")
        pull = np.zeros((self._count, columns.shape[1]))
        mine = np.unique(here.indices)  # each rank its own, all at the same time
        for begin in range(0, len(mine), SOLVE_BLOCK):
            part = mine[begin : begin + SOLVE_BLOCK]
            solved = self._inner_columns(inside, csr_matrix(here[:, part]))
            pull[:, part] = self._coupling.T @ solved
            result[np.ix_(self._inside, part)] = solved
        between = self._between(own, pull)
        result[self._parting] = between[self._slots]
        for begin in range(0, columns.shape[1], SOLVE_BLOCK):
            part = slice(begin, begin + SOLVE_BLOCK)
            pushed: Array = np.zeros((len(self._inside), between[:, part].shape[1]))
            if self._keeps:
                for piece in self._pieces:
                    pushed[piece.rows] = piece.responses @ between[piece.near, part]
            else:
                pushed = self._inner_columns(self._rows, csr_matrix(self._coupling[self._rows] @ between[:, part]))
            result[self._inside, part] -= pushed
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
        if self._factor is not None and len(inside):
            alone = Interface(len(inside), inside, np.arange(len(inside)))
            block[np.ix_(loaded, loaded)] = self._factor.interface_block(alone)
        for piece in self._pieces:
            here = (inside >= piece.rows.start) & (inside < piece.rows.stop)
            if np.any(here):
                seen[np.ix_(loaded[here], piece.near)] = -self._responses_at(piece, inside[here] - piece.rows.start)
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

    def _between(self, own: Array, pull: Array) -> Array:
        """Return x_s from b_s of this rank and what its other unknowns take off, (s,) or (s, r). Collective."""
        right_side = -pull
        right_side[self._slots] += own
        return np.asarray(cho_solve(self._schur, self._sum(right_side), overwrite_b=True, check_finite=False))

    def _inner(self, right_side: Array) -> Array:
        return right_side if self._factor is None else self._factor.solve(right_side)

    def _inner_columns(self, rows: Indices, columns: csr_matrix) -> Array:
        """Return A_ii^-1 of columns that are zero but in some rows."""
        if self._factor is None or columns.nnz == 0:
            return np.zeros((len(self._inside), columns.shape[1]), order="F")
        return self._factor.solve_columns(Interface(len(rows), rows, np.arange(len(rows))), columns)


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


def _factored(matrix: csr_matrix, prefix: str) -> Factor:
    pattern = matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data
    inner = PETSc.Mat().createAIJ(matrix.shape, csr=pattern, comm=PETSc.COMM_SELF)
    inner.setOption(PETSc.Mat.Option.SPD, True)
    return PetscFactor.of(inner, prefix)


def not_factored(size: int, reason: object) -> RunError:
    """Return the error that tells why an operator has no factor."""
    return RunError(
        f"the effective operator with {size} DOFs could not be factored ({reason}); "
        'solver.effective = "iterative" and a coarser mesh need less memory'
    )
