"""From a case to the system that is marched."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import basix.ufl
import ufl
from dolfinx import fem
from mpi4py import MPI

from meshes.describe import describe
from meshes.tagged import TaggedMesh
from solver.case import Case
from solver.contact.law import ContactLaw, kelvin_voigt
from solver.defaults import Default, contact_stiffness, rayleigh, seat_springs, touch_depth
from solver.elasticity import elastic_forms
from solver.interface import contact_operator
from solver.loads.patterns import axis_point, make_loads
from solver.mesh_of_case import mesh_of_case
from solver.petsc_operators import PetscOperators
from solver.points import PointRow, point_row
from solver.system import SemiDiscreteSystem


@dataclass(frozen=True)
class Model:
    """A case, meshed and assembled.

    Attributes:
        case: The case.
        tagged: Mesh and its faces.
        space: Vector Lagrange space of the displacement.
        system: The semi-discrete system.
        law: The contact law.
        probes: Rows that evaluate the probes, by name.
        defaults: Values that were computed, with their reasons.
        seat_springs: s of the search for the seat, Pa/m.
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
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom over all ranks."""
        return int(self.space.dofmap.index_map.size_global * self.space.dofmap.index_map_bs)

    @property
    def quadrature_degree(self) -> int:
        """Quadrature degree on the contact facets."""
        return facet_quadrature(self.case)


def facet_quadrature(case: Case) -> int:
    """Return the quadrature degree on contact facets, given or 2 degree + 2."""
    return case.contact.quadrature_degree or 2 * case.mesh.degree + 2


def build_model(case: Case, comm: MPI.Comm) -> Model:
    """Mesh and assemble a case.

    Raises:
        MeshError: A user's mesh does not fit the case.
        UserError: A point lies outside the mesh.

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
    measure = ufl.Measure("ds", domain=mesh, subdomain_data=tagged.facets)
    contact = contact_operator(space, faces, case.support.clearance, width, facet_quadrature(case))
    area = float(contact.weights.sum()) / width
    forms = elastic_forms(
        space,
        case.material,
        case.mesh.plane == "stress",
        width,
        (case.restraint.axial / (area * width), case.restraint.lateral / (area * width)),
        measure((tagged.groups["base"], tagged.groups["gland"])),
    )
    operators = PetscOperators(forms, space)
    mass_damping, stiffness_damping = rayleigh(case)
    system = SemiDiscreteSystem(operators, contact, make_loads(case, space, operators), mass_damping, stiffness_damping)
    facet_length = describe(tagged)["mean_contact_facet_length"]
    stiffness = contact_stiffness(case, facet_length)
    probes = {probe.name: point_row(space, axis_point(probe.point), f"[[probe]] {probe.name}") for probe in case.probe}
    return Model(
        case,
        tagged,
        space,
        system,
        kelvin_voigt(
            stiffness.value,
            case.contact.damping,
            case.contact.tension == "adhesive",
            touch_depth(case),
        ),
        probes,
        (stiffness,),
        seat_springs(case, stiffness.value, facet_length, area * width),
        {"mesh": meshed - started, "assembly": time.perf_counter() - meshed},
    )
