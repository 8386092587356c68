"""Products of a sparse block matrix with several columns, and Chebyshev sweeps, each in one pass over memory."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from gapbeam.solver.jit import allocating, allocating_entry
from gapbeam.solver.system.operators import Array, Indices

Product = Callable[[Indices, Indices, Array, Array, Array], None]
TakenAway = Callable[[Indices, Indices, Array, Array, Array, Array, float, bool], None]


@cache
def block_product(size: int, count: int) -> Product:
    """Return y <- A x for blocks of a size, 2 or 3, and a number of columns, which the compiler unrolls.

    Its arguments: where the blocks of each row begin, (rows + 1,); their columns; their values, (blocks, size, size);
    x, (n size, count); y, (rows size, count).
    """
    two = size == 2

    def product(starts: Indices, columns: Indices, values: Array, x: Array, y: Array) -> None:
        total = np.zeros((size, count), values.dtype)
        for row in range(len(starts) - 1):
            _sum_row(two, starts[row], starts[row + 1], columns, values, x, total, count)
            for i in range(size):
                for column in range(count):
                    y[size * row + i, column] = total[i, column]

    return allocating_entry(product)


@cache
def block_residual(size: int, count: int) -> TakenAway:
    """Return r <- r - A x and, if wanted, missing <- missing - beta A x; see `block_product`.

    Its arguments: as there, with r, missing, beta and whether missing is wanted instead of y.
    """
    two = size == 2

    def taken_away(
        starts: Indices, columns: Indices, values: Array, x: Array, r: Array, missing: Array, beta: float, both: bool
    ) -> None:
        total = np.zeros((size, count), values.dtype)
        for row in range(len(starts) - 1):
            _sum_row(two, starts[row], starts[row + 1], columns, values, x, total, count)
            for i in range(size):
                for column in range(count):
                    r[size * row + i, column] -= total[i, column]
                    if both:
                        missing[size * row + i, column] -= beta * total[i, column]

    return allocating_entry(taken_away)


# The entries of a block are named one by one: as an array they would be read again for each column, since the compiler
# cannot know that they are not what is written. At the level of the module, as what is compiled for a process would
# else be kept for that one only.


@allocating
def _row_of_two(begin: int, end: int, columns: Indices, values: Array, x: Array, total: Array, count: int) -> None:
    for at in range(begin, end):
        place, first = np.uint64(at), np.uint64(2 * columns[at])
        x0, x1 = x[first], x[first + np.uint64(1)]
        a00, a01 = values[place, 0, 0], values[place, 0, 1]
        a10, a11 = values[place, 1, 0], values[place, 1, 1]
        for c in range(count):
            total[0, c] += a00 * x0[c] + a01 * x1[c]
            total[1, c] += a10 * x0[c] + a11 * x1[c]


@allocating
def _row_of_three(begin: int, end: int, columns: Indices, values: Array, x: Array, total: Array, count: int) -> None:
    for at in range(begin, end):
        place, first = np.uint64(at), np.uint64(3 * columns[at])
        x0, x1, x2 = x[first], x[first + np.uint64(1)], x[first + np.uint64(2)]
        a00, a01, a02 = values[place, 0, 0], values[place, 0, 1], values[place, 0, 2]
        a10, a11, a12 = values[place, 1, 0], values[place, 1, 1], values[place, 1, 2]
        a20, a21, a22 = values[place, 2, 0], values[place, 2, 1], values[place, 2, 2]
        for c in range(count):
            u, v, w = x0[c], x1[c], x2[c]
            total[0, c] += a00 * u + a01 * v + a02 * w
            total[1, c] += a10 * u + a11 * v + a12 * w
            total[2, c] += a20 * u + a21 * v + a22 * w


@allocating
def _sum_row(
    two: bool, begin: int, end: int, columns: Indices, values: Array, x: Array, total: Array, count: int
) -> None:
    total[:, :] = 0
    if two:
        _row_of_two(begin, end, columns, values, x, total, count)
    else:
        _row_of_three(begin, end, columns, values, x, total, count)


Relaxed = Callable[[Array, Array, Array, Array, float, float, float], None]


@cache
def relax(size: int, count: int) -> Relaxed:
    """Return z <- kept z + taken D^-1 r, x <- x + beta z for blocks of a size and a number of columns.

    Its arguments: the blocks of D^-1, (nodes, size, size); r, z and x, (nodes size, count); kept; taken; beta.
    """

    def relaxed(inverse: Array, r: Array, z: Array, x: Array, kept: float, taken: float, beta: float) -> None:
        for node in range(len(inverse)):
            first = size * node
            for i in range(size):
                for column in range(count):
                    value = kept * z[first + i, column]
                    for j in range(size):
                        value += taken * inverse[node, i, j] * r[first + j, column]
                    z[first + i, column] = value
                    x[first + i, column] += beta * value

    return allocating_entry(relaxed)
