"""From a case to the system that is marched."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from meshes.tagged import TaggedMesh
from solver.body import Body, ProbeRow, finite_elements, mesh_beam, mesh_dofs, point_rule
from solver.case import Case
from solver.case_tables.contact import NitscheMethod
from solver.case_tables.model import BeamModel, ReducedModel, RigidModel
from solver.case_tables.time import CentralDifference, MoreauJean
from solver.contact.choice import make_law
from solver.contact.friction import CoulombFriction
from solver.contact.law import ContactLaw
from solver.contact_scales import contact_duration
from solver.defaults import (
    Default,
    contact_damping,
    contact_stiffness,
    rayleigh,
    seat_springs,
    slip_velocity,
    tangent_stiffness,
    touch_depth,
)
from solver.face_points import PointRule
from solver.loads.exciter import assembled_system
from solver.memory_limit import refuse_too_large, refuse_too_large_before_meshing
from solver.operators import Array
from solver.reduction.reduced_body import reduced_body
from solver.reduction.rigid_body import rigid_body
from solver.stable_step import stable_step
from solver.step_limit import with_stable_step
from solver.system import SemiDiscreteSystem
from solver.time_step import with_time_step
from solver.timoshenko import beam_body

LOG = logging.getLogger("gapbeam")


@dataclass(frozen=True)
class Model:
    """A case, meshed, assembled and, if asked for, reduced.

    Attributes:
        case: The case, its time step a number.
        body: What its mesh, material and places make.
        system: The semi-discrete system.
        law: The contact law.
        defaults: Values that were computed, with their reasons.
        law_stiffness: K of the contact per area of a face, also where it acts at points, Pa/m^n.
        seat_springs: s of the search for the seat, Pa/m.
    """

    case: Case
    body: Body
    system: SemiDiscreteSystem
    law: ContactLaw
    defaults: tuple[Default, ...]
    law_stiffness: float
    seat_springs: float

    @property
    def tagged(self) -> TaggedMesh:
        """Mesh and its faces."""
        return self.body.meshed.tagged

    @property
    def space(self) -> fem.FunctionSpace:
        """Vector Lagrange space of the displacement."""
        return self.body.meshed.space

    @property
    def facet_length(self) -> float:
        """Mean length h of the contact facets along the beam, m."""
        return self.body.meshed.facet_length

    @property
    def probes(self) -> Mapping[str, ProbeRow]:
        """What evaluates the probes, by name."""
        return self.body.probes

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time of each part of the set-up."""
        return self.body.seconds

    @property
    def mesh_dofs(self) -> int:
        """Number of degrees of freedom of the mesh over all ranks."""
        return mesh_dofs(self.body.meshed)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom that are marched."""
        return self.mesh_dofs if self.body.expansion is None else self.system.operators.size

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

    def expand(self, x: Array) -> Array:
        """Return the DOFs of the mesh that this rank owns, from those marched."""
        return x if self.body.expansion is None else np.asarray(self.body.expansion @ x)


def build_model(case: Case, comm: MPI.Comm) -> Model:
    """Mesh, assemble and reduce a case.

    Raises:
        MeshError: A user's mesh does not fit the case.
        UserError: A point lies outside the mesh, a patch of contact.points between its quadrature points, an
            explicit scheme cannot march the step, or there is not enough memory.
        CaseError: The computed time step does not go with the rest of the case.

    Collective.
    """
    return model_of(case, build_body(case, comm))


def build_body(case: Case, comm: MPI.Comm) -> Body:
    """Return what `model_of` needs of a case; errors as in `build_model`. Collective."""
    refuse_too_large_before_meshing(case, comm)
    meshed = mesh_beam(case, comm)
    LOG.info("meshed: %d cells in %.2g s", meshed.tagged.cell_count, meshed.seconds)
    if case.mesh.file is not None:
        refuse_too_large(case, mesh_dofs(meshed), comm)
    if isinstance(case.model, BeamModel):
        return beam_body(case, meshed, case.model)
    body = finite_elements(case, meshed)
    LOG.info("assembled: %d DOFs in %.2g s", mesh_dofs(meshed), body.seconds["assembly"])
    if isinstance(case.model, RigidModel):
        return rigid_body(body)
    if not isinstance(case.model, ReducedModel):
        return body
    body = reduced_body(body, case.model)
    LOG.info("%s; reduced in %.2g s", basis_words(body), body.seconds["reduction"])
    return body


def basis_words(body: Body) -> str:
    """Return what a reduced basis holds and neglects, in one line."""
    basis = body.basis
    assert basis is not None
    odd = f", {basis.left_out} that nothing symmetric moves left out" if basis.left_out else ""
    return (
        f"basis of {basis.size} DOFs: {basis.modes} modes up to {basis.highest_mode:.4g} Hz, {basis.contact_shapes} "
        f"shapes from contact and {basis.load_shapes} from loads{odd}; it neglects {basis.neglected:.2g} of the static "
        f"flexibility of the contact faces ({basis.neglected_smooth:.2g} where the pressure varies over half a shape)"
    )


def model_of(case: Case, body: Body) -> Model:
    """Return the model of a case on the body of a case that differs from it in what is cheap to change only.

    Args:
        case: The case.
        body: The body of that case or of one with the same `solver.variants.body_key`.

    Raises:
        UserError: An explicit scheme cannot march the step.
        CaseError: The computed time step does not go with the rest of the case.

    Collective.
    """
    contact = body.contact.opened(case.support.clearance - body.case.support.clearance)
    setting = _setting(case, body)
    area = body.area
    law_stiffness = setting.face_stiffness / (0.5 * area)
    asked, (case, computed) = case, with_time_step(case, law_stiffness)
    law = make_law(case.contact, setting.stiffness, touch_depth(case), setting.damping, setting.areas)
    if isinstance(case.time.scheme, MoreauJean):
        law = replace(law, stores_energy=False)
    defaults = setting.defaults
    if case.contact.rubs is not None:
        creep = slip_velocity(case, case.contact.rubs)
        law = replace(law, friction=CoulombFriction(case.contact.rubs.coefficient, creep.value))
        defaults = (*defaults, creep)
    dimension = body.meshed.space.mesh.geometry.dim
    system = assembled_system(case, body.operators, contact, body.patterns, dimension, rayleigh(case))
    if isinstance(case.time.scheme, CentralDifference):
        case, computed = with_stable_step(asked, case, computed, stable_step(system, law))
    springs = tangent_stiffness(case, setting.face_stiffness) / (0.5 * area)
    return Model(
        case,
        body,
        system,
        law,
        (*defaults, *computed),
        law_stiffness,
        seat_springs(case, springs, body.meshed.facet_length, area),
    )


@dataclass(frozen=True)
class _Setting:
    """What the law and K are made of.

    Attributes:
        stiffness: K of the law, or Nitsche's gamma at each point, (m,).
        defaults: Values that were computed, with their reasons.
        face_stiffness: K of all points of a face together, N/m^n.
        damping: c of the law kelvin-voigt.
        areas: What K and c are divided by, (m,), m^2; None where they are per area.
    """

    stiffness: float | Array
    defaults: tuple[Default, ...]
    face_stiffness: float
    damping: float = 0.0
    areas: Array | None = None


def _setting(case: Case, body: Body) -> _Setting:
    """Return the values of the law."""
    formulation, face = case.contact.formulation, 0.5 * body.area
    if isinstance(formulation, NitscheMethod):
        assert body.gamma is not None
        reason = f"{formulation.factor:g} times the largest eigenvalue of the trace problem of the contact cells"
        consequence = "half: at the edge of stability for theta = 1; double: stiffer contact, the same answer to O(h)"
        largest = float(body.gamma.max())
        gamma = Default("Nitsche's gamma", largest, "Pa/m", reason, consequence)
        return _Setting(body.gamma, (gamma,), face * largest)
    chosen = contact_stiffness(case, body.meshed.facet_length, face)
    computed = contact_damping(case, chosen.value)
    defaults = (chosen,) if computed is None else (chosen, computed)
    damping = case.contact.damping if computed is None else computed.value
    places = case.contact.points
    if places is None:
        return _Setting(chosen.value, defaults, face * chosen.value, damping)
    assert body.patch is not None
    stiffness = len(places) * chosen.value
    return _Setting(chosen.value, (*defaults, body.patch), stiffness, damping, body.contact.weights)
