"""Seats of reduced models whose faces hold many points: the quick solve by interface DOFs must not cost them."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.models.model import build_model
from gapbeam.studies.trials.starts import seated

CLAMPED = Path(__file__).parents[2] / "cases" / "clamped.toml"


def test_an_interference_fit_on_many_soft_points_is_found_and_carries_the_weight():
    settings = {
        "model.type": "reduced",
        "contact.stiffness": 4.56e10,
        "mesh.support_size": 1.25e-3,
        "mesh.edge_size": 1.25e-3,
    }
    model = build_model(read_case(CLAMPED, settings), MPI.COMM_SELF)
    assert model.system.contact.size > 300

    state = seated(model).state

    contact = model.system.contact
    forces = contact.weights * state.pressure
    base = contact.faces == contact.face_names.index("base")
    weight = 0.51 * 0.02 * 0.012 * 7919.0 * 9.81
    assert float(np.sum(forces[base]) - np.sum(forces[~base])) == pytest.approx(weight, rel=1e-8)
    assert state.pressure == pytest.approx(4.56e10 * np.maximum(state.depth, 0.0), rel=1e-6)
