"""The companions of a run: cheap models of the same case with another step, mesh, basis or contact stiffness.

    same           the reduced model with step and mesh of the run; the run itself where that is no full model
    half step      the same with half the step
    coarser mesh   the same with cells twice as large
    finest         half the step, half the cells, 40 modes and 19 shapes along each face
    stiffer        twice the contact stiffness, where the stiffness was computed: it stands for rigid contact then

A solid (3D) that is loaded in its bending plane has plane companions: their differences are those of the solid within
10 %, at a hundredth of its cost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gapbeam.solver.case.case import MOST_CELLS, Case
from gapbeam.solver.case.model_table import BeamModel, FullModel, ReducedModel, RigidModel
from gapbeam.solver.case.time_table import Time
from gapbeam.studies.trials.refined_mesh import mesh_keys

SAME, HALF_STEP, COARSER, FINEST, STIFFER = "same", "half step", "coarser mesh", "finest", "stiffer contact"
FINEST_MODES, FINEST_SHAPES = 40, 19
COST = {SAME: 1.0, HALF_STEP: 2.0, COARSER: 1.0, FINEST: 3.0, STIFFER: 1.0}
"""Cost of a march, relative to that of the companion `same`."""


@dataclass(frozen=True)
class Companion:
    """A companion of a run.

    Attributes:
        name: One of those above.
        changes: Keys of the case that it replaces.
    """

    name: str
    changes: Mapping[str, Any]


@dataclass(frozen=True)
class CompanionPlan:
    """The companions of a run.

    Attributes:
        companions: In the order in which they are marched.
        in_plane: Whether they are plane and the run is a solid.
        left_out: Errors that no companion shows, and why.
    """

    companions: tuple[Companion, ...]
    in_plane: bool
    left_out: tuple[str, ...]


def companions_of(case: Case, step: float, stiffness: float | None, computed: bool) -> CompanionPlan:
    """Return the companions of a run.

    Args:
        case: The case of the run.
        step: Its time step, s.
        stiffness: Its contact stiffness, which no companion but the stiffer one changes; None: it has none.
        computed: Whether that was computed, and stands for rigid contact.
    """
    left_out = []
    if not case.contact.formulation.takes_stiffness:
        stiffness = None
    plane = case.mesh.dimension == 3 and _in_bending_plane(case)
    shared: dict[str, Any] = {
        "title": case.title,
        "time.step": step,
        "output.history_interval": case.output.history_interval or step,
        "output.fields_interval": None,
        "output.stress": False,
        "output.wall_time": None,
        "gates.accept_energy_growth": True,
    }
    if stiffness is not None:
        shared["contact.stiffness"] = stiffness
    shared |= _of_reduced_models(case)
    usual = _model(case, None)
    shared |= _plane_keys(case) if plane else {}
    even = case.mesh.degree == 1  # puts nodes on the axis, where loads and probes are
    own = mesh_keys(case, 1.0, plane, even) if plane else {}
    found = [Companion(SAME, shared | own | {"model": usual})] if isinstance(case.model, FullModel) else []
    found.append(Companion(HALF_STEP, shared | own | {"model": usual, "time.step": 0.5 * step}))
    if stiffness is not None and computed:
        found.append(Companion(STIFFER, shared | own | {"model": usual, "contact.stiffness": 2.0 * stiffness}))
    if case.model.rings:
        left_out.append('the deformation of the sections, which sections = "rigid" leaves out')
    if case.mesh.file is not None:
        left_out.append("the mesh, which is given by a file")
    else:
        coarse = _model(case, 0.5)
        found.append(Companion(COARSER, shared | mesh_keys(case, 2.0, plane, even) | {"model": coarse}))
        fine = mesh_keys(case, 0.5, plane, even)
        if fine["mesh.cells_through_thickness"] > MOST_CELLS:
            left_out.append(f"a finer mesh, which would have more than {MOST_CELLS} cells through the thickness")
        elif case.mesh.dimension == 2 or plane:
            fine |= {"model": _finest(case), "time.step": 0.5 * step}
            found.append(Companion(FINEST, shared | fine))
        else:
            why = (
                "the motion is not in the bending plane"
                if case.profile.sliceable(case.beam.width)
                else "the section has no slice"
            )
            left_out.append(f"a finer mesh: {why}, and finer solids are expensive")
            simpler = isinstance(case.model, BeamModel | RigidModel)
            if simpler and _contact_of_basis(case):
                left_out.append("what the model leaves out of the solid, whose basis would hold every interface DOF")
            elif simpler:  # what they leave out of the solid is an error of theirs
                found.append(Companion(FINEST, shared | {"model": _finest(case), "time.step": 0.5 * step}))
    return CompanionPlan(tuple(found), plane, tuple(left_out))


def _in_bending_plane(case: Case) -> bool:
    """Whether loads, contact points, probes and mesh of a solid leave all that is asked for in the bending plane."""
    vectors: list[float | tuple[float, ...] | None] = [load.direction for load in case.load]
    vectors += [load.place.point for load in case.load]
    vectors += [probe.point for probe in case.probe]
    beside = any(isinstance(vector, tuple) and vector[1] != 0.0 for vector in vectors)
    patches = any(isinstance(place, tuple) for place in case.contact.points or ())
    return case.mesh.file is None and case.profile.sliceable(case.beam.width) and not beside and not patches


def _plane_keys(case: Case) -> dict[str, Any]:
    """Return the keys of loads and probes that have one coordinate less in the plane."""
    changes: dict[str, Any] = {}
    vectors: dict[str, float | tuple[float, ...] | None] = {}
    for load in case.load:
        vectors |= {f"load.{load.name}.direction": load.direction, f"load.{load.name}.point": load.place.point}
    vectors |= {f"probe.{probe.name}.point": probe.point for probe in case.probe}
    for key, vector in vectors.items():
        if isinstance(vector, tuple):
            changes[key] = [vector[0], vector[-1]]
    return changes


def _of_reduced_models(case: Case) -> dict[str, Any]:
    """Return the keys that a full model may have and a reduced one may not."""
    changes: dict[str, Any] = {}
    if not isinstance(case.model, FullModel):
        return changes
    if case.contact.formulation.stress_terms is not None:
        changes["contact.formulation"] = "penalty"
    if case.contact.mass == "redistributed":
        changes["contact.mass"] = "consistent"
    if case.time.scheme.explicit:
        changes["time.scheme"] = Time.model_fields["scheme"].get_default().type
    return changes


def _model(case: Case, refinement: float | None) -> dict[str, Any]:
    """Return the model of a companion; with a refinement, the elements of beam models follow it."""
    match case.model:
        case FullModel():
            return {"type": "reduced"} | _contact_of_basis(case)
        case BeamModel() as beam:
            return {"type": "beam", "elements": max(2, round(beam.elements * (refinement or 1.0)))}
        case _:
            return {key: value for key, value in case.model.model_dump().items() if value is not None}


def _finest(case: Case) -> dict[str, Any]:
    """Return the richest basis: what models of beam elements and rigid bodies are compared with, too."""
    if isinstance(case.model, ReducedModel):
        own = _model(case, None)
        return own | {"modes": max(own["modes"], FINEST_MODES), "shapes": max(own["shapes"], FINEST_SHAPES)}
    richest = {"type": "reduced", "modes": FINEST_MODES, "shapes": FINEST_SHAPES}
    if any(face.circle for face in case.layout.faces):
        richest["sections"] = "rigid"
    return richest | _contact_of_basis(case)


def _contact_of_basis(case: Case) -> dict[str, Any]:
    """Return whether a basis keeps every interface DOF: for friction, and formulations that hold constraints."""
    exact = not case.contact.formulation.follows_the_law and case.contact.formulation.stress_terms is None
    return {"contact": "all"} if exact or case.contact.rubs is not None else {}
