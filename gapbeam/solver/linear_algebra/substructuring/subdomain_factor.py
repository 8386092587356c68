"""A subdomain: inner unknowns i of one rank, coupled to others by interface unknowns s only, with a factor of A_ii.

    W = A_ii^-1 A_is,    A_si W: what the subdomain takes off the Schur complement

A rank may have several subdomains, in the support and outside of it. Each has its own factor, so that right sides which
touch one subdomain alone, such as contact forces or its interface, do not pass through the factors of the others.

Source: Przemieniecki (1963), AIAA J. 1, 138: substructures.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from petsc4py import PETSc
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from gapbeam.solver.linear_algebra.mumps_factor import SOLVE_BLOCK, PetscFactor
from gapbeam.solver.system.operators import Array, Factor, Indices, Interface

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

    @property
    def bytes(self) -> float:
        """Memory of W."""
        return float(8 * self.coupling.shape[0] * len(self.interface))

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
