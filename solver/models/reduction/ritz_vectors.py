"""Ritz vectors: directions of unit energy in the span of given vectors."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array


def unit_directions(energy: Array, independent: float) -> Array:
    """Return C with C^T E C = 1, (k, r), of the energies E = V^T A V of vectors V, (k, k).

    Vectors are brought to one length first; those of no length, and directions lost in round-off, are left out.

    Args:
        energy: E.
        independent: Least eigenvalue that counts, of the largest one of vectors of one length.
    """
    lengths = np.sqrt(np.diagonal(energy))
    scale = np.where(lengths > 0.0, 1.0, 0.0) / np.where(lengths > 0.0, lengths, 1.0)
    lengths, directions = np.linalg.eigh(symmetric_part(energy * np.outer(scale, scale)))
    kept = lengths > independent * lengths[-1]
    return np.asarray(scale[:, None] * directions[:, kept] / np.sqrt(lengths[kept]))


def symmetric_part(matrix: Array) -> Array:
    """Return the symmetric part of a matrix."""
    return np.asarray(0.5 * (matrix + matrix.T))
