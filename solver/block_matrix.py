"""Distributed sparse matrices in blocks, one for each pair of nodes, that multiply several columns at once.

A matrix is then read from memory once for all of them, which is most of what a product costs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from dolfinx import common, la
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from solver.compiled.block_product import block_product
from solver.operators import Array, Indices

AT_ONCE = 16  # columns
WORTHWHILE = 5  # columns, below which they are multiplied one by one


@dataclass(frozen=True)
class BlockMatrix:
    """The rows of this rank of a matrix in blocks.

    Attributes:
        starts: Where the blocks of each node begin, (nodes + 1,).
        columns: The nodes that they stand for, numbered by `nodes`.
        values: The blocks, (blocks, b, b).
        nodes: Which nodes this rank multiplies with: its own, then those of others.

    Collective to use.
    """

    starts: Indices
    columns: Indices
    values: Array
    nodes: common.IndexMap

    @classmethod
    def of(cls, matrix: PETSc.Mat, size: int) -> BlockMatrix:
        """Return a matrix in rows, whose layouts are those of nodes, in blocks of a size; it is taken over. Collective.

        Args:
            matrix: The matrix.
            size: b.
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
        owners = np.searchsorted(ends, others, side="right").astype(np.int32)
        nodes = common.IndexMap(comm, len(own), others.astype(np.int64), owners)
        return cls(blocks.indptr, numbers.astype(np.int32), blocks.data, nodes)

    @property
    def diagonal(self) -> Array:
        """The blocks of this rank's own nodes with themselves, (nodes, b, b)."""
        rows = np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))
        here = self.columns == rows
        result = np.zeros((len(self.starts) - 1, self.size, self.size))
        result[rows[here]] = self.values[here]
        return result

    @classmethod
    def of_blocks(cls, blocks: Array) -> BlockMatrix:
        """Return the matrix that has blocks (nodes, b, b) on its diagonal and nothing else."""
        numbers = np.arange(len(blocks) + 1, dtype=np.int32)
        return cls(numbers, numbers[:-1], blocks, common.IndexMap(MPI.COMM_SELF, len(blocks)))

    @property
    def size(self) -> int:
        """Size b of a block."""
        return int(self.values.shape[1])

    @property
    def rows(self) -> int:
        """Rows of this rank."""
        return self.size * (len(self.starts) - 1)

    def __call__(self, x: Array) -> Array:
        """Return the images, (rows, k), of columns, (n, k). Collective."""
        result = np.empty((self.rows, x.shape[1]))
        if x.shape[1] < WORTHWHILE:
            for column in range(x.shape[1]):
                image = np.empty((self.rows, 1))
                self._multiply(x[:, column : column + 1], image)
                result[:, column] = image[:, 0]
            return result
        for first in range(0, x.shape[1], AT_ONCE):
            part = x[:, first : first + AT_ONCE]
            count = part.shape[1]
            block, images = (part, result) if x.shape[1] == AT_ONCE else self._full(part)
            self._multiply(block, images)
            if images is not result:
                result[:, first : first + count] = images[:, :count]
        return result

    def _full(self, part: Array) -> tuple[Array, Array]:
        block = np.zeros((len(part), AT_ONCE))
        block[:, : part.shape[1]] = part
        return block, np.empty((self.rows, AT_ONCE))

    def _multiply(self, x: Array, images: Array) -> None:
        count = x.shape[1]
        x = np.ascontiguousarray(x)
        if self.nodes.size_global > self.nodes.size_local:
            ghosted = self._ghosted_one if count == 1 else self._ghosted
            ghosted.array[: x.size] = x.reshape(-1)
            ghosted.scatter_forward()
            x = ghosted.array.reshape(-1, count)
        block_product(self.size, count)(self.starts, self.columns, self.values, x, images)

    @cached_property
    def _ghosted_one(self) -> la.Vector:
        return la.vector(self.nodes, self.size)

    @cached_property
    def _ghosted(self) -> la.Vector:
        return la.vector(self.nodes, self.size * AT_ONCE)
