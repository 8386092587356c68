"""From a case to the system that is marched."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import basix.ufl
import ufl
from dolfinx import fem
from mpi4py import MPI

from meshes.describe import describe
from meshes.tagged import TaggedMesh
from solver.case import Case
from solver.case_tables.contact import AugmentedLagrangian, NitscheMethod, Unilateral
from solver.case_tables.time import MoreauJean
from solver.contact.choice import make_law
from solver.contact.law import ContactLaw
from solver.contact_scales import contact_duration
from solver.defaults import Default, contact_stiffness, rayleigh, seat_springs, touch_depth
from solver.elasticity import elastic_forms, lame
from solver.face_points import PointRule
from solver.interface import contact_operator, nitsche_operator
from solver.loads.patterns import axis_point, make_loads
from solver.mesh_of_case import mesh_of_case
from solver.nitsche import Nitsche
from solver.petsc_operators import PetscOperators
from solver.points import PointRow, point_row
from solver.system import Array, ContactOperator, Indices, SemiDiscreteSystem, Springs
from solver.time_step import with_time_step


@dataclass(frozen=True)
class Model:
    """A case, meshed and assembled.

    Attributes:
        case: The case, its time step a number.
        tagged: Mesh and its faces.
        space: Vector Lagrange space of the displacement.
        system: The semi-discrete system.
        law: The contact law.
        probes: Rows that evaluate the probes, by name.
        defaults: Values that were computed, with their reasons.
        seat_springs: s of the search for the seat, Pa/m.
        facet_length: Mean length h of the contact facets along the beam, m.
        seconds: Wall time of each part of the set-up.
    """

    case: Case
    tagged: TaggedMesh
    space: fem.FunctionSpace
    system: SemiDiscreteSystem
    law: ContactLaw
    probes: dict[str, PointRow]
    defaults: tuple[Default, ...]
    seat_springs: float
    facet_length: float
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom over all ranks."""
        return int(self.space.dofmap.index_map.size_global * self.space.dofmap.index_map_bs)

    @property
    def step(self) -> float:
        """Time step, s."""
        assert self.case.time.step != "auto"
        return self.case.time.step

    @property
    def contact_duration(self) -> float:
        """Duration of an impact on the contact stiffness, at least, s."""
        return contact_duration(self.case, self.law.stiffness)

    @property
    def point_rule(self) -> PointRule:
        """Where the contact points of a facet lie."""
        return point_rule(self.case)


def point_rule(case: Case) -> PointRule:
    """Return where contact points lie: quadrature of the degree given or 2 degree + 2, or the nodes.

    Constraints need points that are not more than the DOFs they constrain; pressures that follow a law do not.
    """
    if isinstance(case.contact.formulation, Unilateral | AugmentedLagrangian):
        return PointRule(case.mesh.degree, nodal=True)
    return PointRule(case.contact.quadrature_degree or 2 * case.mesh.degree + 2)


def build_model(case: Case, comm: MPI.Comm) -> Model:
    """Mesh and assemble a case.

    Raises:
        MeshError: A user's mesh does not fit the case.
        UserError: A point lies outside the mesh.
        CaseError: The computed time step does not go with the rest of the case.

    Collective.
    """
    started = time.perf_counter()
    tagged = mesh_of_case(case, comm)
    meshed = time.perf_counter()
    mesh = tagged.mesh
    dimension = mesh.geometry.dim
    width = case.beam.width if dimension == 2 else 1.0
    element = basix.ufl.element("Lagrange", mesh.basix_cell(), case.mesh.degree, shape=(dimension,))
    space = fem.functionspace(mesh, element)
    faces = {name: tagged.facets_of(name) for name in ("base", "gland")}
    facet_length = describe(tagged)["mean_contact_facet_length"]
    contact, chosen, gamma, correction = _contact(case, space, faces, width, facet_length)
    case, computed = with_time_step(case, chosen.value)
    area = float(contact.weights.sum())
    measure = ufl.Measure("ds", domain=mesh, subdomain_data=tagged.facets)
    forms = elastic_forms(
        space,
        case.material,
        case.mesh.plane == "stress",
        width,
        (case.restraint.axial / area, case.restraint.lateral / area),
        measure((tagged.groups["base"], tagged.groups["gland"])),
    )
    operators = PetscOperators(forms, space, correction)
    law = make_law(case.contact, chosen.value if gamma is None else gamma, touch_depth(case))
    if isinstance(case.time.scheme, MoreauJean):
        law = replace(law, stores_energy=False)
    mass_damping, stiffness_damping = rayleigh(case)
    system = SemiDiscreteSystem(operators, contact, make_loads(case, space, operators), mass_damping, stiffness_damping)
    probes = {probe.name: point_row(space, axis_point(probe.point), f"[[probe]] {probe.name}") for probe in case.probe}
    return Model(
        case,
        tagged,
        space,
        system,
        law,
        probes,
        (chosen, *computed),
        seat_springs(case, chosen.value, facet_length, area),
        facet_length,
        {"mesh": meshed - started, "assembly": time.perf_counter() - meshed},
    )


def _contact(
    case: Case, space: fem.FunctionSpace, faces: Mapping[str, Indices], width: float, facet_length: float
) -> tuple[ContactOperator, Default, Array | None, Springs | None]:
    """Return operator, stiffness with its reason, gamma at each point and correction of K (both for Nitsche only)."""
    clearance, rule, formulation = case.support.clearance, point_rule(case), case.contact.formulation
    if not isinstance(formulation, NitscheMethod):
        operator = contact_operator(space, faces, clearance, width, rule)
        return operator, contact_stiffness(case, facet_length), None, None
    plane_stress = case.mesh.plane == "stress" and space.mesh.geometry.dim == 2
    settings = Nitsche(formulation.theta, formulation.factor, lame(case.material, plane_stress), width)
    nitsche = nitsche_operator(space, faces, clearance, width, rule, settings)
    reason = f"{formulation.factor:g} times the largest eigenvalue of the trace problem of the contact cells"
    consequence = "half: at the edge of stability for theta = 1; double: stiffer contact, the same answer to O(h)"
    chosen = Default("Nitsche's gamma", float(nitsche.gamma.max()), "Pa/m", reason, consequence)
    return nitsche.operator, chosen, nitsche.gamma, nitsche.correction
