"""Model of a case: body, semi-discrete system, contact law and computed defaults.

Flexible supports: the motions of their bodies as further DOFs of a dense system.

With q the motions of the bodies along unit vectors e_j, and n_i what opens the gap of contact point i,

    diag(M, m) (u, q)'' + diag(C, c) (u, q)' + diag(K, k) (u, q) = (f, f_q) + (G, N)^T (w p),
    g = g0 + G u + N q,    N_ij = -n_i . e_j at the points of the support with the motion j, else 0.

Friction sees T u + S q alike. The DOFs of the bodies come after those of the beam, which all rows of probes, poses
and fields read alone. Gravity and base motion act on the masses. Rayleigh and modal damping are those of the
beam: what c_M m + c_K k would add goes off the dashpot again.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, assert_never

import numpy as np
from scipy.sparse import csr_matrix, hstack

from gapbeam.meshes.tagged_mesh import Section, TaggedMesh
from gapbeam.meshes.versions.installed_versions import versions
from gapbeam.solver.assembly.assembled_system import assembled_system
from gapbeam.solver.assembly.face_quadrature import PointRule
from gapbeam.solver.case.beam_motions import motions_in_words
from gapbeam.solver.case.beam_profile import BeamProfile
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import (
    Default,
    overhang_frequency,
    rayleigh,
    seat_springs,
    slip_velocity,
    tangent_stiffness,
)
from gapbeam.solver.case.solution_tables import (
    AutoModel,
    BeamModel,
    FullModel,
    ModelTable,
    ReducedModel,
    RigidModel,
)
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.integrators.stable_step import stable_step
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.loads.load_choice import forcing_frequencies, load_direction
from gapbeam.solver.loads.places import BodyForce, SupportAcceleration
from gapbeam.solver.loads.support_walls import walls_of
from gapbeam.solver.memory.memory_check import refuse_too_large, refuse_too_large_before_meshing
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.models.beam_body import beam_body, rigid_body
from gapbeam.solver.models.bending_stiffness import refuse_poor_bending
from gapbeam.solver.models.body import TURNED, Body, ProbeRow, body_key, mesh_beam, mesh_dofs, point_rule
from gapbeam.solver.models.contact_setting import (
    contact_setting,
    friction_of,
    law_of_case,
    met_along_lines,
    met_as_circles,
    station_reactions,
    with_moving_holes,
)
from gapbeam.solver.models.kept_files import kept_or_found
from gapbeam.solver.models.time_step import (
    compared_depth,
    contact_duration,
    impact_time,
    with_stable_step,
    with_time_step,
)
from gapbeam.solver.supports.layout import BodyMotion, body_motions
from gapbeam.solver.supports.support import Support
from gapbeam.solver.system.dense_operators import DenseOperators, MassesBeside
from gapbeam.solver.system.operators import Array, Interface, RankOnes
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem
from gapbeam.solver.system.slip_modes import SlipModes

if TYPE_CHECKING:
    from mpi4py import MPI

    from gapbeam.solver.linear_algebra.petsc_operators import LinearSolver


def with_support_bodies(case: Case, system: SemiDiscreteSystem, dimension: int) -> SemiDiscreteSystem:
    """Return a system with the motions of the support bodies of its case; itself where there are none.

    Args:
        case: The case.
        system: The beam under its loads, in contact with supports that stand still.
        dimension: 2 or 3.

    Raises:
        TypeError: The system has bodies and is not dense.
    """
    motions = body_motions(case.layout, dimension)
    if not motions:
        return system
    beam = system.operators
    if not isinstance(beam, DenseOperators):
        raise TypeError("bodies of supports need a model of few DOFs")
    masses, springs, dampers = np.array(
        [[one.body.mass, one.body.stiffness, one.body.damping] for one in motions]
    ).T  # (k,) each
    reactions = system.reactions
    if reactions is not None:
        rows = (_padded(reactions.displacement, len(motions)), _padded(reactions.velocity, len(motions)))
        reactions = replace(reactions, displacement=rows[0], velocity=rows[1])
    pushes = np.zeros((len(system.loads), len(motions)))  # preloads come after the loads of the case
    for push, load in zip(pushes, case.load, strict=False):
        if isinstance(load.place, BodyForce | SupportAcceleration):
            along = load_direction(load, dimension)
            push[:] = masses * [along[one.axis] for one in motions]
    loads = [
        replace(load, pattern=np.concatenate([load.pattern, push]))
        for load, push in zip(system.loads, pushes, strict=True)
    ]
    return replace(
        system,
        operators=MassesBeside(beam, masses, springs),
        contact=_on_bodies(system.contact, motions),
        loads=tuple(loads),
        dashpots=_with_dampers(
            system, dampers - system.mass_damping * masses - system.stiffness_damping * springs, beam.size
        ),
        reactions=reactions,
    )


def _padded(rows: Array | csr_matrix, count: int) -> Array:
    """Return a vector or rows on the DOFs of the beam with zeros for those of bodies behind them."""
    found = rows if isinstance(rows, np.ndarray) else rows.toarray()
    return np.concatenate([found, np.zeros((*found.shape[:-1], count))], axis=-1)


def _with_dampers(system: SemiDiscreteSystem, coefficients: Array, size: int) -> RankOnes | None:
    """Return the dashpots of a system with one of each body that is not 0."""
    there = np.flatnonzero(coefficients)
    patterns = np.eye(len(coefficients), size + len(coefficients), k=size)[there]
    added = RankOnes(patterns, coefficients[there])
    if system.dashpots is None:
        return added if len(there) else None
    old = RankOnes(_padded(system.dashpots.patterns, len(coefficients)), system.dashpots.coefficients)
    return old.and_also(added)


def _on_bodies(contact: ContactOperator, motions: Sequence[BodyMotion]) -> ContactOperator:
    """Return an operator on all DOFs of a dense system, in which the supports have motions."""
    size = contact.interface.size + len(motions)
    opening, sliding = _rows(contact, motions)
    changed = {
        "interface": Interface(size, np.arange(size), np.arange(size)),
        "gap_matrix": csr_matrix(hstack([contact.gap_matrix, opening])),
        "tangents": None if contact.tangents is None else csr_matrix(hstack([contact.tangents, sliding])),
    }
    if isinstance(contact, ResultantOperator):
        return replace(contact, **changed, distributed=_on_bodies(contact.distributed, motions))
    return replace(contact, **changed)


def _rows(contact: ContactOperator, motions: Sequence[BodyMotion]) -> tuple[csr_matrix, csr_matrix]:
    """Return N, (m, k), and S, (m t, k): of t tangents the last goes around supports that are met around the beam."""
    tangents = 0 if contact.tangents is None else contact.tangents.shape[0] // contact.size
    opening, sliding = np.zeros((contact.size, len(motions))), np.zeros((contact.size, tangents, len(motions)))
    for number, one in enumerate(motions):
        faces = [contact.face_names.index(face.name) for face in one.support.faces]
        there = np.isin(contact.faces, faces)
        aside, up = contact.across[there].T
        opening[there, number] = -up if one.bends else -aside
        if tangents > 1 and one.support.around:
            sliding[there, -1, number] = -aside if one.bends else up
    return csr_matrix(opening), csr_matrix(sliding.reshape(contact.size * tangents, len(motions)))


GIVEN = "given in the case"


@dataclass(frozen=True)
class Model:
    """A case, meshed, assembled and, if asked for, reduced.

    Attributes:
        case: The case, its time step a number.
        body: The part that depends on mesh, material and positions only.
        system: The semi-discrete system.
        law: The contact law.
        defaults: Values that were computed, with their reasons.
        seat_springs: s of the search for the seat, Pa/m.
    """

    case: Case
    body: Body
    system: SemiDiscreteSystem
    law: ContactLaw
    defaults: tuple[Default, ...]
    seat_springs: float

    @property
    def support(self) -> Support:
        """The support, its contact stiffness included."""
        return self.system.contact.support

    @property
    def tagged(self) -> TaggedMesh:
        """Mesh and its faces."""
        return self.body.meshed.tagged

    @property
    def space(self) -> Any:
        """Vector Lagrange space of the displacement."""
        return self.body.meshed.space

    @property
    def solver(self) -> LinearSolver | None:
        """Choice of the solver for effective operators of a full model; None for others."""
        return getattr(self.body.operators, "solver", None)

    @property
    def probes(self) -> Mapping[str, ProbeRow]:
        """Rows that evaluate the motion of each probe, by name."""
        return {name: row for name, row in self.body.probes.items() if not name.endswith(TURNED)}

    @property
    def turned_probes(self) -> Mapping[str, ProbeRow]:
        """Rows whose last component is the rotation of the cross-section of a probe, by the name of the probe."""
        turned = {name: row for name, row in self.body.probes.items() if name.endswith(TURNED)}
        return {name.removesuffix(TURNED): row for name, row in turned.items()}

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
    def end(self) -> float:
        """Time at which the motion ends, s."""
        return self.case.time.end

    @property
    def scheme(self) -> TimeScheme:
        """Time scheme that the case asks for."""
        return self.case.time.scheme

    @property
    def dimension(self) -> int:
        """Dimension of the mesh, 2 or 3."""
        return int(self.space.mesh.geometry.dim)

    @property
    def profile(self) -> BeamProfile:
        """The beam along its length."""
        return self.case.profile

    @property
    def length(self) -> float:
        """Length of the beam, m."""
        return self.case.beam.length

    @property
    def bending_frequency(self) -> float:
        """First bending frequency of the overhang, Hz."""
        return overhang_frequency(self.case)

    @property
    def forcing(self) -> list[float]:
        """Frequencies at which all loads repeat, Hz, ascending; none where a load never does."""
        return forcing_frequencies(self.case.load)

    @property
    def settled_case(self) -> Case:
        """The case with the computed contact stiffness written into it."""
        contact = self.case.contact
        chosen = next((one.value for one in self.defaults if one.key == "contact.stiffness"), None)
        if contact.stiffness != "auto" or chosen is None or not contact.formulation.follows_the_law:
            return self.case
        return self.case.model_copy(update={"contact": contact.model_copy(update={"stiffness": chosen})})

    def with_step(self, step: float) -> Model:
        """Return the model with another time step, s."""
        time = self.case.time.model_copy(update={"step": step})
        return replace(self, case=self.case.model_copy(update={"time": time}))

    @cached_property
    def bodies(self) -> tuple[BodyMotion, ...]:
        """The motions of support bodies, in the order of their DOFs, the last ones."""
        return body_motions(self.case.layout, self.case.mesh.dimension)

    @property
    def contact_duration(self) -> float:
        """Duration of an impact on the contact stiffness, at least, s."""
        return contact_duration(self.case, self.support.stiffness_per_area)

    @property
    def compared_depth(self) -> float:
        """Penetration at which laws with an exponent are taken as linear, m."""
        return compared_depth(self.case)

    @property
    def point_rule(self) -> PointRule:
        """Rule for the contact points of a facet."""
        return point_rule(self.case)

    def expand(self, x: Array) -> Array:
        """Return the DOFs of the mesh that this rank owns, from those marched, of which the beam's come first."""
        expansion = self.body.expansion
        return x if expansion is None else np.asarray(expansion @ x[: expansion.shape[1]])


