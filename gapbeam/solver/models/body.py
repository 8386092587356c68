"""Body: the part of a model that depends on mesh, material and positions only, set up once for a sweep over the rest.

Clearance, contact law, damping, amplitudes, frequencies and the march in time are added by `models.model`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import basix.ufl
import numpy as np
from dolfinx import fem
from mpi4py import MPI
from scipy.sparse import csr_matrix

from gapbeam.meshes.cell_curvature import refuse_curved
from gapbeam.meshes.tagged_mesh import Section, TaggedMesh, describe, mean_section
from gapbeam.solver.assembly.assembled_system import holding_springs
from gapbeam.solver.assembly.case_mesh import mesh_of_case
from gapbeam.solver.assembly.contact_assembly import contact_operator, nitsche_operator
from gapbeam.solver.assembly.elasticity import elastic_parts, lame
from gapbeam.solver.assembly.face_quadrature import PointRule
from gapbeam.solver.assembly.load_patterns import load_patterns
from gapbeam.solver.assembly.mass_redistribution import extrapolation
from gapbeam.solver.assembly.nitsche_terms import Nitsche
from gapbeam.solver.assembly.section_rows import SectionRows, row_at
from gapbeam.solver.case.beam_motions import axial_restraint, lateral_restraint
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.periodic_checks import factor_needed
from gapbeam.solver.case.computed_defaults import Default, contact_patch
from gapbeam.solver.case.model_choice import whole_areas
from gapbeam.solver.case.solution_tables import FullModel, RigidModel
from gapbeam.solver.contact.formulations.contact_points import resultant_operator, whole_contact
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.linear_algebra.solver_choice import LinearSolver, linear_solver
from gapbeam.solver.loads.load_choice import axis_point
from gapbeam.solver.memory.memory_estimate import free_memory, memory_needs
from gapbeam.solver.models.bending_stiffness import BendingStiffness, bending_stiffness, rigid_motions
from gapbeam.solver.models.expansion import HoldingShapes, ProductExpansion
from gapbeam.solver.models.reduction.basis_report import BasisReport
from gapbeam.solver.system.operators import Array, Indices, Operators, Springs
from gapbeam.solver.system.semi_discrete import ContactOperator


class ProbeRow(Protocol):
    """Evaluation of the motion of one point."""

    def evaluate(self, x: Array, operators: Operators) -> Array:
        """Return the vector field at the point, (components,), or row by row of x, (times, components). Collective."""


@dataclass(frozen=True)
class MeshedBeam:
    """A mesh, the space of displacements on it, and its contact faces.

    Attributes:
        tagged: Mesh and its faces.
        space: Vector Lagrange space of the displacement.
        faces: Local facets of each contact face, by its name.
        width: Factor of all integrals: the width in 2D, 1 in 3D, m.
        facet_length: Mean length h of the contact facets along the beam, m.
        section: The cross-section that the cells fill, on average along the beam.
        seconds: Wall time of meshing.
    """

    tagged: TaggedMesh
    space: fem.FunctionSpace
    faces: Mapping[str, Indices]
    width: float
    facet_length: float
    section: Section
    seconds: float


TURNED = " rotation"
"""Ending of the names of rows of rotations, behind the name of the probe, which has no space."""


@dataclass(frozen=True)
class Body:
    """A meshed and assembled case, without what is cheap to change.

    Attributes:
        case: The case that it was assembled for.
        meshed: Mesh, space and faces.
        operators: M and K.
        contact: G, H, w and g0 with the clearance of that case.
        patterns: Forces of each load per unit factor, (n,), N, and after them the rows of `attached_motions`.
        probes: Rows of the probes, by name, and of their rotations, NAME and TURNED.
        rigid: M times the six `gapbeam.solver.case.analysis_table.unit_motions`, (6, n), N s^2 of each; 0 of those that
            the model has not.
        gamma: Nitsche's parameter at each point, (m,), Pa/m; None for other formulations.
        patch: Size of the patches of `contact.points` with its reason; None without.
        expansion: From the DOFs marched to those of the mesh that this rank owns; None: they are the same.
        basis: Size and error of the reduced basis; None for other models.
        holding: What gives the forces of joints that hold motions the basis has not; None: there are none.
        bending: Accuracy of the bending stiffness of a mesh.
        seconds: Wall time of each part of the set-up.
    """

    case: Case
    meshed: MeshedBeam
    operators: Operators
    contact: ContactOperator
    patterns: tuple[Array, ...]
    probes: Mapping[str, ProbeRow]
    rigid: Array
    gamma: Array | None = None
    patch: Default | None = None
    expansion: Array | csr_matrix | ProductExpansion | None = None
    basis: BasisReport | None = None
    holding: HoldingShapes | None = None
    bending: BendingStiffness = field(default_factory=BendingStiffness)
    seconds: dict[str, float] = field(default_factory=dict)


def point_rule(case: Case) -> PointRule:
    """Return the rule for contact points: quadrature points (by default of degree 2 degree + 2), or nodes.

    Constraints need at most as many points as the DOFs that they constrain; a pressure that follows a law does not.
    """
    if case.contact.formulation.holds_points:
        return PointRule(case.mesh.degree, nodal=True)
    return PointRule(case.contact.quadrature_degree or 2 * case.mesh.degree + 2)


def mesh_beam(case: Case, comm: MPI.Comm) -> MeshedBeam:
    """Mesh a case and put a vector Lagrange space on it.

    Raises:
        MeshError: A user's mesh does not fit the case, or the degree does not fit curved cells.

    Collective.
    """
    started = time.perf_counter()
    tagged = mesh_of_case(case, comm)
    mesh = tagged.mesh
    refuse_curved(mesh, case.mesh.degree)
    dimension = mesh.geometry.dim
    element = basix.ufl.element("Lagrange", mesh.basix_cell(), case.mesh.degree, shape=(dimension,))
    width = case.beam.width if dimension == 2 else 1.0
    return MeshedBeam(
        tagged,
        fem.functionspace(mesh, element),
        {face.name: tagged.facets_of(face.name) for face in case.layout.faces},
        width,
        describe(tagged)["mean_contact_facet_length"],
        mean_section(tagged, width),
        time.perf_counter() - started,
    )


def mesh_dofs(meshed: MeshedBeam) -> int:
    """Return the number of degrees of freedom of a mesh over all ranks."""
    dofmap = meshed.space.dofmap
    return int(dofmap.index_map.size_global * dofmap.index_map_bs)


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
    bends = not isinstance(case.model, RigidModel)
    bending = bending_stiffness(case, space, operators, rigid) if bends else BendingStiffness()
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
    needed = factor_needed(case.model, case.contact, case.time, case.analysis)
    needs = memory_needs(mesh_dofs(meshed), case.mesh.dimension)
    free = free_memory(meshed.tagged.mesh.comm)
    return linear_solver(case.solver, needs, free, None if needed is None else needed[1])


def gathered(case: Case, contact: ContactOperator) -> tuple[ContactOperator, Default | None]:
    """Return the operator of `contact.points` with the size of their patches, or of whole supports; or the same."""
    if case.contact.points is None:
        return whole_contact(contact, whole_areas(case)), None
    patch = contact_patch(case)
    return resultant_operator(contact, case.contact.points, patch.value), patch


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
    return replace(contact, frictionless=case.contact.rubs is None), None, None
