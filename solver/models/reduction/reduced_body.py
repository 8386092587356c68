"""From an assembled body to a reduced one.

    u = V q,    V^T M V = 1,    V^T K V = diag(s)

V spans the vibration modes of the body, its deflections under unit loads and those under pressures on the contact
faces. With free contact faces the latter are A^-1 G^T p, A = K + sigma M: what the modes miss of the static response,
the residual flexibility (Rubin 1975); with fixed ones they are the static response to motions of the interface DOFs,
the constraint modes (Craig and Bampton 1968). Rigid motions are always in V: the body floats.
"""

from __future__ import annotations

import time
from dataclasses import replace
from math import pi

import numpy as np
from scipy.sparse import csr_matrix, identity

from gapbeam.solver.assembly.attached_motions import acting_rows
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_table import ReducedModel
from gapbeam.solver.case.symmetry import is_symmetric
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.basis_report import BasisReport
from gapbeam.solver.models.reduction.contact_lines import within_reach
from gapbeam.solver.models.reduction.face_shapes import face_shapes
from gapbeam.solver.models.reduction.fixed_interface import fixed_interface_vectors
from gapbeam.solver.models.reduction.held_motions import held
from gapbeam.solver.models.reduction.holds import FloatingBody
from gapbeam.solver.models.reduction.line_points import REACH, gathered_points
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.models.reduction.projection import Kept, moved, projected
from gapbeam.solver.models.reduction.truncation_check import neglected_shares, random_pressures
from gapbeam.solver.models.reduction.vibration_modes import Modes, lowest_modes
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

RIGID_MODES = {2: 3, 3: 6}
CHECKED = 8  # random pressures of the truncation check


def reduced_body(body: Body, settings: ReducedModel) -> Body:
    """Reduce a finite element body.

    Raises:
        RunError: The modes could not be found.

    Collective.
    """
    started = time.perf_counter()
    case, operators, contact = body.case, body.operators, body.contact
    assert isinstance(operators, PetscOperators)
    symmetric = is_symmetric(case)
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    count = RIGID_MODES[case.mesh.dimension] + settings.modes
    factor = operators.shifted_factor(shift)
    modes = lowest_modes(*operators.products(), factor, shift, count, settings.frequency)
    touching = within_reach(contact, REACH * case.profile.thinnest)
    shapes = _pressures(case, contact, settings, symmetric, touching)
    acting = acting_rows(case, body.patterns)
    loads = np.stack([modes.factor.solve(row) for row in acting], axis=1) if acting else None
    vectors, left = _vectors(operators, contact, modes, shapes, settings, shift)
    floating = modal_basis(operators, np.concatenate([vectors, *([] if loads is None else [loads])], axis=1), shift)
    basis = held(body, floating, shift)
    fewer = gathered_points(case, contact, symmetric, settings.points_across, body.meshed.facet_length)
    kept: Kept = np.ones(len(basis.squares), dtype=bool)
    if symmetric:
        kept = moved(body, fewer, basis)
    smooth = random_pressures(contact, CHECKED, face_shapes(contact, 2 * settings.shapes - 1, (0,), touching))
    local = np.where(touching[:, None], random_pressures(contact, CHECKED), 0.0)
    neglected = neglected_shares(operators, contact, modes.factor, floating, shift, [local, smooth])
    report = BasisReport(
        modes=len(modes.squares),
        highest_mode=float(modes.frequencies.max(initial=0.0)),
        contact_shapes=contact.interface.size if shapes is None else shapes.shape[1],
        load_shapes=len(acting),
        size=int(np.sum(kept)),
        left_out=int(np.sum(~kept)),
        highest=float(np.sqrt(basis.squares[kept].max()) / (2.0 * pi)),
        neglected=neglected[0],
        neglected_smooth=neglected[1],
        modes_left=left,
    )
    basis = basis.kept(kept)
    return replace(
        projected(body, fewer, basis),
        basis=report,
        holding=FloatingBody(body, floating, shift).holding_shapes(fewer, basis),
        seconds=body.seconds | {"reduction": time.perf_counter() - started},
    )


def _pressures(
    case: Case, contact: ContactOperator, settings: ReducedModel, symmetric: bool, touching: Kept
) -> Array | None:
    """Return the pressures whose shapes are kept, (m, shapes); None: one for each interface DOF."""
    if settings.contact == "all":
        return None
    if case.contact.points is not None:
        return np.asarray(np.identity(contact.size))
    powers = (0,) if case.mesh.dimension == 2 else (0, 2) if symmetric else (0, 1, 2)
    return face_shapes(contact, settings.shapes, powers, touching)


def _vectors(
    operators: PetscOperators,
    contact: ContactOperator,
    modes: Modes,
    shapes: Array | None,
    settings: ReducedModel,
    shift: float,
) -> tuple[Array, float]:
    """Return modes and contact shapes, (n, k), and the largest `Modes.left`. Collective."""
    if settings.interface == "fixed":
        vectors, left = fixed_interface_vectors(operators, contact, modes, shapes, settings, shift)
        return vectors, max(modes.left, left)
    interface = contact.interface
    if shapes is None:
        columns = csr_matrix(identity(interface.size))
    else:
        columns = csr_matrix(contact.resultants @ (contact.weights[:, None] * shapes))
    return np.concatenate([modes.shapes, modes.factor.solve_columns(interface, columns)], axis=1), modes.left
