"""Products of many rows with a matrix in blocks of one size, so that bits do not depend on the number of rows.

BLAS adds up in an order that follows from the number of rows. Records are made of blocks whose length follows from the
clock; a run that is resumed has others. So rows are multiplied in blocks of one size, the last one filled up.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array

ROWS = 64


def row_product(rows: Array, matrix: Array) -> Array:
    """Return x A of rows x, (times, n), and a matrix A, (n, k): (times, k), each row the same bits in any company."""
    result = np.empty((len(rows), matrix.shape[1]))
    block = np.zeros((ROWS, rows.shape[1]))
    for first in range(0, len(rows), ROWS):
        taken = rows[first : first + ROWS]
        block[: len(taken)] = taken
        result[first : first + len(taken)] = (block @ matrix)[: len(taken)]
    return result
