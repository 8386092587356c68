"""Products of a sparse matrix in square blocks with several columns at once: it is read once for all of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from solver.compiled.jit import entry
from solver.operators import Array, Indices

Product = Callable[[Indices, Indices, Array, Array, Array], None]


@cache
def block_product(size: int, count: int) -> Product:
    """Return the product for blocks of a size and a number of columns, both of which the compiler unrolls.

    Its arguments: where the blocks of each row begin, (rows + 1,); their columns; their values (blocks, size, size);
    what is multiplied, (columns size, count); the product, (rows size, count), overwritten.
    """

    def product(starts: Indices, columns: Indices, values: Array, x: Array, y: Array) -> None:
        total = np.zeros((size, count))
        for row in range(len(starts) - 1):
            total[:, :] = 0.0
            for place in range(starts[row], starts[row + 1]):
                first = size * columns[place]
                for column in range(count):
                    for i in range(size):
                        value = total[i, column]
                        for j in range(size):
                            value += values[place, i, j] * x[first + j, column]
                        total[i, column] = value
            for i in range(size):
                for column in range(count):
                    y[size * row + i, column] = total[i, column]

    return entry(product)
