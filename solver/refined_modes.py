"""Vibration modes brought to round-off, from the lowest frequency to the highest.

A step takes shapes X that nearly solve  K X = M X diag(s),  X^T M X = 1,  to X (1 + E), with

    R = 1 - X^T M X,    S = X^T K X,    s_j = S_jj / (1 - R_jj),
    E_ij = (S_ij + s_j R_ij) / (s_j - s_i),    E_jj = R_jj / 2,

and E_ij = R_ij / 2 for frequencies that are equal but for round-off. It converges quadratically.

Source: Ogita and Aishima (2018), Japan J. Indust. Appl. Math. 35, 1007, algorithm 1, here for a pair of matrices.
"""

from __future__ import annotations

import numpy as np

from solver.operators import Array

STEPS = 2
EQUAL = 1.0e-8  # of the sum of two squares of frequencies: below it their shapes mix freely
SAFETY = 10.0  # times the round-off of X^T K X: modes that differ by less, such as rigid motions, are equal


def refined_modes(mass: Array, stiffness: Array, shapes: Array, scale: float) -> tuple[Array, Array]:
    """Return squares of the angular frequencies, (n,), 1/s^2, and shapes X with X^T M X = 1, (n, n).

    Args:
        mass: M, (n, n), kg.
        stiffness: K, (n, n), N/m.
        shapes: X to begin with, (n, n), normed.
        scale: Square of the lowest elastic angular frequency, 1/s^2: rigid motions lie far below it.
    """
    for _ in range(STEPS):
        defect = np.identity(len(mass)) - shapes.T @ mass @ shapes
        projected = shapes.T @ stiffness @ shapes
        squares = np.diagonal(projected) / (1.0 - np.diagonal(defect))
        apart = squares[None, :] - squares[:, None]
        sizes = np.abs(squares)[None, :] + np.abs(squares)[:, None]
        noise = np.finfo(float).eps * (np.abs(shapes).T @ np.abs(stiffness) @ np.abs(shapes))
        equal = np.abs(apart) <= EQUAL * (sizes + EQUAL * scale) + SAFETY * noise
        change = (projected + squares[None, :] * defect) / np.where(equal, 1.0, apart)
        shapes = shapes + shapes @ np.where(equal, 0.5 * defect, change)
    projected = shapes.T @ stiffness @ shapes
    return np.diagonal(projected).copy(), shapes
