"""Body: the part of a model that depends on mesh, material and positions only, set up once for a sweep over the rest.

Clearance, contact law, damping, amplitudes, frequencies and the march in time are added by `models.model`.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.meshes.mesh_readings import as_arrays, facet_cells, refuse_curved, vector_space
from gapbeam.meshes.serial_mesh import FacetTags
from gapbeam.meshes.tagged_mesh import Section, TaggedMesh, contact_facet_length, mean_section
from gapbeam.solver.assembly.case_mesh import mesh_of_case
from gapbeam.solver.assembly.face_quadrature import PointRule
from gapbeam.solver.case.analysis_table import NAMES, RigidMotion
from gapbeam.solver.case.beam_motions import axial_restraint
from gapbeam.solver.case.case import Case, Contact, Damping, Friction, Output, Wear
from gapbeam.solver.case.computed_defaults import Default, contact_patch
from gapbeam.solver.case.model_choice import nominal_area, resolved_frequency
from gapbeam.solver.case.solution_tables import Gates, Time
from gapbeam.solver.contact.formulations.contact_points import resultant_operator, whole_contact
from gapbeam.solver.models.bending_stiffness import BendingStiffness
from gapbeam.solver.models.reduction.span_basis import BasisReport
from gapbeam.solver.supports.support_tables import without_play
from gapbeam.solver.system.operators import Array, Indices, Operators
from gapbeam.solver.system.semi_discrete import ContactOperator

if TYPE_CHECKING:
    from mpi4py import MPI


@dataclass(frozen=True)
class ProductExpansion:
    """E V, from reduced DOFs to those of the nodes.

    Attributes:
        nodes: E, from the DOFs of beam elements to those of the nodes, (N, n).
        columns: V, from reduced DOFs to those of beam elements, (n, r).
    """

    nodes: csr_matrix
    columns: csr_matrix

    @property
    def shape(self) -> tuple[int, int]:
        """(N, r)."""
        return int(self.nodes.shape[0]), int(self.columns.shape[1])

    def __matmul__(self, x: Array | csr_matrix) -> Any:
        """Return E V x, or the expansion in terms of other DOFs where x is sparse."""
        if isinstance(x, csr_matrix):
            return ProductExpansion(self.nodes, csr_matrix(self.columns @ x))
        return np.asarray(self.nodes @ (self.columns @ x))

    def __getitem__(self, rows: Any) -> csr_matrix:
        """Return some rows of E V."""
        return csr_matrix(self.nodes[rows] @ self.columns)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return E V multiplied out, (N, r)."""
        return np.asarray((self.nodes @ self.columns).toarray(), dtype=dtype)


@dataclass(frozen=True)
class HoldingShapes:
    """Products with the shapes Z that move h held motions by one each; V is the basis of the held body.

    Attributes:
        mass: Z^T M V, (h, n).
        stiffness: Z^T K V, the restraint included, (h, n).
        patterns: Z^T of `Body.patterns`, (h, patterns).
        pressure: Z^T H^T: what forces at the m contact points do along Z, (h, m).
        friction: Z^T T^T: what friction forces there do, (h, m k); without columns where there is no friction.
    """

    mass: Array
    stiffness: Array
    patterns: Array
    pressure: Array
    friction: Array


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
    space: Any
    faces: Mapping[str, Indices]
    width: float
    facet_length: float
    section: Section
    seconds: float

    def as_arrays(self) -> MeshedBeam:
        """Copy a mesh that is all on this rank, for models that assemble nothing on it any more."""
        mesh, space, old = self.space.mesh, as_arrays(self.space), self.tagged

        def moved(facets: Indices) -> Indices:
            return space.mesh.facets_at(*facet_cells(mesh, facets))

        tags = FacetTags(moved(old.facets.indices), np.array(old.facets.values))
        faces = {name: moved(facets) for name, facets in self.faces.items()}
        return replace(self, tagged=TaggedMesh(space.mesh, tags, old.groups), space=space, faces=faces)


TURNED = " rotation"
"""Ending of the names of rows of rotations, behind the name of the probe, which has no space."""


