"""From a case to the system that is marched."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from meshes.describe import describe
from meshes.tagged import TaggedMesh
from solver.case import Case
from solver.case_tables.contact import AugmentedLagrangian, NitscheMethod, Unilateral
from solver.case_tables.time import CentralDifference, MoreauJean
from solver.contact.choice import make_law
from solver.contact.friction import CoulombFriction
from solver.contact.law import ContactLaw
from solver.contact_scales import contact_duration
from solver.defaults import (
    Default,
    contact_damping,
    contact_patch,
    contact_stiffness,
    rayleigh,
    seat_springs,
    slip_velocity,
    tangent_stiffness,
    touch_depth,
)
from solver.elasticity import elastic_forms, lame
from solver.face_points import PointRule
from solver.interface import contact_operator, nitsche_operator
from solver.loads.patterns import axis_point, make_loads
from solver.mass_redistribution import extrapolation
from solver.mesh_of_case import mesh_of_case
from solver.nitsche import Nitsche
from solver.operators import Array, Indices, Springs
from solver.petsc_operators import PetscOperators
from solver.points import PointRow, point_row
from solver.resultants import resultant_operator
from solver.stable_step import stable_step
from solver.step_limit import with_stable_step
from solver.system import ContactOperator, SemiDiscreteSystem
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
        law_stiffness: K of the contact per area of a face, also where it acts at points, Pa/m^n.
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
    law_stiffness: float
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
        return contact_duration(self.case, self.law_stiffness)

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
        UserError: A point lies outside the mesh, a patch of contact.points between its quadrature points, or an
            explicit scheme cannot march the step.
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
    setting = _contact(case, space, faces, width, facet_length)
    contact, area = setting.operator, setting.operator.area
    law_stiffness = setting.face_stiffness / (0.5 * area)
    asked, (case, computed) = case, with_time_step(case, law_stiffness)
    measure = ufl.Measure("ds", domain=mesh, subdomain_data=tagged.facets)
    forms = elastic_forms(
        space,
        case.material,
        case.mesh.plane == "stress",
        width,
        (case.restraint.axial / area, case.restraint.lateral / area),
        measure((tagged.groups["base"], tagged.groups["gland"])),
    )
    explicit = isinstance(case.time.scheme, CentralDifference)
    moved = None
    if case.contact.mass == "redistributed":
        moved = extrapolation(space, np.concatenate(list(faces.values())), explicit)
    operators = PetscOperators(forms, space, setting.correction, explicit, moved)
    law = make_law(case.contact, setting.stiffness, touch_depth(case), setting.damping, setting.areas)
    if isinstance(case.time.scheme, MoreauJean):
        law = replace(law, stores_energy=False)
    defaults = setting.defaults
    if case.contact.rubs is not None:
        creep = slip_velocity(case, case.contact.rubs)
        law = replace(law, friction=CoulombFriction(case.contact.rubs.coefficient, creep.value))
        defaults = (*defaults, creep)
    mass_damping, stiffness_damping = rayleigh(case)
    system = SemiDiscreteSystem(operators, contact, make_loads(case, space, operators), mass_damping, stiffness_damping)
    if explicit:
        case, computed = with_stable_step(asked, case, computed, stable_step(system, law))
    probes = {probe.name: point_row(space, axis_point(probe.point), f"[[probe]] {probe.name}") for probe in case.probe}
    return Model(
        case,
        tagged,
        space,
        system,
        law,
        probes,
        (*defaults, *computed),
        law_stiffness,
        seat_springs(case, tangent_stiffness(case, setting.face_stiffness) / (0.5 * area), facet_length, area),
        facet_length,
        {"mesh": meshed - started, "assembly": time.perf_counter() - meshed},
    )


@dataclass(frozen=True)
class _Setting:
    """The contact operator and what its law and K are made of.

    Attributes:
        operator: G, H, w, g0.
        stiffness: K of the law, or Nitsche's gamma at each point, (m,).
        defaults: Values that were computed, with their reasons.
        face_stiffness: K of all points of a face together, N/m^n.
        damping: c of the law kelvin-voigt.
        areas: What K and c are divided by, (m,), m^2; None where they are per area.
        correction: What Nitsche's method adds to K.
    """

    operator: ContactOperator
    stiffness: float | Array
    defaults: tuple[Default, ...]
    face_stiffness: float
    damping: float = 0.0
    areas: Array | None = None
    correction: Springs | None = None


def _contact(
    case: Case, space: fem.FunctionSpace, faces: Mapping[str, Indices], width: float, facet_length: float
) -> _Setting:
    """Return the operator of the formulation, with the values of the law. Collective."""
    clearance, rule, formulation = case.support.clearance, point_rule(case), case.contact.formulation
    if isinstance(formulation, NitscheMethod):
        plane_stress = case.mesh.plane == "stress" and space.mesh.geometry.dim == 2
        settings = Nitsche(formulation.theta, formulation.factor, lame(case.material, plane_stress), width)
        nitsche = nitsche_operator(space, faces, clearance, width, rule, settings)
        reason = f"{formulation.factor:g} times the largest eigenvalue of the trace problem of the contact cells"
        consequence = "half: at the edge of stability for theta = 1; double: stiffer contact, the same answer to O(h)"
        largest = float(nitsche.gamma.max())
        chosen = Default("Nitsche's gamma", largest, "Pa/m", reason, consequence)
        face_stiffness = 0.5 * nitsche.operator.area * largest
        return _Setting(nitsche.operator, nitsche.gamma, (chosen,), face_stiffness, correction=nitsche.correction)
    operator = contact_operator(space, faces, clearance, width, rule, case.contact.rubs is not None)
    face = 0.5 * operator.area
    chosen = contact_stiffness(case, facet_length, face)
    computed = contact_damping(case, chosen.value)
    defaults = (chosen,) if computed is None else (chosen, computed)
    damping = case.contact.damping if computed is None else computed.value
    places = case.contact.points
    if places is None:
        return _Setting(operator, chosen.value, defaults, face * chosen.value, damping)
    patch = contact_patch(case)
    gathered = resultant_operator(operator, places, patch.value)
    face_stiffness = len(places) * chosen.value
    return _Setting(gathered, chosen.value, (*defaults, patch), face_stiffness, damping, gathered.weights)