def build_model(case: Case, comm: MPI.Comm) -> Model:
    """Mesh, assemble and reduce a case.

    Raises:
        MeshError: A user's mesh does not fit the case.
        UserError: A point lies outside the mesh, a patch of contact.points between its quadrature points, an
            explicit scheme cannot march the step, the mesh does not bend, or there is not enough memory.
        CaseError: The computed time step does not go with the rest of the case.

    Collective.
    """
    model = model_of(case, build_body(case, comm))
    _log_choices(case.model, model.defaults)
    return model


def _log_choices(chosen: ModelTable, defaults: Sequence[Default]) -> None:
    """Log the choices of the program; the reasons go to the log of analysts."""
    words = [f"model {chosen.type}"] if chosen.reasons else []
    words += [f"{one.key} = {one.value:.4g} {one.unit}" for one in defaults if not one.reason.startswith(GIVEN)]
    if words:
        LOG.info("chosen: %s", ", ".join(words))
    for reason in chosen.reasons:
        LOG.debug("model auto: %s", reason)
    for one in defaults:
        LOG.debug("%s = %.4g %s: %s", one.key, one.value, one.unit, one.reason)


def build_body(case: Case, comm: MPI.Comm) -> Body:
    """Return the body of a case for `model_of`; errors as in `build_model`. Collective."""
    refuse_too_large_before_meshing(case, comm)
    if not isinstance(case.model, ReducedModel) or comm.size > 1:
        return _made_body(case, comm)
    clock, file = time.perf_counter(), case.mesh.file
    read = None if file is None else np.frombuffer(Path(file).read_bytes(), dtype=np.uint8)
    inputs = (body_key(case), case.support, *([] if read is None else [read]))

    def made() -> Body:
        return replace(_made_body(case, comm), made_by=versions())

    body = kept_or_found(comm, Body, inputs, made)
    if body.case is case:
        return replace(body, made_by={})
    if file is not None:
        LOG.info("%s", _filled(case, body.meshed.section))
    refuse_poor_bending(case, body.bending)
    LOG.debug("%s", basis_words(body))
    return replace(body, case=case, seconds={"mesh": 0.0, "assembly": 0.0, "reduction": time.perf_counter() - clock})


