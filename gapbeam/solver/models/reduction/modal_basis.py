"""Basis in its own modal coordinates, V^T M V = 1 and V^T K V = diag(s), from Ritz vectors of given directions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.system.operators import Array, Operators

ROUND_OFF = 1.0e-16  # of the largest eigenvalue: below, eigenvalues are round-off alone


def unit_directions(energy: Array, independent: tuple[float, float]) -> Array:
    """Return C with C^T E C = 1, (k, r), of the energies E = V^T A V of vectors V, (k, k).

    Vectors are brought to one length first; those of no length, and directions lost in round-off, are left out.

    Args:
        energy: E.
        independent: Limits on eigenvalues of unit vectors, relative to the largest: those below the first number
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


AT_ONCE = 64  # columns whose products with M and K are held
INDEPENDENT = (1.0e-14, 1.0e-10)  # of the largest eigenvalue of a Gram matrix of unit vectors: see `first_kept`


@dataclass(frozen=True)
class Basis:
    """Columns of V on the DOFs of this rank, (n, r), and s, (r,), 1/s^2, ascending."""

    columns: Array
    squares: Array

    def kept(self, which: NDArray[np.bool_]) -> Basis:
        """Return the basis with some of its columns."""
        return Basis(np.asfortranarray(self.columns[:, which]), self.squares[which])

    def project(self, operators: Operators, x: Array) -> Array:
        """Return V^T x, (r,) or (r, k). Collective."""
        return operators.sum(np.ascontiguousarray(self.columns.T @ x))

    def respond(self, operators: Operators, shift: float) -> Callable[[Array], Array]:
        """Return the static responses of K + sigma M in the basis to forces, (n, k). Collective when called."""
        return lambda forces: self.columns @ (self.project(operators, forces) / (self.squares + shift)[:, None])


def modal_basis(operators: Operators, vectors: Array, shift: float) -> Basis:
    """Return a basis of the span of vectors.

    They are made orthonormal with respect to A = K + sigma M first, whose eigenvalues against M, 1 / (s + sigma), give
    the low frequencies, which matter, to full accuracy. Directions that are lost in round-off are left out, and squares
    of rigid motions that round-off made negative are 0.

    Vectors that contact forces give are nearly sums of each other, and all hold large rigid motions, which cancel in
    their small differences. M is therefore projected on the orthonormal vectors, not combined from its projection on
    those that are given: the highest frequencies would be round-off.

    Args:
        operators: M and K.
        vectors: (n, k).
        shift: sigma > 0, 1/s^2.

    Collective.
    """
    (energy,) = _energies(operators, vectors, shift, False)
    vectors = vectors @ unit_directions(energy, INDEPENDENT)
    energy, inertia = _energies(operators, vectors, shift, True)
    combine = unit_directions(energy, INDEPENDENT)
    compliances, modes = np.linalg.eigh(symmetric_part(combine.T @ inertia @ combine))
    heavy = compliances > np.finfo(float).eps * compliances[-1]
    compliances, modes = compliances[heavy][::-1], modes[:, heavy][:, ::-1]
    columns = ((combine @ (modes / np.sqrt(compliances))).T @ vectors.T).T  # in the order of columns
    return Basis(columns, np.maximum(1.0 / compliances - shift, 0.0))


def _energies(operators: Operators, vectors: Array, shift: float, inertia: bool) -> Array:
    """Return V^T (K + sigma M) V and, if asked for, V^T M V, (1 or 2, k, k): some columns at a time. Collective."""
    found = np.empty((1 + inertia, vectors.shape[1], vectors.shape[1]))
    for first in range(0, vectors.shape[1], AT_ONCE):
        some = slice(first, first + AT_ONCE)
        heavy = operators.apply_mass(vectors[:, some])
        whole = operators.apply_stiffness(vectors[:, some]) + shift * heavy
        for part, images in zip(found, (whole, heavy), strict=False):
            part[:, some] = vectors.T @ images
    return operators.sum(found)
