"""Compiled update of a Chebyshev sweep at each node, in one pass over memory."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from gapbeam.solver.jit import allocating_entry
from gapbeam.solver.system.operators import Array

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