def _made_body(case: Case, comm: MPI.Comm) -> Body:
    """Mesh, assemble and reduce a case. Collective."""
    meshed = mesh_beam(case, comm)
    LOG.debug("meshed: %d cells in %.2g s", meshed.tagged.cell_count, meshed.seconds)
    if case.mesh.file is not None:
        LOG.info("%s", _filled(case, meshed.section))
        refuse_too_large(case, mesh_dofs(meshed), comm)
    if isinstance(case.model, BeamModel):
        for name, why in motions_in_words(case):
            LOG.debug("beam motion beside bending: %s (%s)", name, why)
        return beam_body(case, meshed, case.model)
    if isinstance(case.model, RigidModel):
        return rigid_body(case, meshed)
    from gapbeam.solver.models.solid_body import finite_elements

    body = finite_elements(case, meshed)
    LOG.debug("assembled: %d DOFs in %.2g s", mesh_dofs(meshed), body.seconds["assembly"])
    refuse_poor_bending(case, body.bending)
    match case.model:
        case FullModel():
            return body
        case ReducedModel():
            from gapbeam.solver.models.reduction.reduced_body import reduced_body

            body = reduced_body(body, case.model)
            LOG.debug("%s; reduced in %.2g s", basis_words(body), body.seconds["reduction"])
            return body
        case AutoModel():
            raise UserError('the model "auto" is chosen when a case is read; found a case that was not read')
        case _:
            assert_never(case.model)


