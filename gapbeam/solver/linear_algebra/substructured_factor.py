"""A direct solver on several ranks by substructuring, with the same bits in every run.

Interface unknowns s separate the ranks. The inner unknowns i of a rank are coupled with
each other and with s only. With the Schur complement S of the interface unknowns:

    W = A_ii^-1 A_is on each rank,    S = A_ss - sum A_si W,
    x_s = S^-1 (b_s - sum W^T b_i),   x_i = A_ii^-1 (b_i - A_is x_s)

MUMPS factors A_ii on one rank, always in the same order. On several ranks MUMPS would add contributions in the order
in which messages arrive. A slender body in slices has few interface unknowns: every rank holds S, and a solve takes
one sum over ranks. A rank may have several subdomains, in the support and outside of it. Each has its own factor, so
that right sides which touch one subdomain alone, such as contact forces, do not pass through the factors of the others.

Entries between nodes of two ranks are the edges of a bipartite graph. Its smallest vertex cover is the interface. For a
mesh that is cut into slices the cover is the cross-section of nodes at each cut.

Source: Przemieniecki (1963), AIAA J. 1, 138: substructures; König (1931): in a bipartite graph the smallest cover and
the largest matching have the same size.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_bipartite_matching

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.versions.mumps_functions import gives_inverse
from gapbeam.solver.linear_algebra.mumps_factor import SOLVE_BLOCK, PetscFactor
from gapbeam.solver.linear_algebra.smooth_modes import Map
from gapbeam.solver.memory.memory_check import is_out_of_memory
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.system.operators import Array, Factor, Indices, Interface

MOST_INTERFACE = 4000  # interface unknowns: S then has 128 MB on every rank and costs a step of 50 000 DOFs


class SubstructuredFactor:
    """Solves with a symmetric positive definite matrix on several ranks, to the same bits in every run.

    Args:
        rows: The rows of this rank, (n, N).
        starts: First row of each rank and the number of all, (ranks + 1,).
        between: The interface unknowns, by number over all ranks, (s,).
        prefix: Prefix of PETSc's options for the factors of each rank.
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
        between: Indices,
        prefix: str,
        comm: MPI.Comm,
        add: Map,
        columns_limit: float | None = None,
    ) -> None:
        self._sum, self._total, self._limit = add, int(starts[-1]), columns_limit
        first, end = starts[comm.rank : comm.rank + 2]
        self._slots = np.flatnonzero((between >= first) & (between < end))  # interface unknowns of this rank
        self._owned = np.asarray(between[self._slots] - first)  # their rows
        self._count = len(between)
        inside = np.setdiff1d(np.arange(end - first), self._owned)
        inner, border = rows[inside], rows[self._owned]
        order, self._subdomains = self._factored(
            csr_matrix(inner[:, inside + first]), csr_matrix(inner[:, between]), prefix, comm
        )
        self._inside = inside[order]
        size = comm.allreduce(sum(float(8 * one.coupling.shape[0] * len(one.interface)) for one in self._subdomains))
        keeps = columns_limit is None or size <= columns_limit
        if columns_limit is not None and keeps:
            self._limit = columns_limit - size
        schur = np.zeros((self._count, self._count))
        schur[self._slots] = border[:, between].toarray()
        for one in self._subdomains:
            schur[np.ix_(one.interface, one.interface)] -= one.schur_share(keeps)
        whole = add(schur)
        try:
            self._schur = cho_factor(0.5 * (whole + whole.T), lower=True, overwrite_a=True)
        except (LinAlgError, ValueError) as error:
            raise not_factored(self._total, str(error)) from error

    def _factored(
        self, inner: csr_matrix, coupling: csr_matrix, prefix: str, comm: MPI.Comm
    ) -> tuple[Indices, list[Subdomain]]:
        """Return the subdomains of this rank as `subdomains_of` does; all ranks raise the fault of one. Collective."""
        found: tuple[Indices, list[Subdomain]] = np.empty(0, dtype=np.int64), []
        fault: Exception | None = None
        try:
            if inner.shape[0]:
                found = subdomains_of(inner, coupling, prefix)
        except (PETSc.Error, MemoryError) as error:
            fault = error
        reports = comm.allgather(None if fault is None else (str(fault), is_out_of_memory(fault)))
        faults = [one for one in reports if one is not None]
        if faults:
            words, of_memory = faults[0]
            raise not_factored(self._total, words) from (fault or (MemoryError(words) if of_memory else None))
        return found

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""
        return self._limit is None or 8.0 * self._total * columns <= self._limit

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b. Collective."""
        inner, load = right_side[self._inside], np.zeros(self._count)
        for one in self._subdomains:
            load[one.interface] += one.interface_load(inner[one.rows])
        between = self._on_interface(right_side[self._owned], load)
        result = np.empty_like(right_side)
        result[self._owned] = between[self._slots]
        for one in self._subdomains:
            inner[one.rows] = one.solve(inner[one.rows] - one.coupling @ between[one.interface])
        result[self._inside] = inner
        return result

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X on the interface DOFs, (n, r), column-major. Collective."""
        loaded, inside, border, on_border = self._places(interface)
        own = np.zeros((len(self._owned), columns.shape[1]))
        own[on_border] = columns[border].toarray()
        result = np.zeros((len(self._inside) + len(self._owned), columns.shape[1]), order="F")
        load = np.zeros((self._count, columns.shape[1]))
        for one in self._subdomains:  # all ranks at the same time
            there = self._members(one, inside)
            here = csr_matrix(columns[loaded[there]])
            mine = np.unique(here.indices)
            for begin in range(0, len(mine), SOLVE_BLOCK):
                part = mine[begin : begin + SOLVE_BLOCK]
                solved = one.solve_columns(inside[there] - one.rows.start, csr_matrix(here[:, part]))
                load[np.ix_(one.interface, part)] += one.coupling.T @ solved
                result[np.ix_(self._inside[one.rows], part)] = solved
        between = self._on_interface(own, load)
        result[self._owned] = between[self._slots]
        for one in self._subdomains:
            places = self._inside[one.rows]
            for begin in range(0, columns.shape[1] * (len(one.interface) > 0), SOLVE_BLOCK):
                part = slice(begin, begin + SOLVE_BLOCK)
                result[places, part] -= one.inner_response(between[one.interface, part])
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
        for one in self._subdomains:
            there = self._members(one, inside)
            if len(there):
                rows = inside[there] - one.rows.start
                block[np.ix_(loaded[there], loaded[there])] = one.interface_block(rows)
                seen[np.ix_(loaded[there], one.interface)] = -one.responses_at(rows)
        seen[border, self._slots[on_border]] = 1.0
        seen = self._sum(seen)
        whole = self._sum(block) + seen @ cho_solve(self._schur, seen.T, check_finite=False)
        return np.asarray(0.5 * (whole + whole.T))

    def _places(self, interface: Interface) -> tuple[Indices, Indices, Indices, Indices]:
        """Return the places of the contact interface DOFs of this rank.

        Slots of the inner ones and their numbers; slots of those among the interface unknowns and their numbers.
        """
        place = np.full(len(self._inside) + len(self._owned), -1)
        place[self._inside] = np.arange(len(self._inside))
        inside = place[interface.owned]
        loaded = inside >= 0
        on_border = np.searchsorted(self._owned, interface.owned[~loaded])
        return interface.slots[loaded], inside[loaded], interface.slots[~loaded], on_border

    def _members(self, one: Subdomain, inside: Indices) -> Indices:
        """Return True for unknowns, given by their inner numbers, that belong to a subdomain."""
        return np.flatnonzero((inside >= one.rows.start) & (inside < one.rows.stop))

    def _on_interface(self, own: Array, load: Array) -> Array:
        """Return x_s, (s,) or (s, r), from the b_s of this rank and its share of sum W^T b_i. Collective."""
        right_side = -load
        right_side[self._slots] += own
        return np.asarray(cho_solve(self._schur, self._sum(right_side), overwrite_b=True, check_finite=False))


