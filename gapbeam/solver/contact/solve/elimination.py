"""Equations of any matrix, compiled: Gaussian elimination with row pivots."""

from __future__ import annotations

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.system.operators import Array


@compiled
def eliminate(matrix: Array, right: Array, size: int) -> bool:
    """Solve equations of any matrix in place; tell whether that can be.

    Args:
        matrix: Its first rows and columns, overwritten.
        right: Right side, then the solution.
        size: Number of rows and columns.
    """
    for row in range(size):
        _pivot(matrix, right, row, size)
        upper = matrix[row]
        pivot = upper[row]
        if not abs(pivot) > 0.0:
            return False
        for below in range(row + 1, size):
            lower = matrix[below]
            share = lower[row] / pivot
            if share != 0.0:
                for column in range(row + 1, size):
                    lower[column] -= share * upper[column]
                right[below] -= share * right[row]
    for row in range(size - 1, -1, -1):
        total = right[row]
        for column in range(row + 1, size):
            total -= matrix[row, column] * right[column]
        right[row] = total / matrix[row, row]
    return True


@compiled
def _pivot(matrix: Array, right: Array, row: int, size: int) -> None:
    """Swap a row with the one below it that has the largest entry in its column."""
    best = row
    for below in range(row + 1, size):
        if abs(matrix[below, row]) > abs(matrix[best, row]):
            best = below
    if best != row:
        for column in range(row, size):
            matrix[row, column], matrix[best, column] = matrix[best, column], matrix[row, column]
        right[row], right[best] = right[best], right[row]