def _filled(case: Case, section: Section) -> str:
    """Return volume and mass of a user's mesh, and its share of the volume of the case's section."""
    beam, material = case.beam, case.material  # the same all along: mesh files have no segments
    share = section.area / beam.area
    return (
        f"mesh file: {section.volume:.4g} m^3, {material.density * section.volume:.4g} kg; "
        f"fills {100.0 * share:.3g} % of length x the area of the section"
    )


def basis_words(body: Body) -> str:
    """Return the size and the error of a reduced basis, in one line."""
    basis = body.basis
    assert basis is not None
    dropped = f"; {basis.left_out} antisymmetric modes dropped (load and mesh are symmetric)" if basis.left_out else ""
    error = f"basis error: {100 * basis.neglected:.2g} % of the contact faces' static flexibility "
    smooth = f"{100 * basis.neglected_smooth:.2g} % for smooth pressure"
    if basis.section_flexibility is not None:
        smooth = (
            f"{100 * basis.neglected_smooth:.2g} % for pressure on half of a section, which is rigid here and would "
            f"deform by {basis.section_flexibility:.2g} m/N"
        )
    return (
        f"basis of {basis.size} DOFs: {basis.modes} modes up to {basis.highest_mode:.4g} Hz, {basis.contact_shapes} "
        f"shapes from contact and {basis.load_shapes} from loads{dropped}; {error}({smooth})"
    )


def model_of(case: Case, body: Body) -> Model:
    """Return the model of a case on the body of a case that differs only in values that are cheap to change.

    Args:
        case: The case.
        body: The body of that case or of one with the same `gapbeam.solver.models.body.body_key`.

    Raises:
        UserError: An explicit scheme cannot march the step.
        CaseError: The computed time step does not go with the rest of the case.

    Collective.
    """
    lined = met_along_lines(case, body)
    marched = met_as_circles(lined)
    setting = contact_setting(case, marched)
    contact = marched.contact.with_gaps_of(case.layout.faces)
    support = contact.support.with_stiffness(setting.face_stiffness)
    dimension = body.meshed.space.mesh.geometry.dim
    walls = walls_of(case.load, case.layout, contact, dimension)
    slides = case.wear is not None
    maps = slides and any(load.noise for load in case.load)
    contact = replace(contact, support=support, walls=walls, measures_sliding=slides, maps_sliding=maps)
    contact = with_moving_holes(case, contact, dimension)
    asked, (case, computed) = case, with_time_step(case, support.stiffness_per_area)
    law = law_of_case(case, contact.faces, setting)
    if case.time.scheme.impulses:
        law = replace(law, stores_energy=False)
    defaults = setting.defaults
    if case.friction is not None:
        creep = slip_velocity(case, case.friction)
        law = replace(law, friction=friction_of(case, marched, creep.value))
        defaults = (*defaults, creep)
    if case.wear is not None:
        struck = impact_time(case, case.wear, support.stiffness_per_area)
        creeping = 0.0 if law.friction is None else law.friction.slip_velocity
        contact = replace(contact, slip_modes=SlipModes(struck.value, creeping))
        defaults = (*defaults, struck)
    system = assembled_system(case, body.operators, contact, body.patterns, dimension, rayleigh(case))
    if case.time.scheme.explicit:
        case, computed = with_stable_step(asked, case, computed, stable_step(system, law, compared_depth(case)))
    system = replace(system, reactions=station_reactions(case, lined, system))
    system = with_support_bodies(case, system, dimension)
    springs = support.per_face_area(tangent_stiffness(case, setting.face_stiffness))
    return Model(
        case,
        body,
        system,
        law,
        (*defaults, *computed),
        seat_springs(case, springs, body.meshed.facet_length, support.area),
    )
