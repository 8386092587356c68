"""Products of many rows with a matrix in blocks of one size, so that bits do not depend on the number of rows.

BLAS adds up in an order that follows from the number of rows, and from the place of a row among them. Records are made
of blocks whose length follows from the clock; a run that is resumed has others. So rows are multiplied eight at a time,
the last ones filled up: of eight rows, kernels of OpenBLAS for AVX-512, AVX2, AVX and SSE treat each alike. Of 64 rows,
as many as here before, those for AVX-512 do not.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array

ROWS = 8
COLUMNS = 1024  # at once, so that they stay in the cache from one block of rows to the next


def row_product(rows: Array, matrix: Array) -> Array:
    """Return x A of rows x, (times, n), and a matrix A, (n, k): (times, k), each row the same bits in any company."""
    times, count = len(rows), -(-len(rows) // ROWS)
    blocks = np.zeros((count, ROWS, rows.shape[1]))
    blocks.reshape(count * ROWS, rows.shape[1])[:times] = rows
    product = np.empty((count, ROWS, matrix.shape[1]))
    for begin in range(0, matrix.shape[1], COLUMNS):
        some = slice(begin, begin + COLUMNS)
        np.matmul(blocks, matrix[:, some], out=product[..., some])
    return product.reshape(count * ROWS, matrix.shape[1])[:times]
