"""Preconditioned conjugate gradients for several right sides at once: matrix and preconditioner are read once for all.

Source: Hestenes and Stiefel (1952), J. Res. Natl. Bur. Stand. 49, 409.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gapbeam.solver.system.operators import Array

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
    """Solve A X = B; each column of B has its own iteration.

    A column has converged when sqrt(r^T P r) of its residual r, with the preconditioner P, is below `relative` times
    that of its right side, or below `least`. As P ~ A^-1, this is about the error in the energy norm.

    Args:
        multiply: A, (n, k) -> (n, k), symmetric positive definite.
        precondition: P, likewise.
        dots: x_j^T y_j over all ranks, (n, k), (n, k) -> (k,).
        right_sides: B, (n, k).
        start: A guess at X, (n, k), or None.
        relative: Relative tolerance.
        least: Absolute tolerance.
        most: Largest number of iterations.

    Returns:
        X, the sum of the iterations of all columns, and whether all columns converged.

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
