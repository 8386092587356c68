"""The companions of a run: cheap models of the same case with another step, mesh, basis or contact stiffness.

    twice the step    the reduced model with the mesh of the run; the model of the run where that is no full model
    four times it     the same with four times the step: for solids, whose companions are plane
    coarser mesh      the same as the first with cells twice as large
    finest            the same as the first with half the cells, 40 modes and up to 19 shapes along each face; of rigid
                      sections 40 modes and half as many sections again; of rigid bodies, with the step of the run,
                      whose elastic motions twice the step would not resolve
    stiffer           the same as the first with twice the contact stiffness, where that was computed: it stands for
                      rigid contact then

They march by the scheme that is advised for the contact, which conserves energy where it has a potential: what another
one creates or takes at contacts differs little at twice the step, and is an error as large as that at the step.

All together march at most twice the steps of the run, whatever the machine does meanwhile. A `thorough` estimate has
companions by the scheme and with the step of the run, half of it, and a finest one with half of it: at most seven times
the steps.

A solid (3D) that is loaded in its bending plane has plane companions: their differences are those of the solid within
10 %, at a hundredth of its cost.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from gapbeam.solver.case.case import MOST_CELLS, Case, advised_scheme
from gapbeam.solver.case.model_choice import line_radii, meets_sections
from gapbeam.solver.case.solution_tables import MOST_STATIONS, BeamModel, FullModel, ReducedModel, RigidModel, Time
from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.trials.refined_mesh import mesh_keys

SAME, HALF_STEP, TWICE, FOURFOLD = "same", "half step", "twice the step", "four times the step"
COARSER, FINEST, STIFFER, FINER = "coarser mesh", "finest", "stiffer contact", "finer structures"
FINEST_MODES, FINEST_SHAPES = 40, 19
FEW_POINTS = 3  # degree of quadrature: two points along each edge of a cell
FEWEST_SHAPES, MOST_OF_ALL = 3, 200  # shapes along each face, and of all faces together
VARIABLE = "GAPBEAM_ERRORS"
WAYS = ("companions", "thorough", "none")
MOST_STEPS = 2.0  # of all companions, over those of the run


def error_way(case: Case) -> str:
    """Return the way in which errors are estimated, one of `WAYS`: the later of output.errors and GAPBEAM_ERRORS.

    Raises:
        UserError: GAPBEAM_ERRORS is none of WAYS.
    """
    asked = os.environ.get(VARIABLE, WAYS[0])
    if asked not in WAYS:
        expected = " or ".join(f'"{way}"' for way in WAYS)
        raise UserError(f'the environment variable {VARIABLE} is "{asked}"; expected {expected}')
    return max(asked, case.output.errors, key=WAYS.index)


@contextmanager
def quiet(least: int = logging.WARNING) -> Iterator[None]:
    """Leave the set-up of companions, below a level, out of the log."""
    logger = logging.getLogger("gapbeam")
    before = logger.level
    logger.setLevel(max(before, least))
    try:
        yield
    finally:
        logger.setLevel(before)


@dataclass(frozen=True)
class Companion:
    """A companion of a run.

    Attributes:
        name: Name, one of those above.
        changes: Keys of the case that it replaces.
        steps: Number of its steps over those of the run.
    """

    name: str
    changes: Mapping[str, Any]
    steps: float = 1.0


@dataclass(frozen=True)
class CompanionPlan:
    """The companions of a run.

    Attributes:
        companions: Companions in the order in which they are marched.
        in_plane: Whether they are plane and the run is a solid.
        left_out: Errors that no companion shows, and why.
        records: Every how many records of the run fall on a step of every companion.
    """

    companions: tuple[Companion, ...]
    in_plane: bool
    left_out: tuple[str, ...]
    records: int = 1

    @property
    def reference(self) -> str | None:
        """The companion from which the others differ in one respect; None: the run itself."""
        return next((one.name for one in self.companions if one.name in (SAME, TWICE)), None)


def companions_of(
    case: Case, step: float, stiffness: float | None, computed: bool, thorough: bool = False
) -> CompanionPlan:
    """Return the companions of a run.

    Args:
        case: The case of the run.
        step: Its time step, s.
        stiffness: Its contact stiffness, which no companion but the stiffer one changes; None: it has none.
        computed: Whether that was computed, and stands for rigid contact.
        thorough: March more steps than twice those of the run.
    """
    left_out = []
    if not case.contact.formulation.takes_stiffness:
        stiffness = None
    plane = case.mesh.dimension == 3 and _in_bending_plane(case)
    even = case.mesh.degree == 1  # puts nodes on the axis, where loads and probes are
    longest = 1 if thorough else 4 if plane else 2
    every = max(1, round((case.output.history_interval or step) / step))
    records = next(count for count in (1, 2, 4) if count * every % longest == 0)
    shared: dict[str, Any] = {
        "title": case.title,
        "output.history_interval": records * every * step,
        "output.fields_interval": None,
        "output.stress": False,
        "output.wall_time": None,
        "gates.accept_energy_growth": True,
    }
    if stiffness is not None:
        shared["contact.stiffness"] = stiffness
    shared |= _of_reduced_models(case)
    if not (thorough or case.time.scheme.conserves_energy or case.time.scheme.impulses):
        shared["time.scheme"] = advised_scheme(case.contact)
    shared |= _plane_keys(case) if plane else {}
    own = mesh_keys(case, 1.0, plane, even) if plane else {}
    usual = _model(case, None)
    base = 1.0 if thorough else 2.0

    def companion(name: str, size: float, changes: Mapping[str, Any]) -> Companion:
        return Companion(name, {"model": usual} | shared | {"time.step": size * step} | dict(changes), 1.0 / size)

    found = []
    if not thorough:
        found.append(companion(TWICE, base, own))
    elif isinstance(case.model, FullModel):
        found.append(companion(SAME, base, own))
    if thorough:
        found.append(companion(HALF_STEP, 0.5, own))
    elif plane:
        found.append(companion(FOURFOLD, 4.0, own))
    if stiffness is not None and computed:
        found.append(companion(STIFFER, base, own | {"contact.stiffness": 2.0 * stiffness}))
    if isinstance(case.model, ReducedModel) and case.model.rings:
        left_out.append('the deformation of the sections, which sections = "rigid" leaves out')
    elif _on_lines(case):
        left_out.append("the deformation of the sections, which stay round where they meet flat walls along lines")
    if case.mesh.file is not None:
        left_out.append("the mesh, which is given by a file")
    else:
        left_out += _why_no_finer(case, plane, even)
        fine, rigid = _finer(case, plane, even), isinstance(case.model, RigidModel)  # which has no mesh
        if fine is not None:
            found.append(companion(FINEST, 0.5 if thorough else 1.0 if rigid else base, fine))
        coarse = companion(COARSER, base, mesh_keys(case, 2.0, plane, even) | {"model": _model(case, 0.5)})
        if thorough or (not rigid and sum(one.steps for one in [*found, coarse]) <= MOST_STEPS):
            found.append(coarse)
    return CompanionPlan(tuple(found), plane, tuple(left_out), records)


def _finer(case: Case, plane: bool, even: bool) -> dict[str, Any] | None:
    """Return the keys of the finest companion; None: there is none, as `_why_no_finer` says."""
    if _too_many_cells(case, plane, even):
        return None
    if case.mesh.dimension == 2 or plane:
        return mesh_keys(case, 0.5, plane, even) | {"model": _finest(case)}
    if isinstance(case.model, ReducedModel) and case.model.rings:
        own, rings = _model(case, None), case.model.rings
        finer = {"modes": max(own["modes"], FINEST_MODES), "stations": min(rings + rings // 2, MOST_STATIONS)}
        return {"model": own | finer}
    simpler = isinstance(case.model, BeamModel | RigidModel)  # what they leave out of the solid is an error of theirs
    solid = simpler and not _contact_of_basis(case) and not _needs_two_bases(case)
    if not solid:
        return None
    points = min(case.contact.quadrature_degree or FEW_POINTS, FEW_POINTS)  # steps cost the square of their number
    return {"model": _finest(case), "contact.quadrature_degree": points}


def _needs_two_bases(case: Case) -> bool:
    """Return True for a solid without a basis for the supports: circles and lines need rigid sections, planes none."""
    rigid = any(face.circle for face in case.layout.faces) or _on_lines(case)
    return rigid and not all(len(one.sides) > 1 and meets_sections(case, one) for one in case.layout.supports)


def _too_many_cells(case: Case, plane: bool, even: bool) -> bool:
    return int(mesh_keys(case, 0.5, plane, even)["mesh.cells_through_thickness"]) > MOST_CELLS


def _why_no_finer(case: Case, plane: bool, even: bool) -> list[str]:
    """Return the errors that no finest companion shows, with reasons."""
    if _too_many_cells(case, plane, even):
        return [f"a finer mesh, which would have more than {MOST_CELLS} cells through the thickness"]
    if case.mesh.dimension == 2 or plane:
        return []
    sliceable = case.profile.sliceable(case.beam.width)
    why = "the motion is not in the bending plane" if sliceable else "the section has no slice"
    words = [f"a finer mesh: {why}, and finer solids are expensive"]
    if isinstance(case.model, BeamModel | RigidModel) and _needs_two_bases(case):
        words.append("what the model leaves out of a solid, which has no basis for both rigid sections and planes")
    elif isinstance(case.model, BeamModel | RigidModel) and _contact_of_basis(case):
        words.append("what the model leaves out of a solid, which friction and exact formulations make expensive")
    return words


def _in_bending_plane(case: Case) -> bool:
    """Return True where loads, contact points, probes and mesh of a solid keep its results in the bending plane."""
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
            own: dict[str, Any] = {"type": "beam", "elements": max(2, round(beam.elements * (refinement or 1.0)))}
            own |= {"spacing": beam.spacing} if beam.graded else {}
            return own | ({"stations": beam.stations} if beam.stations else {})
        case _:
            return {key: value for key, value in case.model.model_dump().items() if value is not None}


def _finest(case: Case) -> dict[str, Any]:
    """Return the richest basis, with which models of beam elements and rigid bodies are compared, too."""
    shapes = min(FINEST_SHAPES, max(FEWEST_SHAPES, MOST_OF_ALL // max(1, len(case.layout.faces))))
    if isinstance(case.model, ReducedModel):
        own = _model(case, None)
        return own | {"modes": max(own["modes"], FINEST_MODES), "shapes": max(own["shapes"], shapes)}
    stations = {"stations": min(2 * case.model.rings, MOST_STATIONS)} if _on_lines(case) and case.model.rings else {}
    if stations and isinstance(case.model, BeamModel) and case.model.graded:  # a solid would be far too large
        return _model(case, 2.0) | stations
    richest = {"type": "reduced", "modes": FINEST_MODES, "shapes": shapes}
    if stations or any(face.circle for face in case.layout.faces):
        richest["sections"] = "rigid"
    return richest | stations | _contact_of_basis(case)


def _on_lines(case: Case) -> bool:
    """Return True where sections meet flat walls along lines."""
    return any(radius is not None for radius in line_radii(case))


def _contact_of_basis(case: Case) -> dict[str, Any]:
    """Return whether a basis keeps every interface DOF: for friction, and formulations that hold constraints."""
    exact = not case.contact.formulation.follows_the_law and case.contact.formulation.stress_terms is None
    return {"contact": "all"} if exact or case.friction is not None else {}


def words_of_failed(failed: Mapping[str, str]) -> list[str]:
    """Return the warnings of companions without a motion: their names with the reason."""
    return [f"the comparison run with {one} failed, and its errors are left out: {why}" for one, why in failed.items()]
