"""A beam that rests on a wall beside a hole that it does not touch: the seat is that of statics.

Nothing but the weak restraint holds the beam aside there, so that round-off moves it along the wall.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.models.model import build_model
from gapbeam.studies.trials.starts import seated

WALLS = {"type": "polygon", "walls": [0.0, 90.0, 180.0, -90.0], "recesses": [0.0, 1e-5, 2e-5, 0.0]}
LENGTH, DENSITY, DIAMETER, WALL = 1.1365, 2700.0, 0.035555, 0.0035555
AREA = np.pi * (DIAMETER - WALL) * WALL


def balanced(start: float, slot: float, hole: float, law: dict[str, Any], tilt: float) -> dict[str, Any]:
    """Return a tube on one wall near its middle, with a slot that keeps it from tipping and an open hole behind."""
    power = law["exponent"] > 1.0
    return {
        "beam": {
            "length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL},
        },
        "material": {"young_modulus": 3e9, "poisson_ratio": 0.0, "density": DENSITY},
        "support": [
            {"name": "wall", "from": start, "to": start + 0.01894, "clearance": 2e-4, "region": WALLS, "offset": 5e-5},
            {"name": "slot", "from": slot, "to": slot + 0.01894, "clearance": 1e-4},
            {
                "name": "hole", "from": hole, "to": hole + 0.0189, "clearance": 2e-4, "lateral": 7.9e-5, "tilt": tilt,
                "region": {"type": "hole", "contact": "circle"},
            },
        ],
        "mesh": {"dimension": 3, "size": 0.14, "support_size": 0.0189, "cells_through_thickness": 2},
        "model": {"type": "beam", "elements": 24},
        "contact": {"law": law, "stiffness": 1e15 if power else 1e12},
        "load": [{"type": "gravity"}, {"type": "base_motion", "amplitude": 4.8, "frequency": 18.8}],
        "time": {"end": 1e-3, "step": 1e-4},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("start", "slot", "hole", "law", "tilt"),
    [
        (0.56825, 0.85237, 1.0418, {"type": "lankarani-nikravesh", "restitution": 0.8, "exponent": 1.5}, -4.2e-4),
        (0.57, 0.8, 1.0, {"type": "hunt-crossley", "restitution": 0.5, "exponent": 1.0}, 0.0),
        (0.58, 0.9, 1.1, {"type": "hunt-crossley", "restitution": 0.5, "exponent": 1.5}, 3e-4),
    ],
)
def test_a_tube_beside_an_open_hole_rests(start: float, slot: float, hole: float, law: Any, tilt: float) -> None:
    """Forces up and down carry the weight, and their moments about x = 0 its moment."""
    model = build_model(gapbeam.read_case(balanced(start, slot, hole, law, tilt)), MPI.COMM_SELF)
    found = seated(model)
    contact = model.system.contact
    forces = found.state.pressure * contact.weights
    names = np.array(contact.face_names)[contact.faces]
    up = np.where(names == "slot_above", -forces, forces)
    weight = DENSITY * AREA * LENGTH * 9.81
    assert float(forces[names == "hole_hole"].sum()) == 0.0
    assert float(up.sum()) == pytest.approx(weight, rel=2e-3)
    assert float(up @ contact.positions[:, 0]) == pytest.approx(0.5 * weight * LENGTH, rel=2e-3)
