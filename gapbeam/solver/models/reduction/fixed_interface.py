"""The vectors of Craig and Bampton (1968): modes with fixed interface DOFs, and constraint modes.

A constraint mode is the static response of the interior to a motion of the interface DOFs, K_ii x_i = -K_ib x_b. Where
only some shapes of pressure are kept, the motions are those of the interface DOFs that follow these shapes best.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from gapbeam.solver.case.model_table import ReducedModel
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.reduction.vibration_modes import Modes, lowest_modes
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

HELD = 1.0e-10  # of the mass matrix of the faces, for interface DOFs that hardly any point sees


def fixed_interface_vectors(
    operators: PetscOperators,
    contact: ContactOperator,
    free: Modes,
    shapes: Array | None,
    settings: ReducedModel,
    shift: float,
) -> tuple[Array, float]:
    """Return rigid motions, fixed-interface modes and constraint modes, (n, k), and `Modes.left` of these modes.

    Args:
        operators: M and K.
        contact: The contact points.
        free: Modes with free faces, of which the motions of the rigid body are taken.
        shapes: Shapes on the faces, (m, shapes); None: every interface DOF.
        settings: How many modes.
        shift: sigma, 1/s^2.

    Collective.
    """
    mass, stiffness = operators.matrices()
    interface = contact.interface
    first = stiffness.getOwnershipRange()[0]
    rows = (interface.owned + first).astype(PETSc.IntType)
    largest = float(stiffness.getDiagonal().max()[1])
    stiffness.zeroRowsColumns(rows, diag=largest)
    least = float(mass.getDiagonal().min()[1])
    # the frequency of the rows of fixed DOFs lies above all others
    mass.zeroRowsColumns(rows, diag=least)
    shifted = operators.shifted_solver(mass, stiffness.copy(), shift, operators.solver.basis_tolerance)
    modes = lowest_modes(mass, stiffness, shifted, shift, settings.modes, settings.frequency)
    motions = np.identity(interface.size) if shapes is None else _fitted(contact, shapes)
    # constraint modes nearly cancel where they make up a motion of the whole body
    interior = operators.solver_of(stiffness, "gapbeam_interior_", operators.solver.tolerance)
    constraints = np.empty((operators.size, motions.shape[1]), order="F")
    for number, motion in enumerate(motions.T):
        moved = np.zeros(operators.size)
        interface.add(moved, motion)
        pull = -operators.apply_stiffness(moved)
        pull[interface.owned] = 0.0
        constraints[:, number] = interior.solve(pull) + moved
    rigid = free.shapes[:, free.squares < shift]
    elastic = modes.shapes[:, : settings.modes] if settings.frequency is None else modes.shapes
    return np.concatenate([rigid, elastic, constraints], axis=1), modes.left


def _fitted(contact: ContactOperator, shapes: Array) -> Array:
    """Return the motions of the interface DOFs whose gaps are nearest to shapes, (interface.size, shapes)."""
    gap, weights = contact.gap_matrix, contact.weights[:, None]
    gram = (gap.T @ gap.multiply(weights)).toarray()
    gram[np.diag_indices_from(gram)] += HELD * gram.diagonal().max()
    return np.asarray(np.linalg.solve(gram, gap.T @ (weights * shapes)))
