"""Body of finite elements: a meshed case, assembled by DOLFINx and PETSc."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from gapbeam.solver.assembly.assembled_system import holding_springs
from gapbeam.solver.assembly.contact_assembly import Nitsche, contact_operator, nitsche_operator
from gapbeam.solver.assembly.elasticity import elastic_parts, lame
from gapbeam.solver.assembly.mass_redistribution import extrapolation
from gapbeam.solver.assembly.section_rows import SectionRows, load_patterns, row_at
from gapbeam.solver.case.beam_motions import axial_restraint, lateral_restraint
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.periodic_checks import factor_needed
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.solver.linear_algebra.petsc_operators import LinearSolver, PetscOperators, linear_solver
from gapbeam.solver.loads.load_choice import axis_point
from gapbeam.solver.memory.memory_estimate import free_memory, memory_needs
from gapbeam.solver.models.bending_stiffness import bending_stiffness, rigid_motions
from gapbeam.solver.models.body import TURNED, Body, MeshedBeam, gathered, mesh_dofs, point_rule
from gapbeam.solver.system.operators import Array, Springs
from gapbeam.solver.system.semi_discrete import ContactOperator


def finite_elements(case: Case, meshed: MeshedBeam) -> Body:
    """Assemble a meshed case.

    Raises:
        UserError: A point lies outside the mesh, or a patch of contact.points between its quadrature points.

    Collective.
    """
    started = time.perf_counter()
    space, width = meshed.space, meshed.width
    explicit = case.time.scheme.explicit
    contact, gamma, correction = _contact(case, meshed)
    area = contact.support.area
    parts = elastic_parts(
        space,
        case.profile,
        case.mesh.plane == "stress",
        width,
        (axial_restraint(case).value / area, 0.0 if case.layout.holes else lateral_restraint(case).value / area),
        np.concatenate(list(meshed.faces.values())),
    )
    moved = None
    if case.contact.mass == "redistributed":
        moved = extrapolation(space, np.concatenate(list(meshed.faces.values())), explicit)
    marched = isinstance(case.model, FullModel) and not explicit
    operators = PetscOperators(parts, space, correction, explicit, moved, _solver(case, meshed), marched)
    contact, patch = gathered(case, contact)
    sections = SectionRows(space)
    patterns = load_patterns(case, sections, operators)
    rigid = np.stack([operators.apply_mass(motion) for motion in rigid_motions(space)])
    bending = bending_stiffness(case, space, operators, rigid)
    if isinstance(case.model, FullModel):
        operators.hold(*(holding_springs(case, patterns, restraining=restrains) for restrains in (False, True)))
    body = Body(
        case,
        meshed,
        operators,
        contact,
        patterns,
        {probe.name: row_at(sections, probe.point, f"[[probe]] {probe.name}") for probe in case.probe}
        | {
            f"{probe.name}{TURNED}": sections.of_turn(float(axis_point(probe.point)[0]), f"[[probe]] {probe.name}")
            for probe in case.probe
            if probe.rotation
        },
        rigid,
        gamma,
        patch,
        bending=bending,
    )
    return replace(body, seconds={"mesh": meshed.seconds, "assembly": time.perf_counter() - started})


def _solver(case: Case, meshed: MeshedBeam) -> LinearSolver:
    """Return the solver for the effective operators of a case. Collective."""
    needed = factor_needed(case.model, case.support, case.contact, case.time, case.analysis)
    needs = memory_needs(mesh_dofs(meshed), case.mesh.dimension)
    free = free_memory(meshed.tagged.mesh.comm)
    return linear_solver(case.solver, needs, free, None if needed is None else needed[1])


def _contact(case: Case, meshed: MeshedBeam) -> tuple[ContactOperator, Array | None, Springs | None]:
    """Return the operator of the formulation; of Nitsche's method also gamma and the correction of K. Collective."""
    supported, rule, terms = case.layout.faces, point_rule(case), case.contact.formulation.stress_terms
    space, faces, width = meshed.space, meshed.faces, meshed.width
    if terms is not None:
        plane_stress = case.mesh.plane == "stress" and space.mesh.geometry.dim == 2
        material = case.profile.supported(case.layout)[0].material  # the same all along, or the case was refused
        settings = Nitsche(terms.theta, terms.factor, lame(material, plane_stress), width)
        nitsche = nitsche_operator(space, faces, supported, width, rule, settings)
        return nitsche.operator, nitsche.gamma, nitsche.correction
    contact = contact_operator(space, faces, supported, width, rule, case.follows_faces)
    return replace(contact, frictionless=case.friction is None), None, None