def factor_on_ranks(matrix: PETSc.Mat, prefix: str, add: Map, columns_limit: float | None = None) -> Factor:
    """Return a factor of a symmetric positive definite matrix, with the same bits in every run where that pays.

    Args:
        matrix: The matrix, which may be destroyed afterwards.
        prefix: Prefix of PETSc's options.
        add: Sums an array over the ranks, to the same bits on all.
        columns_limit: Bytes that kept columns may take over all ranks; None: no limit.

    Raises:
        RunError: A factorization failed.
        PETSc.Error: The factorization by MUMPS on all ranks failed.

    Collective.
    """
    comm = matrix.comm.tompi4py()
    if comm.size == 1:
        return PetscFactor.of(matrix, prefix, columns_limit)
    starts = np.asarray(matrix.getOwnershipRanges(), dtype=np.int64)
    indptr, indices, values = matrix.getValuesCSR()
    rows = csr_matrix((values, indices, indptr), (len(indptr) - 1, int(starts[-1])))
    between = interface_unknowns(comm, rows, starts, matrix.getBlockSize())
    if len(between) > MOST_INTERFACE:
        LOG.warning(
            "%d interface unknowns between the ranks, more than %d: MUMPS solves on all ranks together, and two runs, "
            "or a run and its resume, differ by round-off; with fewer ranks, or fewer cells across, they are the same "
            "to the last bit",
            len(between),
            MOST_INTERFACE,
        )
        return PetscFactor.of(matrix, prefix, columns_limit)
    return SubstructuredFactor(rows, starts, between, prefix, comm, add, columns_limit)


