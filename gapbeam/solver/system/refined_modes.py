"""Iterative refinement of vibration modes down to round-off.

A step takes shapes X that nearly solve  K X = M X diag(s),  X^T M X = 1,  to X (1 + E), with

    R = 1 - X^T M X,    S = X^T K X,    s_j = S_jj / (1 - R_jj),
    E_ij = (S_ij + s_j R_ij) / (s_j - s_i),    E_jj = R_jj / 2,

and E_ij = R_ij / 2 for frequencies that are equal to round-off. It converges quadratically, down to what
cancels in K X: much where K is that of elements, little where its rows are scaled as in a reduced basis.

Source: Ogita and Aishima (2018), Japan J. Indust. Appl. Math. 35, 1007, algorithm 1, here for a pair of matrices.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array

MOST_STEPS = 4
EQUAL = 1.0e-8  # of the sum of two squares of frequencies: below it their shapes mix freely
ROUND_OFF = 16.0 * float(np.finfo(float).eps)  # of what cancels in a square


def refined_modes(mass: Array, stiffness: Array, shapes: Array) -> tuple[Array, Array]:
    """Return squares of the angular frequencies, (n,), 1/s^2, and shapes X with X^T M X = 1, (n, n).

    Args:
        mass: M, (n, n), kg.
        stiffness: K, (n, n), N/m.
        shapes: X to begin with, (n, n), normed; it is returned where no step makes it better.
    """
    sizes = np.abs(stiffness)
    best, least = shapes, np.inf
    for _ in range(MOST_STEPS + 1):
        defect = np.identity(len(mass)) - shapes.T @ mass @ shapes
        missed = float(np.max(np.abs(defect)))
        if not missed < 0.5 * least:
            break
        best, least = shapes, missed
        projected = shapes.T @ stiffness @ shapes
        squares = np.diagonal(projected) / (1.0 - np.diagonal(defect))
        lost = ROUND_OFF * np.sum(np.abs(shapes) * (sizes @ np.abs(shapes)), axis=0)
        unresolved = EQUAL * np.abs(squares) + lost
        apart = squares[None, :] - squares[:, None]
        equal = np.abs(apart) <= unresolved[None, :] + unresolved[:, None]
        change = (projected + squares[None, :] * defect) / np.where(equal, 1.0, apart)
        shapes = shapes + shapes @ np.where(equal, 0.5 * defect, change)
    return np.einsum("ij,ik,kj->j", best, stiffness, best, optimize=True), best
