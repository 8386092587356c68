"""Ritz vectors: directions of unit energy in the span of given vectors."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.system.operators import Array

ROUND_OFF = 1.0e-16  # of the largest eigenvalue: below, eigenvalues are round-off alone


def unit_directions(energy: Array, independent: tuple[float, float]) -> Array:
    """Return C with C^T E C = 1, (k, r), of the energies E = V^T A V of vectors V, (k, k).

    Vectors are brought to one length first; those of no length, and directions lost in round-off, are left out.

    Args:
        energy: E.
        independent: Of the eigenvalues of vectors of one length, relative to the largest: those below the first number
            are left out, those above the second are kept, and in between the widest gap decides.
    """
    lengths = np.sqrt(np.diagonal(energy))
    scale = np.where(lengths > 0.0, 1.0, 0.0) / np.where(lengths > 0.0, lengths, 1.0)
    lengths, directions = np.linalg.eigh(symmetric_part(energy * np.outer(scale, scale)))
    kept = np.arange(len(lengths)) >= first_kept(lengths, independent)
    return np.asarray(scale[:, None] * directions[:, kept] / np.sqrt(lengths[kept]))


def first_kept(eigenvalues: Array, independent: tuple[float, float]) -> int:
    """Return the number of eigenvalues, ascending, that are left out: up to the widest gap in a range.

    A vector that is nearly a sum of others has an eigenvalue anywhere in the range; round-off moves it a little, and a
    fixed limit nearby would keep it on one machine and not on another.

    Args:
        eigenvalues: (k,).
        independent: As in `unit_directions`.
    """
    least, most = independent
    if not eigenvalues[-1] > 0.0:
        return len(eigenvalues)
    shares = np.maximum(eigenvalues / eigenvalues[-1], ROUND_OFF)
    below = np.concatenate([[ROUND_OFF], shares[:-1]])  # of each that may be the first one kept
    may_be = np.flatnonzero((below <= most) & (shares > least))
    return int(may_be[np.argmax(shares[may_be] / below[may_be])])


def symmetric_part(matrix: Array) -> Array:
    """Return the symmetric part of a matrix."""
    return np.asarray(0.5 * (matrix + matrix.T))
