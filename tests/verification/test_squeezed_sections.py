"""Interference fits in models whose sections keep their shape: forces by Hooke's law, and beside those of the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import squeezed_stiffness
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import VALUE

YOUNG, POISSON = 2.1e11, 0.3
LENGTH, THICKNESS, WIDTH = 0.05, 0.012, 0.020
PLAY = -6.0e-6
BY_HAND = YOUNG * -PLAY / THICKNESS * LENGTH * WIDTH  # N


def fit(model: str, **changes: Any) -> Case:
    """Return the beam of the paper without play, a cantilever under its weight."""
    tables: dict[str, Any] = {
        "beam": {"length": 0.51, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": 7919.0},
        "support": {"length": LENGTH, "clearance": PLAY},
        "mesh": {"dimension": 2},
        "model": {"type": model},
        "load": [{"type": "gravity"}],
        "probe": [{"name": "tip", "point": 0.51}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    return gapbeam.read_case(tables | changes)


def at_rest(case: Case) -> tuple[float, float]:
    """Return the force on the base, N, and the motion of the tip, m."""
    model = build_model(case, MPI.COMM_SELF)
    state = Simulation(model).seat().state
    contact = model.system.contact
    base = (contact.weights * state.pressure)[contact.faces == 0]
    tip = np.asarray(model.probes["tip"].evaluate(state.u[VALUE], model.system.operators))[-1]
    return float(base.sum()), float(tip)


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_a_rigid_body_is_held_by_the_pressure_of_hooke(plane: str) -> None:
    """F = E' |c| / h times the area of a face; its weight moves 2.4 N from one face to the other."""
    case = fit("rigid", mesh={"dimension": 2, "plane": plane})
    held = 1.0 - POISSON**2 if plane == "strain" else 1.0
    assert at_rest(case)[0] == pytest.approx(BY_HAND / held, rel=1e-4)


def test_beam_elements_are_held_as_the_mesh_is() -> None:
    """Force within 2 % of the full model and of Hooke; the tip sags as in the full model within 3 %."""
    full, beam = at_rest(fit("full")), at_rest(fit("beam"))
    assert beam[0] == pytest.approx(BY_HAND, rel=0.02)
    assert beam == pytest.approx(full, rel=0.03)


UNKNOWN: dict[str, dict[str, Any]] = {
    "play": {"support": {"length": LENGTH, "clearance": 1.0e-4}},
    "given": {"contact": {"stiffness": 1.0e14}},
    "one of two with play": {
        "support": [
            {"name": "one", "from": 0.0, "to": 0.05, "clearance": PLAY},
            {"name": "two", "from": 0.4, "to": 0.43, "clearance": 1.0e-4},
        ]
    },
    "hollow": {
        "beam": {
            "length": 0.51,
            "thickness": THICKNESS,
            "width": WIDTH,
            "section": {"type": "box", "wall": 0.002},
        },
        "mesh": {"dimension": 3},
    },
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_other_contacts_keep_their_stiffness(name: str) -> None:
    """Supports with play, given stiffnesses, and sections that give way by another law."""
    assert squeezed_stiffness(fit("beam", **UNKNOWN[name])) is None
    assert squeezed_stiffness(fit("full")) is None
