"""Lowest modes of large systems by a block Lanczos method, whose solves take many right sides at once.

The space of V_1, (K + sigma M)^-1 M V_1, ... is made M-orthonormal as a whole, so that repeated frequencies and rigid
motions are found, too. Of a Ritz pair T V y = theta V y + W E^T y the residual is the part of y in the last block.
Source: Grimes, Lewis and Simon (1994), SIAM J. Matrix Anal. Appl. 15, 228.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.system.operators import Array

BLOCK = 16
CONVERGED = 1e-11
"""Residual of a shape, relative to its 1 / (s + sigma)."""
LOST = 1e-12  # of the length of a vector: what is left of it is round-off
MOST = 12  # vectors for each mode, and as many blocks beside


def lowest_modes_by_blocks(
    solve: Callable[[Array], Array], mass: Callable[[Array], Array], size: int, shift: float, count: int
) -> tuple[Array, Array]:
    """Return squares s of the lowest angular frequencies, ascending, (count,), and M-orthonormal shapes, (n, count).

    Args:
        solve: (K + sigma M)^-1 b, of several columns.
        mass: M x.
        size: n.
        shift: sigma, 1/s^2.
        count: Modes, fewer than n.

    Raises:
        RunError: They did not converge.
    """
    start = np.random.default_rng(0).standard_normal((size, min(BLOCK, size)))  # the same in every run
    V = _orthonormal(solve(mass(start)), np.zeros((size, 0)), mass)
    H: Array = np.zeros((0, 0))
    last = V
    while True:
        answers = solve(mass(last))
        new = V.T @ mass(answers)
        m, added = V.shape[1], last.shape[1]
        H = np.asarray(
            np.block([[H, new[: m - added]], [new[: m - added].T, 0.5 * (new[m - added :] + new[m - added :].T)]])
        )
        beyond = answers - V @ new
        beyond -= V @ (V.T @ mass(beyond))
        sizes, Y = np.linalg.eigh(H)
        first = slice(m - 1, m - 1 - count if m > count else None, -1)
        residuals = np.sqrt(np.einsum("ij,ij->j", beyond, mass(beyond)))
        worst = residuals.max(initial=0.0) * np.abs(Y[m - added :, first]).max(axis=0, initial=0.0)
        if m >= count and (np.all(worst <= CONVERGED * np.abs(sizes[first])) or m == size):
            return 1.0 / sizes[first] - shift, V @ Y[:, first]
        last = _orthonormal(beyond, V, mass)
        if not last.shape[1] or m > MOST * (count + BLOCK):
            raise RunError(f"the vibration modes of {size} DOFs could not be found")
        V = np.hstack([V, last])


def _orthonormal(vectors: Array, V: Array, mass: Callable[[Array], Array]) -> Array:
    """Return an M-orthonormal basis of vectors beside those of V; directions lost in round-off are left out."""
    lengths = np.sqrt(np.einsum("ij,ij->j", vectors, mass(vectors)))
    found = vectors[:, lengths > 0.0] / lengths[lengths > 0.0]
    for _ in range(2):
        found = found - V @ (V.T @ mass(found))
        squares, turn = np.linalg.eigh(found.T @ mass(found))
        kept = squares > LOST * squares.max(initial=0.0)
        found = found @ (turn[:, kept] / np.sqrt(squares[kept]))
    return np.asarray(found)
