"""The scene of a case: its reduced model as a structure, its contact points as contacts, its loads as loads.

A scene has what moves, not what a run judges with: no mesh, gates or error estimates. What a scene has no noun for is
refused by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import NO_DAMPER
from gapbeam.solver.contact.laws.mixed_law import MixedLaw
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.convex_region import Disc, HalfPlane
from gapbeam.solver.scene.force_law import ForceLaw
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import Load, sine, sine_of
from gapbeam.solver.scene.shipped_laws import HuntCrossley, KelvinVoigt
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.operators import Load as CaseLoad
from gapbeam.solver.system.semi_discrete import ContactOperator

if TYPE_CHECKING:
    from gapbeam.solver.case.case import Case
    from gapbeam.solver.models.model import Model

UP = -1
"""Component of a probe that its point has: across the beam, in the bending plane."""


class _Walls:
    """Motions of the walls at all contact points, computed once a time."""

    def __init__(self, contact: ContactOperator) -> None:
        self._contact, self._time = contact, nan
        self._opened: Array = np.zeros(contact.size)
        self._places: Array = np.zeros(0)

    def _move(self, time: float) -> None:
        if time != self._time:
            walls = self._contact.walls
            self._time, self._places = time, walls.places(np.array([time]))[0]
            self._opened = np.broadcast_to(walls.opened(time), self._contact.size)

    def outward(self, point: int, time: float) -> float:
        """Return the outward shift of the wall at a contact point, m."""
        self._move(time)
        return float(self._opened[point])

    def shift(self, shifts: Array, time: float) -> Array:
        """Return the shift of the middle of a hole, (2,), or of its clearance, m; shifts: by a unit of each motion."""
        self._move(time)
        return np.asarray(self._places @ shifts)


@dataclass(frozen=True)
class _Factor:
    """The function of time of a load, for arrays of any shape, times a scale that members may differ in."""

    factors: Callable[[Array], Array]

    def __call__(self, times: Any, scale: Any) -> Array:
        return np.asarray(self.factors(np.ravel(times)).reshape(np.shape(times)) * scale)


def scene_of_model(case: Case, model: Model) -> Scene:
    """Return the scene of the model of a case.

    The structure is called "beam" and has the probes as points, each with its motion across the beam. Each contact
    point is a contact, called after its face, with a number where the face has several. Loads keep their names, and
    have a "scale", 1 by default, which members of an ensemble may differ in.

    Raises:
        UserError: The case has what a scene has no noun for; all of it in the message.
    """
    refused = list(_refusals(case, model))
    if refused:
        raise UserError("no scene of this case: " + "; ".join(refused))
    if model.system.contact.measures_sliding:
        LOG.info("[wear] is left out: it is of runs, sweeps and lives, and does not change the motion")
    system = model.system
    operators = system.operators
    assert isinstance(operators, DenseOperators)
    n = operators.size
    damping = system.mass_damping * operators.mass + system.stiffness_damping * operators.stiffness
    if system.dashpots is not None:
        damping = damping + system.dashpots.matrix
    unit = np.eye(n)
    points = {name: probe.evaluate(unit, operators)[:, UP] for name, probe in model.probes.items()}
    beam = Structure(operators.mass, operators.stiffness, damping, points, name="beam")
    contacts = list(_contacts(model, beam))
    return Scene(beam, contacts=contacts, loads=[_load(beam, one) for one in system.loads])


def _load(beam: Structure, given: CaseLoad) -> Load:
    """Return a load of a case: its sine or its constant with their parameters, or its function of time."""
    made = _wave(beam, given)
    made.unit = given.unit
    return made


def _wave(beam: Structure, given: CaseLoad) -> Load:
    factor = given.factor
    if given.static:
        return Load(beam, given.pattern, sine, given.name, mean=float(factor(0.0)), scale=1.0)
    own = sine_of(factor)
    if own is not None:
        return Load(beam, given.pattern, sine, given.name, **own, scale=1.0)
    return Load(beam, given.pattern, _Factor(given.factors), given.name, scale=1.0)


def _contacts(model: Model, beam: Structure) -> Iterator[Contact]:
    """Yield the contact of each point: with a half plane, or of each station in a round hole: with a disc."""
    contact, circles = model.system.contact, model.system.contact.circles
    laws, walls = _laws(model.law, contact.weights), _Walls(contact)
    rows = _of_all(contact, contact.gap_matrix, beam.size)
    numbers, planes = np.zeros(len(contact.face_names), dtype=int), _of_all(contact, circles.plane, beam.size)
    stations = {int(point): k for k, point in enumerate(circles.points)}
    for i, face in enumerate(contact.faces):
        name, alone = contact.face_names[face], len(contact.points_of_faces[face]) == 1
        numbers[face] += 1
        label = name if alone else f"{name} {numbers[face]}"
        moves, k = bool(contact.walls.motions), stations.get(i)
        if k is None:
            wall = partial(walls.outward, i) if moves else None
            region, where = HalfPlane(float(contact.initial_gap[i])), beam.point(-rows[i], name)
            yield Contact(where, region, laws[i], wall=wall, name=label)
            continue
        moved = partial(walls.shift, circles.shifts[:, k, :2]) if moves and len(circles.shifts) else None
        opens = len(circles.shifts) and np.any(circles.shifts[:, k, 2])
        opening = partial(walls.shift, circles.shifts[:, k, 2]) if moves and opens else None
        region, where = Disc(float(circles.clearances[k])), beam.point(planes[2 * k : 2 * k + 2], name)
        offset = -circles.middles[k]
        yield Contact(where, region, laws[i], offset=offset, wall=moved, opening=opening, name=label)


def _of_all(contact: ContactOperator, matrix: csr_matrix, size: int) -> Array:
    """Return rows of interface values as rows of all DOFs, (rows, size)."""
    found = np.zeros((matrix.shape[0], size))
    found[:, contact.interface.owned] = matrix.toarray()[:, contact.interface.slots]
    return found


def _refusals(case: Case, model: Model) -> Iterator[str]:
    """Yield the parts of a case that scenes do not have, in words of the case file."""
    system, contact, law = model.system, model.system.contact, model.law
    if not case.time.scheme.conserves_energy:
        yield (
            f"the scheme {case.time.scheme.type}: scenes have their scheme from `march`; choose "
            'time.scheme = {type = "discrete-gradient"}'
        )
    if case.time.adaptive:
        yield "adaptive steps; set time.adaptive = false"
    if not isinstance(system.operators, DenseOperators):
        yield 'a full model has its mesh; choose [model] type = "reduced", "beam" or "rigid"'
    if not contact.symmetric:
        yield 'Nitsche\'s method; choose [contact] formulation = "penalty"'
    if contact.rubbed is not None:
        yield "friction along the beam: a contact of a scene has its slip in the section plane; leave friction out"
    laws = [law, *(one for _, one in law.groups)] if isinstance(law, MixedLaw) else [law]
    yield from dict.fromkeys(refusal for one in laws for refusal in _refusals_of_law(one))


LINEAR = 'choose law = "kelvin-voigt" at its support or in [contact], with a damping or a restitution'


def _refusals_of_law(law: ContactLaw) -> Iterator[str]:
    if law.bends or law.spring.law:
        yield f"a law that keeps a state or is piecewise; {LINEAR}"
    if law.touch_product is not None:
        yield f"damping that follows from the speed at touch; {LINEAR}"
    elif law.damper.law not in (NO_DAMPER.law, "hunt-crossley"):
        yield f'the damper of the law "{law.damper.law}"; {LINEAR}'
    elif law.damper.law == NO_DAMPER.law and law.spring.exponent != 1.0 and np.any(law.damper.coefficient):
        yield f"a constant damper beside a spring with an exponent; {LINEAR}"
    if law.adhesive:
        yield 'a law that pulls; set contact.tension = "clipped"'
    if law.augmented is not None:
        yield 'augmented multipliers; choose [contact] formulation = "penalty"'


def _laws(law: ContactLaw, weights: Array) -> list[ForceLaw]:
    """Return the law of each contact point, of forces: the area of the point times the law of pressures."""
    if isinstance(law, MixedLaw):
        made = {i: one for at, part in law.groups for i, one in zip(at, _laws(part, weights[at]), strict=True)}
        return [made[i] for i in range(len(weights))]
    stiffness = np.broadcast_to(law.spring.stiffness, weights.shape) * weights
    coefficient = np.broadcast_to(law.damper.coefficient, weights.shape)
    if law.spring.exponent == 1.0 and law.damper.law == NO_DAMPER.law:
        pairs = zip(stiffness, coefficient * weights, strict=True)
        return [KelvinVoigt(stiffness=float(k), damping=float(c)) for k, c in pairs]
    pairs = zip(stiffness, coefficient, strict=True)
    return [HuntCrossley(float(k), float(chi), law.spring.exponent) for k, chi in pairs]
