"""Reduction of large structures to their first modes and what unit forces at their points add.

What a few modes leave out is missing at a contact: without the static response to its force the point is too stiff, by
the flexibility of all higher modes. The basis is

    Q = [phi_1 ... phi_n, (K + s M)^-1 b_j],     s = a tenth of the first elastic square of an angular frequency,

made M-orthonormal. With the shift s free structures need no inertia relief; it changes the response by s / w^2 of the
modes beyond the n-th. Source: Craig (1981), Structural Dynamics, sec. 19.5, residual attachment modes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.system.operators import Array

SHIFT = 0.1
MOST_RIGID = 6
FIRST_GUESS, ROUGH = 1e-9, 1e-3  # of the mean square; relative tolerance
DEPENDENT = 1e-10  # of the largest: singular values of the basis that are round-off


def reduced_at_points(structure: Structure, modes: int, points: Iterable[str] | None = None) -> Structure:
    """Return a structure in its first modes and the static responses to unit forces at its points.

    Args:
        structure: What is reduced; sparse matrices stay sparse.
        modes: First modes that are kept.
        points: Points whose flexibility is kept; default all.

    Raises:
        UserError: More modes are asked for than there are, or a point is unknown.
    """
    kept = list(structure.points if points is None else points)
    rows = np.vstack([np.zeros((0, structure.size)), *(structure[name].rows for name in kept)])
    if not 1 <= modes < structure.size:
        raise UserError(f"structure {structure.name or '?'}: found {modes} modes, expected 1 to {structure.size - 1}")
    M, K = sp.csc_matrix(structure.M), sp.csc_matrix(structure.K)
    shift = _shift(structure, M, K)
    factor = sla.splu(sp.csc_matrix(K + shift * M))
    inverse = sla.LinearOperator(K.shape, matvec=factor.solve)
    _, shapes = sla.eigsh(K, modes, M, sigma=-shift, OPinv=inverse, which="LM", v0=np.ones(structure.size))
    answers = [factor.solve(np.ascontiguousarray(row)) for row in rows]
    still = np.zeros((structure.size, 0)) if structure.rigid is None else structure.rigid
    Q = _orthonormal(np.column_stack([still, shapes, *answers]), M)
    size = Q.shape[1]
    carried = {name: point.rows @ Q for name, point in structure.points.items()}
    C = None if structure.C is None else Q.T @ (structure.C @ Q)
    stiffness = Q.T @ (K @ Q)
    rigid = None if structure.rigid is None else Q.T @ (M @ structure.rigid)
    inertia = None if structure.inertia is None else Q.T @ structure.inertia
    return Structure(np.eye(size), 0.5 * (stiffness + stiffness.T), C, carried, rigid, structure.name, inertia)


def _shift(structure: Structure, M: Any, K: Any) -> float:
    """Return a tenth of the first elastic square of an angular frequency, by a rough run of the eigensolver."""
    mean = float(K.diagonal().sum() / M.diagonal().sum())  # of all squares: far above the first of many
    still = MOST_RIGID if structure.rigid is None else structure.rigid.shape[1]
    count = min(still + 1, structure.size - 2)
    if count < 1:
        return SHIFT * mean
    near, ones = FIRST_GUESS * mean, np.ones(structure.size)
    inverse = sla.LinearOperator(K.shape, matvec=sla.splu(sp.csc_matrix(K + near * M)).solve)
    squares = sla.eigsh(K, count, M, sigma=-near, OPinv=inverse, return_eigenvectors=False, v0=ones, tol=ROUGH)
    elastic = squares[squares > near]
    return SHIFT * float(elastic.min() if elastic.size else mean)


def _orthonormal(columns: Array, M: Any) -> Array:
    """Return an M-orthonormal basis of the span of columns, without those that round-off makes."""
    size = np.sqrt(np.einsum("ij,ij->j", columns, M @ columns))
    scaled = columns / np.where(size > 0.0, size, 1.0)
    values, vectors = sl.eigh(scaled.T @ (M @ scaled))
    good = values > DEPENDENT * values[-1]
    Q = scaled @ (vectors[:, good] / np.sqrt(values[good]))
    rest = sl.cholesky(Q.T @ (M @ Q))  # a second pass takes the round-off of the first
    found: Array = sl.solve_triangular(rest, Q.T, trans="T").T
    return found
