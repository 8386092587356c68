"""The coordinates in which large structures rest: rigid motions, and static responses to all that may act on them.

At rest q = R a + K^+ (f + B^T F), whatever the contact forces F are. The basis of R, K^+ f and K^+ B^T therefore holds
the equilibrium of all DOFs exactly; K^+ g answers g less what accelerates the structure as a whole (inertia relief),

    P g = g - M R (R^T M R)^-1 R^T g,     K^+ = (1 - R (R^T M R)^-1 R^T M) K_s^-1 P,

with the shifted K_s = K + s M factored once and the shift taken out by iteration. A held structure has no R, and s = 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as sl

from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.structure import LARGE, Structure
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

RIGID = 1e-13  # of the largest ratio of stiffness to mass: squares below belong to rigid motions
FIRST_GUESS = 1e-9  # of the mean ratio
SHIFT = 1e-3  # of the first elastic square
MOST_RIGID = 6
ROUND_OFF = 1e-13
PASSES = 30


class Statics(NamedTuple):
    """A scene in the coordinates of its seat: q = columns @ y.

    Attributes:
        columns: (n, m), M-orthonormal; None: the coordinates of the scene themselves, its modes.
        squares: K in these coordinates, diagonal, (m,).
    """

    columns: Array | None
    squares: Array

    def rows(self, rows: Array) -> Array:
        """Return rows of the scene's coordinates, or patterns of forces in them, (k, n), in those of the seat."""
        return rows if self.columns is None else rows @ self.columns

    def whole(self, y: Array) -> Array:
        """Return the scene's coordinates, (n,)."""
        return y if self.columns is None else self.columns @ y


def statics_of(scene: Scene) -> Statics:
    """Return the coordinates in which a scene rests.

    Raises:
        RunError: The first modes of a large structure did not converge.
    """
    if not scene.is_large:
        return Statics(None, scene.squares)
    places = [place for one in scene.feedbacks for place in (one.sense, one.act)]
    acting = np.vstack([scene.contact_rows, scene.rows(places), scene.load_columns.T])
    parts = []
    for one, i, j in zip(scene.structures, scene.start, scene.start[1:], strict=False):
        own = acting[:, i:j]
        parts.append(_of_structure(one, own[np.abs(own).max(axis=1) > 0.0].T))
    columns = sl.block_diag(*(columns for columns, _ in parts))
    return Statics(columns, np.concatenate([squares for _, squares in parts]))


def _of_structure(structure: Structure, forces: Array) -> tuple[Array, Array]:
    """Return an M-orthonormal basis of rigid motions and static responses, and the squares of its frequencies."""
    if structure.size <= LARGE:
        return structure.modes[2], structure.modes[0]
    operators = SparseOperators(structure.M, structure.K)
    ratios = operators.stiffness.diagonal() / operators.mass.diagonal()
    near = FIRST_GUESS * float(ratios.mean())
    squares, shapes = operators.lowest_modes(near, MOST_RIGID + 1, operators.factor(near, 1.0))
    still = squares <= RIGID * float(ratios.max())
    R = shapes[:, still] if structure.rigid is None else structure.rigid
    first = float(squares[~still].min()) if not still.all() else near
    shift = SHIFT * first if R.shape[1] else 0.0
    factor = operators.factor(shift, 1.0)
    MR = operators.apply_mass(R)
    gram = np.linalg.inv(R.T @ MR) if R.shape[1] else np.zeros((0, 0))
    right = forces - MR @ (gram @ (R.T @ forces))
    answers, rest, size = np.zeros_like(right), right, np.abs(right).max(axis=0, initial=0.0)
    for _ in range(PASSES):
        answers += factor.solve(rest)
        answers -= R @ (gram @ (MR.T @ answers))
        before, rest = np.abs(rest).max(initial=0.0), right - operators.apply_stiffness(answers)
        rest -= MR @ (gram @ (R.T @ rest))
        left = np.abs(rest).max(axis=0, initial=0.0)
        if np.all(left <= ROUND_OFF * size) or np.abs(rest).max(initial=0.0) > 0.5 * before:
            break
    basis = modal_basis(operators, np.column_stack([R, answers]), SHIFT * first)
    return basis.columns, basis.squares