def not_factored(size: int, reason: object) -> RunError:
    """Return the error for an operator that could not be factored, with the reason."""
    return RunError(
        f"the effective operator with {size} DOFs could not be factored ({reason}); "
        'solver.effective = "iterative" and a coarser mesh need less memory'
    )


MOST_SUBDOMAINS = 8  # with a factor each; beyond, one factor serves all of these fragments


@dataclass
class Subdomain:
    """Inner unknowns of one subdomain and their factor.

    Attributes:
        rows: Its rows among the inner unknowns of this rank.
        interface: Numbers of the interface unknowns s that are coupled to it, (s,).
        coupling: A_is, (rows, s).
        factor: The factor of A_ii.
        responses: W, (rows, s); None if not kept.
    """

    rows: slice
    interface: Indices
    coupling: csr_matrix
    factor: Factor
    responses: Array | None = field(default=None, init=False)

    def solve(self, right_side: Array) -> Array:
        """Return A_ii^-1 b, (rows,)."""
        return self.factor.solve(right_side)

    def solve_columns(self, rows: Indices, columns: csr_matrix) -> Array:
        """Return A_ii^-1 of columns, given in their nonzero rows, (rows, r), column-major."""
        return self.factor.solve_columns(_as_interface(rows), columns)

    def interface_block(self, rows: Indices) -> Array:
        """Return the entries of A_ii^-1 in some rows and columns, (r, r)."""
        block = self.factor.interface_block(_as_interface(rows))
        assert block is not None
        return block

    def schur_share(self, keep: bool) -> Array:
        """Return A_si W, (s, s); keep W if asked."""
        coupled = np.empty((len(self.interface), len(self.interface)))
        kept = np.empty((self.coupling.shape[0], len(self.interface)), order="F") if keep else None
        for part, solved in self._solved():
            coupled[:, part] = self.coupling.T @ solved
            if kept is not None:
                kept[:, part] = solved
        self.responses = kept
        return coupled

    def interface_load(self, right_side: Array) -> Array:
        """Return W^T b, (s,)."""
        if self.responses is None:
            return np.asarray(self.coupling.T @ self.solve(right_side))
        return np.asarray(self.responses.T @ right_side)

    def inner_response(self, interface: Array) -> Array:
        """Return W x_s for several x_s, (s, r) -> (rows, r)."""
        if self.responses is not None:
            return np.asarray(self.responses @ interface)
        touched = np.flatnonzero(np.diff(self.coupling.indptr))
        return self.solve_columns(touched, csr_matrix(self.coupling[touched] @ interface))

    def responses_at(self, rows: Indices) -> Array:
        """Return some rows of W; W is computed if it is not kept."""
        if self.responses is not None:
            return np.asarray(self.responses[rows])
        responses = np.empty((len(rows), len(self.interface)))
        for part, solved in self._solved():
            responses[:, part] = solved[rows]
        return responses

    def _solved(self) -> Iterator[tuple[slice, Array]]:
        """Yield W, some columns at a time."""
        touched = np.flatnonzero(np.diff(self.coupling.indptr))
        for begin in range(0, len(self.interface), SOLVE_BLOCK):
            part = slice(begin, begin + SOLVE_BLOCK)
            yield part, self.solve_columns(touched, csr_matrix(self.coupling[touched][:, part]))


