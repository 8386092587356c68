"""Conjugate gradients for the columns of a block side by side: matrix and preconditioner are read once for all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solver.operators import Array

Part = Callable[[Array], Array]
Dots = Callable[[Array, Array], Array]


def conjugate_gradients(
    multiply: Part,
    precondition: Part,
    dots: Dots,
    right_sides: Array,
    start: Array | None,
    relative: float,
    least: float,
    most: int,
) -> tuple[Array, int, bool]:
    """Solve A X = B, column by column of B.

    A column is solved when its residual r has sqrt(r^T P r), P the preconditioner, below `relative` times that of the
    right side, or below `least`: the error in the energy norm, as far as P stands for A^-1.

    Args:
        multiply: A, (n, k) -> (n, k), symmetric positive definite.
        precondition: P, likewise.
        dots: x_j^T y_j over all ranks, (n, k), (n, k) -> (k,).
        right_sides: B, (n, k).
        start: A guess at X, (n, k), or None.
        relative: See above.
        least: See above.
        most: Iterations.

    Returns:
        X, the iterations of all columns together, and whether every column was solved.

    Collective.
    """
    x = np.zeros_like(right_sides) if start is None else np.array(start)
    residual = np.array(right_sides) if start is None else right_sides - multiply(x)
    weighed = precondition(residual)
    squares = dots(residual, weighed)
    sizes = squares if start is None else dots(right_sides, precondition(right_sides))
    wanted = np.maximum(relative**2 * sizes, least**2)
    left = np.flatnonzero(~(squares <= wanted))
    residual, squares = residual[:, left], squares[left]
    direction = weighed[:, left]
    iterations = 0
    for _ in range(most):
        if len(left) == 0 or not np.all(np.isfinite(squares)):
            break
        image = multiply(direction)
        lengths = squares / dots(direction, image)
        x[:, left] += lengths * direction
        residual -= lengths * image
        weighed = precondition(residual)
        former, squares = squares, dots(residual, weighed)
        iterations += len(left)
        direction = weighed + (squares / former) * direction
        unsolved = ~(squares <= wanted[left])
        if not np.all(unsolved):
            left, squares = left[unsolved], squares[unsolved]
            residual, direction = residual[:, unsolved], direction[:, unsolved]
    return x, iterations, len(left) == 0
