"""A rigid body on the contact faces of its mesh, as in multibody programs.

    u = V q,    V^T M V = 1,    V^T K_restraint V = diag(s)

V are the three rigid motions in 2D, the six in 3D. Contact, loads and probes are those of the mesh. Of a solid that
moves symmetrically those motions stay which loads or contact can cause: heave and pitch.
"""

from __future__ import annotations

import time
from dataclasses import replace
from math import pi

import numpy as np
from scipy.linalg import eigh

from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.symmetry import is_symmetric
from gapbeam.solver.linear_algebra.rigid_body_modes import rigid_body_modes
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.held_motions import held
from gapbeam.solver.models.reduction.holds import FloatingBody
from gapbeam.solver.models.reduction.line_points import gathered_points
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.models.reduction.projection import moved, projected


def rigid_body(body: Body) -> Body:
    """Return a finite element body as a rigid one. Collective."""
    started = time.perf_counter()
    case, operators = body.case, body.operators
    motions = rigid_body_modes(body.meshed.space)
    images = [(operators.apply_mass(motion), operators.apply_restraint(motion)) for motion in motions.T]
    mass, restraint = operators.sum(np.stack([[motions.T @ image for image in pair] for pair in images], axis=-1))
    squares, turn = eigh(0.5 * (restraint + restraint.T), 0.5 * (mass + mass.T))
    floating = Basis(np.asfortranarray(motions @ turn), np.maximum(squares, 0.0))
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    basis = held(body, floating, shift)
    symmetric = is_symmetric(case)
    contact = gathered_points(case, body.contact, symmetric, 1, body.meshed.facet_length)
    if symmetric:
        basis = basis.kept(moved(body, contact, basis))
    seconds = body.seconds | {"reduction": time.perf_counter() - started}
    holding = FloatingBody(body, floating, shift).holding_shapes(contact, basis)
    return replace(projected(body, contact, basis), holding=holding, seconds=seconds)
