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

from gapbeam.solver.assembly.attached_motions import acting_rows
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_table import ReducedModel
from gapbeam.solver.case.symmetry import is_symmetric
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.basis_report import BasisReport
from gapbeam.solver.models.reduction.deformable_sections import DeformableSections
from gapbeam.solver.models.reduction.held_motions import held
from gapbeam.solver.models.reduction.holds import FloatingBody
from gapbeam.solver.models.reduction.kept_basis import FoundBasis, images, kept_or_found
from gapbeam.solver.models.reduction.kept_contact import KeptContact
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.models.reduction.projection import Kept, moved, projected
from gapbeam.solver.models.reduction.rigid_sections import RigidSections
from gapbeam.solver.models.reduction.vibration_modes import lowest_modes, with_rigid_motions

RIGID_MODES = {2: 3, 3: 6}


def reduced_body(body: Body, settings: ReducedModel) -> Body:
    """Reduce a finite element body.

    Raises:
        RunError: The modes could not be found.

    Collective.
    """
    started = time.perf_counter()
    case, operators = body.case, body.operators
    assert isinstance(operators, PetscOperators)
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    contact = _kept_contact(body, settings)
    acting = acting_rows(case, body.patterns)

    def find() -> FoundBasis:
        count = RIGID_MODES[case.mesh.dimension] + settings.modes
        factor = operators.shifted_factor(shift)
        modes = lowest_modes(*operators.products(), factor, shift, count, settings.frequency, operators.has_massless)
        modes = with_rigid_motions(modes, operators)
        loads = np.stack([modes.factor.solve(row) for row in acting], axis=1) if acting else None
        vectors, left = contact.vectors(operators, modes, shift)
        floating = modal_basis(operators, np.concatenate([vectors, *([] if loads is None else [loads])], axis=1), shift)
        highest = float(modes.frequencies.max(initial=0.0))
        return FoundBasis(
            floating, len(modes.squares), highest, left, contact.neglected(operators, modes, floating, shift)
        )

    points = body.contact
    solver = (operators.solver.iterative, operators.solver.basis_tolerance)
    given = (settings.model_dump_json(), case.mesh.dimension, shift, solver, operators.has_massless)
    rows = (points.gap_matrix, points.weights, points.faces, points.interface.owned, points.interface.slots)
    inputs = (*given, *rows, *acting, *contact.inputs, *images(operators))
    found = kept_or_found(body.meshed.tagged.mesh.comm, inputs, find)
    floating = found.floating
    basis = held(body, floating, shift)
    kept: Kept = np.ones(len(basis.squares), dtype=bool)
    if is_symmetric(case):
        kept = moved(body, contact.points, basis)
    report = BasisReport(
        modes=found.modes,
        highest_mode=found.highest_mode,
        contact_shapes=contact.count,
        load_shapes=len(acting),
        size=int(np.sum(kept)),
        left_out=int(np.sum(~kept)),
        highest=float(np.sqrt(basis.squares[kept].max()) / (2.0 * pi)),
        neglected=found.neglected.local,
        neglected_smooth=found.neglected.smooth,
        modes_left=found.left,
        section_flexibility=found.neglected.section,
    )
    basis = basis.kept(kept)
    return replace(
        projected(body, contact.points, basis),
        basis=report,
        holding=FloatingBody(body, floating, shift).holding_shapes(contact.points, basis),
        seconds=body.seconds | {"reduction": time.perf_counter() - started},
    )


def _kept_contact(body: Body, settings: ReducedModel) -> KeptContact:
    """Return what the basis keeps of the contact of a body. Collective."""
    if settings.rings is None:
        return DeformableSections(body, settings)
    return RigidSections.of_body(body, settings.rings)
