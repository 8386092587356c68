"""The scene of a case: its reduced model as a structure, its contact points as contacts, its loads as loads.

A scene has what moves, not what a run judges with: no mesh, gates or error estimates. What a scene has no noun for is
refused by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import nan
from typing import Any

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import NO_DAMPER
from gapbeam.solver.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.convex_region import HalfPlane
from gapbeam.solver.scene.force_law import ForceLaw
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import Load
from gapbeam.solver.scene.shipped_laws import HuntCrossley, KelvinVoigt
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array

UP = -1
"""Component of a probe that its point has: across the beam, in the bending plane."""


class _Walls:
    """How far walls have moved outward from all contact points, computed once a time."""

    def __init__(self, opened: Callable[[float], Array], size: int) -> None:
        self._opened, self._size = opened, size
        self._time = nan
        self._gaps: Array = np.zeros(size)

    def at(self, place: int, time: float) -> float:
        """Return it for one contact point, m."""
        if time != self._time:
            self._time, self._gaps = time, np.broadcast_to(self._opened(time), self._size)
        return float(self._gaps[place])


@dataclass(frozen=True)
class _Factor:
    """The function of time of a load, for arrays of any shape."""

    factors: Callable[[Array], Array]

    def __call__(self, times: Any) -> Array:
        return self.factors(np.ravel(times)).reshape(np.shape(times))


def scene_of_model(model: Model) -> Scene:
    """Return the scene of a model.

    The structure is called "beam" and has the probes as points, each with its motion across the beam. Each contact
    point is a contact, called after its face, with a number where the face has several. Loads keep their names.

    Raises:
        UserError: The case has what a scene has no noun for; all of it in the message.
    """
    refused = list(_refusals(model))
    if refused:
        raise UserError("no scene of this case: " + "; ".join(refused))
    system, contact = model.system, model.system.contact
    operators = system.operators
    assert isinstance(operators, DenseOperators)
    n = operators.size
    damping = system.mass_damping * operators.mass + system.stiffness_damping * operators.stiffness
    if system.dashpots is not None:
        damping = damping + system.dashpots.matrix
    unit = np.eye(n)
    points = {name: probe.evaluate(unit, operators)[:, UP] for name, probe in model.probes.items()}
    beam = Structure(operators.mass, operators.stiffness, damping, points, name="beam")
    rows = np.zeros((contact.size, n))
    rows[:, contact.interface.owned] = contact.gap_matrix.toarray()[:, contact.interface.slots]
    laws = _laws(model.law, contact.weights)
    walls = _Walls(contact.walls.opened, contact.size)
    numbers = np.zeros(len(contact.face_names), dtype=int)
    contacts = []
    for i, face in enumerate(contact.faces):
        name, alone = contact.face_names[face], len(contact.points_of_faces[face]) == 1
        numbers[face] += 1
        wall = partial(walls.at, i) if contact.walls.motions else None
        where = beam.point(-rows[i], name)
        region = HalfPlane(float(contact.initial_gap[i]))
        label = name if alone else f"{name} {numbers[face]}"
        contacts.append(Contact(where, region, laws[i], wall=wall, name=label))
    loads = [Load(beam, one.pattern, _Factor(one.factors), name=one.name) for one in system.loads]
    return Scene(beam, contacts=contacts, loads=loads)


def _refusals(model: Model) -> Iterator[str]:
    """Yield what a scene has no noun for, in words of the case file."""
    system, contact, law = model.system, model.system.contact, model.law
    if not isinstance(system.operators, DenseOperators):
        yield 'a full model has its mesh; choose [model] type = "reduced", "beam" or "rigid"'
    elif system.contact_is_massless:
        yield "contact points without mass move by the contact alone; leave out the redistribution of mass"
    if contact.turning is not None:
        yield 'supports met as circles; give them contact = "points"'
    if not contact.symmetric:
        yield 'Nitsche\'s method; choose [contact] formulation = "penalty"'
    if contact.rubbed is not None:
        yield "friction along the beam: a contact of a scene has its slip in the section plane"
    if law.keeps_set or law.why_not_compiled is not None:
        yield "a law that keeps a state or is piecewise; choose a spring with an exponent"
    if law.touch_product is not None:
        yield "damping that follows from the speed at touch; choose contact.damping"
    elif law.damper.law not in (NO_DAMPER.law, "hunt-crossley"):
        yield f'the damper of the law "{law.damper.law}"'
    elif law.damper.law == NO_DAMPER.law and law.spring.exponent != 1.0 and np.any(law.damper.coefficient):
        yield "a constant damper beside a spring with an exponent"
    if law.adhesive:
        yield "a law that pulls; set contact.adhesive = false"
    if law.augmented is not None:
        yield "augmented multipliers; choose the penalty alone"


def _laws(law: ContactLaw, weights: Array) -> list[ForceLaw]:
    """Return the law of each contact point, of forces: the area of the point times the law of pressures."""
    stiffness = np.broadcast_to(law.spring.stiffness, weights.shape) * weights
    coefficient = np.broadcast_to(law.damper.coefficient, weights.shape)
    if law.spring.exponent == 1.0 and law.damper.law == NO_DAMPER.law:
        pairs = zip(stiffness, coefficient * weights, strict=True)
        return [KelvinVoigt(stiffness=float(k), damping=float(c)) for k, c in pairs]
    pairs = zip(stiffness, coefficient, strict=True)
    return [HuntCrossley(float(k), float(chi), law.spring.exponent) for k, chi in pairs]