def subdomains_of(inner: csr_matrix, coupling: csr_matrix, prefix: str) -> tuple[Indices, list[Subdomain]]:
    """Return the order of the inner unknowns of this rank, subdomain by subdomain, and the subdomains.

    Args:
        inner: A_ii of all inner unknowns of this rank, (n, n).
        coupling: A_is, (n, s).
        prefix: Prefix of PETSc's options for the factors.

    Raises:
        PETSc.Error: A factorization failed.
    """
    count, piece = connected_components(inner, directed=False)
    if count > MOST_SUBDOMAINS:
        piece = np.zeros_like(piece)
    order = np.argsort(piece, kind="stable")
    ends = np.cumsum(np.bincount(piece))
    subdomains = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        members = order[begin:end]
        border = csr_matrix(coupling[members])
        interface = np.unique(border.indices)
        factor = _factored(csr_matrix(inner[members][:, members]), prefix)
        rows = slice(int(begin), int(end))
        subdomains.append(Subdomain(rows, interface, csr_matrix(border[:, interface]), factor))
    return order, subdomains


def _factored(matrix: csr_matrix, prefix: str) -> Factor:
    pattern = matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data
    inner = PETSc.Mat().createAIJ(matrix.shape, csr=pattern, comm=PETSc.COMM_SELF)
    inner.setOption(PETSc.Mat.Option.SPD, True)
    return PetscFactor.of(inner, prefix)


def _as_interface(rows: Indices) -> Interface:
    return Interface(len(rows), rows, np.arange(len(rows)))


def interface_unknowns(comm: MPI.Comm, rows: csr_matrix, starts: Indices, block: int) -> Indices:
    """Return the unknowns that separate the ranks, by number over all ranks, ascending, the same in every call.

    Args:
        comm: The ranks.
        rows: The rows of this rank of a symmetric matrix, (n, N).
        starts: First row of each rank and the number of all, (ranks + 1,).
        block: Unknowns per node, which are kept together.

    Collective.
    """
    first, end = starts[comm.rank : comm.rank + 2]
    owner = np.repeat(np.arange(comm.size), np.diff(starts))
    # edges to higher ranks only: the lower ranks report the others
    later = np.flatnonzero(rows.indices >= end)
    here = np.searchsorted(rows.indptr, later, side="right") - 1 + first
    edges = np.unique(np.column_stack([here, rows.indices[later]]).astype(np.int64) // block, axis=0)
    parts = comm.gather(edges)

    def cover() -> Indices:
        assert parts is not None
        chosen = np.zeros(int(starts[-1]) // block, dtype=bool)
        whole = np.concatenate(parts)
        ranks = owner[whole * block]
        for pair in np.unique(ranks, axis=0):
            between = whole[np.all(ranks == pair, axis=1)]
            chosen[smallest_cover(between[~np.any(chosen[between], axis=1)])] = True
        return np.flatnonzero(chosen)

    nodes = on_rank_zero(comm, cover)
    return np.asarray((nodes[:, None] * block + np.arange(block)).reshape(-1))


def smallest_cover(edges: NDArray[np.int64]) -> Indices:
    """Return the fewest vertices that touch all edges, (edges, 2), between vertices of two kinds."""
    left, one = np.unique(edges[:, 0], return_inverse=True)
    right, other = np.unique(edges[:, 1], return_inverse=True)
    graph = csr_matrix((np.ones(len(edges)), (one, other)), (len(left), len(right)))
    matched = maximum_bipartite_matching(graph, perm_type="row")  # of each right vertex, or -1
    free = np.setdiff1d(np.arange(len(left)), matched)
    # König: alternating paths from unmatched left vertices, to the right by any edge, to the left by matched edges.
    pairs, root = np.flatnonzero(matched >= 0), len(left) + len(right)
    paths = np.concatenate(
        [
            np.column_stack([np.full(len(free), root), free]),
            np.column_stack([one, len(left) + other]),
            np.column_stack([len(left) + pairs, matched[pairs]]),
        ]
    )
    directed = csr_matrix((np.ones(len(paths)), (paths[:, 0], paths[:, 1])), (root + 1, root + 1))
    reached = np.zeros(root + 1, dtype=bool)
    reached[breadth_first_order(directed, root, return_predecessors=False)] = True
    return np.concatenate([left[~reached[: len(left)]], right[reached[len(left) : root]]])