@dataclass(frozen=True)
class Body:
    """A meshed and assembled case without its contact and loads, which are cheap to change.

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
        expansion: Map from the DOFs marched to those of the mesh that this rank owns; None: they are the same.
        basis: Size and error of the reduced basis; None for other models.
        holding: Operator for the forces of joints that hold motions the basis has not; None: there are none.
        bending: Accuracy of the bending stiffness of a mesh.
        seconds: Wall time of each part of the set-up.
        made_by: Versions of what an earlier process made it with; empty: this process made it.
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
    made_by: dict[str, str] = field(default_factory=dict)


def body_key(case: Case) -> Case:
    """Return a case with everything taken out that a body does not depend on; equal for cases that share a body.

    Clearance, law, stiffness and damping of the contact, structural damping, all of a load but its place and direction,
    time, analysis, gates and output are cheap to change, as long as the start stays in the bending plane or leaves it.
    The restraint along the beam is part of the body. Where it follows from loads and play, it is given in the key.
    """
    axial = axial_restraint(case).value
    return case.model_copy(
        update={
            "title": "",
            "damping": Damping(),
            "support": without_play(case.support),
            "contact": _contact(case),
            "wear": None if case.wear is None else Wear(),
            "load": tuple(load.without_cheap_keys() for load in case.load),
            "figure": (),
            "time": _time(case),
            "analysis": case.analysis.for_body,
            "model": case.model.model_copy(update={"reasons": ()}),
            "restraint": case.restraint.model_copy(update={"axial": axial}) if axial > 0.0 else case.restraint,
            "gates": Gates(),
            "output": Output(),
        }
    )


def _contact(case: Case) -> Contact:
    return case.contact.model_copy(
        update={
            "law": Contact.model_fields["law"].get_default(),
            "stiffness": "auto",
            "damping": 0.0,
            "tension": "clipped",
            "touch_depth": "auto",
            "friction": None if case.friction is None else Friction(coefficient=1.0),
        }
    )


def _time(case: Case) -> Time:
    """Return the scheme of explicit steps, and the frequency up to which the spans of a beam are resolved."""
    key = Time(end=1.0, step="auto", frequency=resolved_frequency(case))
    return key.model_copy(update={"scheme": case.time.scheme}) if case.time.scheme.explicit else key


def point_rule(case: Case) -> PointRule:
    """Return the rule for contact points: quadrature points (by default of degree 2 degree + 2), or nodes.

    Constraints need at most as many points as the DOFs that they constrain; a pressure that follows a law does not.
    """
    if case.contact.formulation.holds_points:
        return PointRule(case.mesh.degree, nodal=True)
    return PointRule(case.contact.quadrature_degree or 2 * case.mesh.degree + 2)


FEWEST = 64  # meshes until those that nothing needs are let go of
_made = count(1)


def mesh_beam(case: Case, comm: MPI.Comm) -> MeshedBeam:
    """Mesh a case and put a vector Lagrange space on it.

    Meshes hold some of the 2048 communicators of MPICH, in cycles that Python may not look at for hundreds of meshes.

    Raises:
        MeshError: A user's mesh does not fit the case, or the degree does not fit curved cells.

    Collective.
    """
    started = time.perf_counter()
    if comm.size == 1 and next(_made) % FEWEST == 0:
        gc.collect()
    tagged = mesh_of_case(case, comm)
    mesh = tagged.mesh
    refuse_curved(mesh, case.mesh.degree)
    width = case.beam.width if mesh.geometry.dim == 2 else 1.0
    return MeshedBeam(
        tagged,
        vector_space(mesh, case.mesh.degree),
        {face.name: tagged.facets_of(face.name) for face in case.layout.faces},
        width,
        contact_facet_length(tagged),
        mean_section(tagged, width),
        time.perf_counter() - started,
    )


def mesh_dofs(meshed: MeshedBeam) -> int:
    """Return the number of degrees of freedom of a mesh over all ranks."""
    dofmap = meshed.space.dofmap
    return int(dofmap.index_map.size_global * dofmap.index_map_bs)


def gathered(case: Case, contact: ContactOperator) -> tuple[ContactOperator, Default | None]:
    """Return the operator of `contact.points` with the size of their patches, or of whole supports; or the same."""
    if case.contact.points is None:
        owners = case.layout.by_face
        areas = [None if one.support_stiffness is None else nominal_area(case, one) for one in owners]
        return whole_contact(contact, areas), None
    patch = contact_patch(case)
    return resultant_operator(contact, case.contact.points, patch.value), patch


def rigid_parts(body: Body, motion: RigidMotion) -> Iterator[Array]:
    """Yield the parts of a rigid motion along `NAMES` on the DOFs of the beam, (n,) each. Collective."""
    sizes = motion.section(0.0)
    wanted = [(sizes[name], row) for name, row in zip(NAMES, body.rigid, strict=True) if sizes[name] != 0.0]
    if not wanted:
        return
    factor = body.operators.factor(1.0, 0.0)
    for size, row in wanted:
        yield size * factor.solve(row)
