"""The impulses of contact points from records, against the pressures of every step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.diagnostics.point_contact import PointContact, by_face
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State
from tests.verification.test_rubbing_beam import SLICE

STEP, SPAN = 2.0e-5, 0.04  # s
LAWS: dict[str, dict[str, Any]] = {
    "undamped": {"law": "kelvin-voigt", "stiffness": 2.0e10},
    "kelvin-voigt": {"law": "kelvin-voigt", "stiffness": 2.0e10, "damping": 1.0e6},
    "hunt-crossley": {"law": {"type": "hunt-crossley", "restitution": 0.7}, "stiffness": 2.0e10},
}

EVERY = {1: 1.0e-9, 10: 1.0e-3}
"""Steps between records, and the share of the impulse of the face that a point may be off."""


@pytest.mark.parametrize("law", ["kelvin-voigt", pytest.param("hunt-crossley", marks=pytest.mark.slow(minutes=0.1))])
def test_shares_are_those_of_the_pressures(law: str) -> None:
    """A beam that is shaken in its slot: the impulse of each point, damped or not.

    With a record for every step it equals the impulse of the pressures to round-off, and their loads alone add up to
    the impulse of the face; with one for every tenth step the shares are rough.
    """
    tables = {"contact": LAWS[law], "model": {"type": "beam", "elements": 20}, "time": {"end": SPAN, "step": STEP}}
    model = build_model(gapbeam.read_case(SLICE | tables), MPI.COMM_SELF)
    contact, simulation = model.system.contact, Simulation(model)
    seat = simulation.seat().state
    wanted = np.zeros(contact.size)
    found = {every: PointContact(model.system, model.law) for every in EVERY}
    for number, state, pressed in _states(simulation, seat):
        wanted += contact.weights * pressed
        for every, points in found.items():
            if number % every == 0:
                points.see(np.array([state.time]), state.u[VALUE][None], state.v[VALUE][None])
    of_faces = by_face(contact, wanted)
    assert by_face(contact, found[1].load) == pytest.approx(of_faces, rel=1e-9)
    for every, most in EVERY.items():
        apart = np.abs(found[every].impulses(of_faces) - wanted) / of_faces[contact.faces]
        assert apart.max() < most


def _states(simulation: Simulation, seat: State) -> Iterator[tuple[int, State, Array]]:
    """Yield the number of each step, the state at its end and its pressure over time, (m,), Pa s, from the seat on."""
    yield 0, seat, np.zeros(len(seat.depth))
    for number, step in enumerate(simulation.march(seat)):
        yield number + 1, step.new, step.size * step.stage.pressure
