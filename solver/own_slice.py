"""A slice of a body that one rank solves for alone, between unknowns that part it from other slices.

    W = A_ii^-1 A_is,    i those of the slice, s those that it is coupled with

A rank may have several: in the support and outside of it. Each has a factor of its own, so that what touches one of
them alone, contact or what parts it from its neighbors, is not looked for in the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from solver.operators import Array, Factor, Indices, Interface
from solver.petsc_factor import SOLVE_BLOCK, PetscFactor

MOST_SLICES = 8  # with a factor each: more are fragments, which share one


@dataclass
class OwnSlice:
    """Some unknowns of a rank, and what solves for them.

    Attributes:
        rows: Which of those that do not part ranks.
        near: The unknowns s that they are coupled with.
        coupling: A_is, (rows, near).
        factor: That of A_ii.
        responses: W, (rows, near); None where it is not kept.
    """

    rows: slice
    near: Indices
    coupling: csr_matrix
    factor: Factor
    responses: Array | None = field(default=None, init=False)

    @property
    def bytes(self) -> float:
        """What W takes."""
        return float(8 * self.coupling.shape[0] * len(self.near))

    def solve(self, right_side: Array) -> Array:
        """Return A_ii^-1 b, (rows,)."""
        return self.factor.solve(right_side)

    def solve_columns(self, rows: Indices, columns: csr_matrix) -> Array:
        """Return A_ii^-1 of columns that are zero but in some rows, (rows, r), column-major."""
        return self.factor.solve_columns(_interface(rows), columns)

    def interface_block(self, rows: Indices) -> Array:
        """Return the entries of A_ii^-1 in some rows and columns, (r, r)."""
        block = self.factor.interface_block(_interface(rows))
        assert block is not None
        return block

    def respond(self, keep: bool) -> Array:
        """Return A_si W, (near, near); keep W if asked."""
        coupled = np.empty((len(self.near), len(self.near)))
        kept = np.empty((self.coupling.shape[0], len(self.near)), order="F") if keep else None
        for part, solved in self._solved():
            coupled[:, part] = self.coupling.T @ solved
            if kept is not None:
                kept[:, part] = solved
        self.responses = kept
        return coupled

    def pull(self, right_side: Array) -> Array:
        """Return W^T b, (near,)."""
        if self.responses is None:
            return np.asarray(self.coupling.T @ self.solve(right_side))
        return np.asarray(self.responses.T @ right_side)

    def push(self, between: Array) -> Array:
        """Return W x_s for several x_s, (near, r) -> (rows, r)."""
        if self.responses is not None:
            return np.asarray(self.responses @ between)
        touched = np.flatnonzero(np.diff(self.coupling.indptr))
        return self.solve_columns(touched, csr_matrix(self.coupling[touched] @ between))

    def responses_at(self, rows: Indices) -> Array:
        """Return some rows of W, which are solved for where they are not kept."""
        if self.responses is not None:
            return np.asarray(self.responses[rows])
        responses = np.empty((len(rows), len(self.near)))
        for part, solved in self._solved():
            responses[:, part] = solved[rows]
        return responses

    def _solved(self) -> Iterator[tuple[slice, Array]]:
        """Yield W, some columns at a time."""
        touched = np.flatnonzero(np.diff(self.coupling.indptr))
        for begin in range(0, len(self.near), SOLVE_BLOCK):
            part = slice(begin, begin + SOLVE_BLOCK)
            yield part, self.solve_columns(touched, csr_matrix(self.coupling[touched][:, part]))


def own_slices(inner: csr_matrix, coupling: csr_matrix, prefix: str) -> tuple[Indices, list[OwnSlice]]:
    """Return the order in which the unknowns of a rank make up its slices, and these.

    Args:
        inner: A_ii of all of them, (n, n).
        coupling: A_is, (n, s).
        prefix: Of PETSc's options for the factors.

    Raises:
        PETSc.Error: A factorization failed.
    """
    count, piece = connected_components(inner, directed=False)
    if count > MOST_SLICES:
        piece = np.zeros_like(piece)
    order = np.argsort(piece, kind="stable")
    ends = np.cumsum(np.bincount(piece))
    slices = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        members = order[begin:end]
        border = csr_matrix(coupling[members])
        near = np.unique(border.indices)
        factor = _factored(csr_matrix(inner[members][:, members]), prefix)
        slices.append(OwnSlice(slice(int(begin), int(end)), near, csr_matrix(border[:, near]), factor))
    return order, slices


def _factored(matrix: csr_matrix, prefix: str) -> Factor:
    pattern = matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data
    inner = PETSc.Mat().createAIJ(matrix.shape, csr=pattern, comm=PETSc.COMM_SELF)
    inner.setOption(PETSc.Mat.Option.SPD, True)
    return PetscFactor.of(inner, prefix)


def _interface(rows: Indices) -> Interface:
    return Interface(len(rows), rows, np.arange(len(rows)))
