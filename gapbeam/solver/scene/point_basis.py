"""Reduction of large structures to their first modes and what unit forces at their points add.

What a few modes leave out is missing at a contact: without the static response to its force the point is too stiff, by
the flexibility of all higher modes. The basis is

    Q = [phi_1 ... phi_n, (K + s M)^-1 b_j],     s = a tenth of the first elastic square of an angular frequency,

made M-orthonormal. With the shift s free structures need no inertia relief; it changes the response by s / w^2 of the
modes beyond the n-th. Source: Craig (1981), Structural Dynamics, sec. 19.5, residual attachment modes.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.system.dense_operators import SparseOperators

SHIFT = 0.1
MOST_RIGID = 6
FIRST_GUESS = 1e-9  # of the mean square


@checked
def reduced_at_points(structure: Structure, modes: int, points: Iterable[str] | None = None) -> Structure:
    """Return a structure in its first modes and the static responses to unit forces at its points.

    Args:
        structure: The structure to reduce; sparse matrices stay sparse.
        modes: First modes that are kept.
        points: Points whose flexibility is kept; default all.

    Raises:
        UserError: More modes are asked for than there are, or a point is unknown.
        RunError: The modes did not converge.
    """
    kept = list(structure.points if points is None else points)
    rows = np.vstack([np.zeros((0, structure.size)), *(structure[name].rows for name in kept)])
    if not 1 <= modes < structure.size:
        raise UserError(f"structure {structure.name or '?'}: found {modes} modes, expected 1 to {structure.size - 1}")
    operators = SparseOperators(structure.M, structure.K)
    shift = _shift(structure, operators)
    factor = operators.factor(shift, 1.0)
    _, shapes = operators.lowest_modes(shift, modes, factor)
    still = np.zeros((structure.size, 0)) if structure.rigid is None else structure.rigid
    basis = modal_basis(operators, np.column_stack([still, shapes, factor.solve(rows.T)]), shift)
    Q = basis.columns
    carried = {name: point.rows @ Q for name, point in structure.points.items()}
    C = None if structure.C is None else Q.T @ (structure.C @ Q)
    rigid = None if structure.rigid is None else Q.T @ operators.apply_mass(structure.rigid)
    inertia = None if structure.inertia is None else Q.T @ structure.inertia
    stiffness = np.diag(basis.squares)
    return Structure(np.eye(len(stiffness)), stiffness, C, carried, rigid, structure.name, inertia, structure.frame)


def _shift(structure: Structure, operators: SparseOperators) -> float:
    """Return a tenth of the first elastic square of an angular frequency."""
    mean = float(operators.stiffness.diagonal().sum() / operators.mass.diagonal().sum())  # far above the first of many
    still = MOST_RIGID if structure.rigid is None else structure.rigid.shape[1]
    count = min(still + 1, structure.size - 2)
    if count < 1:
        return SHIFT * mean
    near = FIRST_GUESS * mean
    squares, _ = operators.lowest_modes(near, count, operators.factor(near, 1.0))
    elastic = squares[squares > near]
    return SHIFT * float(elastic.min() if elastic.size else mean)
