"""The forces and moments with which the joints of a case hold its model.

A spring and damper, and the stiff spring that holds a motion of a full model, pull by -k b u - c b v, b the row of the
motion. Where the model has no unknown for a held motion, its force is the residual of the equation along that motion
(`models.reduction.holds`), with the acceleration that the equation of the other motions has at the same instant:

    a = M^-1 (f + H^T (w p) - C v - K u),    lambda = M_Z a + C_Z v + K_Z u - f_Z - H_Z^T (w p)

What is attached to the body, its damping and the loads on masses come from the same assembly for both.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.assembled_system import assembled_system, hold_stiffness, model_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.places import patterned
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.expansion import HoldingShapes
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Reactions
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem


def reactions_of(case: Case, body: Body, system: SemiDiscreteSystem) -> Reactions | None:
    """Return the reactions of all joints, motion by motion of the model, 0 for motions that are free; None: no joints.

    Args:
        case: The case.
        body: Its body.
        system: Its system.
    """
    if not case.joint:
        return None
    motions = model_motions(case)
    parts: dict[str, list[Array]] = {name: [] for name in ("displacement", "velocity", "loads", "pressure", "friction")}
    dimension = body.meshed.space.mesh.geometry.dim
    held = None if body.holding is None else _held(case, body, body.holding, system, dimension)
    nothing = Reactions(*(np.zeros(length) for length in _lengths(system)))
    rows, taken = iter(body.patterns[len(patterned(case.load)) :]), 0
    for joint in case.joint:
        found = {one.motion.name: one for one in joint.attached()}
        for name in motions:
            one = found.get(name)
            row = nothing
            if one is not None and one.held and held is not None:
                row, taken = held[taken], taken + 1
                next(rows)
            elif one is not None:
                spring, damper = one.attachment.stiffness, one.attachment.damping
                if one.held:
                    spring = hold_stiffness(case, one)
                    damper = system.stiffness_damping * spring
                pattern = next(rows)
                row = Reactions(-spring * pattern, -damper * pattern, nothing.loads, nothing.pressure, nothing.friction)
            for part, values in parts.items():
                values.append(getattr(row, part))
    found_rows = {part: np.array(values) for part, values in parts.items()}
    if not isinstance(system.operators, DenseOperators):
        sparse = {part: csr_matrix(found_rows[part]) for part in ("displacement", "velocity")}
        return Reactions(**(found_rows | sparse))
    return Reactions(**found_rows)


def _lengths(system: SemiDiscreteSystem) -> tuple[int, ...]:
    contact, size = system.contact, system.operators.size
    return size, size, len(system.loads), contact.size, contact.friction_resultants.shape[1]


def _held(
    case: Case, body: Body, holding: HoldingShapes, system: SemiDiscreteSystem, dimension: int
) -> list[Reactions]:
    """Return the rows of what joints hold, one after the other."""
    operators, beam, contact = system.operators, body.operators, system.contact
    assert isinstance(operators, DenseOperators)
    assert isinstance(beam, DenseOperators)
    size, count = operators.size, len(holding.mass)
    damping = case.damping.model_copy(update={"ratio": None})
    whole = assembled_system(
        case.model_copy(update={"damping": damping}),
        DenseOperators(_bordered(beam.mass, holding.mass), _bordered(beam.stiffness, holding.stiffness)),
        contact,
        [np.concatenate(pair) for pair in zip(body.patterns, holding.patterns.T, strict=True)],
        dimension,
        (system.mass_damping, system.stiffness_damping),
    )
    assert isinstance(whole.operators, DenseOperators)
    inertia = np.linalg.solve(whole.operators.mass[:size, :size], whole.operators.mass[:size, size:]).T

    def residual(rows: Array) -> Array:
        return np.asarray(rows[size:] - inertia @ rows[:size])

    stiffness = residual(whole.operators.stiffness[:, :size])
    damper = system.stiffness_damping * stiffness  # what is proportional to M, such as modal damping, leaves nothing
    if whole.dashpots is not None:
        damper = damper + residual(whole.dashpots.matrix[:, :size])
    loads = np.array([load.pattern for load in whole.loads]).reshape(len(whole.loads), size + count).T
    here = inertia[:, contact.interface.owned]
    pressed, rubbed = (
        np.asarray(matrix[contact.interface.slots].T @ here.T).T
        for matrix in (contact.resultants, contact.friction_resultants)
    )
    parts = (
        stiffness,
        damper,
        -residual(loads),
        pressed - holding.pressure,
        rubbed - holding.friction,
    )
    return [Reactions(*rows) for rows in zip(*parts, strict=True)]


def _bordered(matrix: Array, rows: Array) -> Array:
    """Return a symmetric matrix (n, n) with further rows and columns; where these meet, ones that nothing asks for."""
    return np.block([[matrix, rows.T], [rows, np.identity(len(rows))]])
