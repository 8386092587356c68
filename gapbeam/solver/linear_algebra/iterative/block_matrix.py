"""Distributed block sparse matrices (BSR, a block per pair of nodes) with products for several columns at once.

Y = A X,    X (n, k): the matrix is read from memory once for all k columns, which is most of the cost of a product.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from dolfinx import common, la
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from gapbeam.meshes.versions.index_maps import index_map
from gapbeam.solver.linear_algebra.iterative.block_product import block_product
from gapbeam.solver.system.operators import Array, Indices

AT_ONCE = 16  # columns
WORTHWHILE = 5  # columns, below which they are multiplied one by one


@dataclass(frozen=True)
class BlockMatrix:
    """The rows of this rank of a block sparse matrix.

    Attributes:
        starts: First block of each row of blocks, (nodes + 1,).
        columns: Column of each block, as a local number of `nodes`.
        values: The blocks, (blocks, b, b), in the precision that products are computed in.
        nodes: Owned nodes, then ghosts.

    Collective to use.
    """

    starts: Indices
    columns: Indices
    values: Array
    nodes: common.IndexMap

    @classmethod
    def of(cls, matrix: PETSc.Mat, size: int) -> BlockMatrix:
        """Return a matrix in rows (AIJ) as blocks. Collective.

        Args:
            matrix: The matrix, with all rows of a node on one rank; it is destroyed.
            size: Size b of a block.
        """
        comm = matrix.comm.tompi4py()
        own = range(*(column // size for column in matrix.getOwnershipRangeColumn()))
        starts, columns, values = matrix.getValuesCSR()
        shape = len(starts) - 1, matrix.getSize()[1]
        matrix.destroy()
        rows = csr_matrix((values, columns, starts), shape)
        del starts, columns, values
        blocks = rows.tobsr((size, size))
        ends = comm.allgather(own.stop)
        mine = (blocks.indices >= own.start) & (blocks.indices < own.stop)
        others = np.unique(blocks.indices[~mine])
        numbers = np.where(mine, blocks.indices - own.start, len(own) + np.searchsorted(others, blocks.indices))
        owners = np.searchsorted(ends, others, side="right")
        nodes = index_map(comm, len(own), others, owners)
        return cls(blocks.indptr, numbers.astype(np.int32), blocks.data, nodes)

    @property
    def diagonal(self) -> Array:
        """The diagonal blocks of the owned nodes, (nodes, b, b)."""
        rows = np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))
        here = self.columns == rows
        result = np.zeros((len(self.starts) - 1, self.size, self.size))
        result[rows[here]] = self.values[here]
        return result

    def single(self) -> BlockMatrix:
        """Return the matrix in single precision, which takes half the memory traffic."""
        return replace(self, values=self.values.astype(np.float32))

    @property
    def size(self) -> int:
        """Size b of a block."""
        return int(self.values.shape[1])

    @property
    def rows(self) -> int:
        """Rows of this rank."""
        return self.size * (len(self.starts) - 1)

    def __call__(self, x: Array) -> Array:
        """Return the images, (rows, k), of columns, (n, k), in the precision of the matrix. Collective."""
        result = np.empty((self.rows, x.shape[1]), self.values.dtype)
        for part in pieces(x.shape[1]):
            block = in_full(x[:, part], self.values.dtype)
            images = result if block.shape == x.shape else np.empty((self.rows, block.shape[1]), self.values.dtype)
            product = block_product(self.size, block.shape[1])
            product(self.starts, self.columns, self.values, self.with_others(block), images)
            if images is not result:
                result[:, part] = images[:, : part.stop - part.start]
        return result

    def with_others(self, x: Array) -> Array:
        """Return columns, (n, k), with the rows of the ghost nodes below. Collective.

        Args:
            x: Contiguous and in the precision of the matrix; 1 or `AT_ONCE` columns.
        """
        if self.nodes.size_global == self.nodes.size_local:
            return x
        ghosted = self._ghosted_one if x.shape[1] == 1 else self._ghosted
        ghosted.array[: x.size] = x.reshape(-1)
        ghosted.scatter_forward()
        return np.asarray(ghosted.array.reshape(-1, x.shape[1]))

    @cached_property
    def _ghosted_one(self) -> la.Vector:
        return la.vector(self.nodes, self.size, self.values.dtype.type)

    @cached_property
    def _ghosted(self) -> la.Vector:
        return la.vector(self.nodes, self.size * AT_ONCE, self.values.dtype.type)


def pieces(count: int) -> list[slice]:
    """Return the slices in which `count` columns are multiplied: `AT_ONCE` each, or one by one if they are few."""
    step = 1 if count < WORTHWHILE else AT_ONCE
    return [slice(first, min(first + step, count)) for first in range(0, count, step)]


def in_full(x: Array, precision: np.dtype[np.floating]) -> Array:
    """Return columns of a piece, contiguous and in a precision: one, or `AT_ONCE` with columns of zeros at the end."""
    if x.shape[1] in (1, AT_ONCE):
        return np.ascontiguousarray(x, precision)
    block = np.zeros((len(x), AT_ONCE), precision)
    block[:, : x.shape[1]] = x
    return block
