"""Seats of reduced models whose faces hold many points: the quick solve by interface DOFs must not cost them."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.studies.trials.starts import seated

CLAMPED = Path(__file__).parents[2] / "cases" / "clamped.toml"


def test_an_interference_fit_on_many_soft_points_is_found_and_carries_the_weight():
    settings = {
        "model.type": "reduced",
        "model.points_across": "all",
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


WEIGHTLESS = """
title = "a soft, nearly incompressible and nearly weightless beam"
[beam]
length = 0.9502
thickness = 0.0174669
width = 0.00977972
[material]
young_modulus = 152500000.0
poisson_ratio = 0.4999
density = 1.0
[support]
length = 0.4751
clearance = 0.0174669
[mesh]
dimension = 2
plane = "strain"
cell = "triangle"
size = 0.0158367
support_size = 0.118775
cells_through_thickness = 3
[model]
type = "reduced"
interface = "free"
modes = 8
[[load]]
type = "gravity"
acceleration = 1e-06
[[probe]]
name = "root"
point = 0.0
[time]
step = 0.00216
end = 0.864
"""


def test_springs_of_the_search_are_not_lost_in_round_off(tmp_path: Path) -> None:
    """The weight asks for springs far below the round-off of the stiffness: the seat carries the weight."""
    path = tmp_path / "case.toml"
    path.write_text(WEIGHTLESS, encoding="utf-8")
    model = build_model(read_case(path), MPI.COMM_SELF)
    state = seated(model).state
    contact = model.system.contact
    forces = contact.weights * state.pressure
    base = contact.faces == contact.face_names.index("base")
    weight = 0.9502 * 0.0174669 * 0.00977972 * 1e-6
    assert float(np.sum(forces[base]) - np.sum(forces[~base])) == pytest.approx(weight, rel=1e-2)


def test_what_is_not_positive_definite_is_reported() -> None:
    """No trace of the linear algebra: what hides, and what to try."""
    operators = DenseOperators(np.eye(2), np.diag([1.0, -1e-3]))
    with pytest.raises(NotConverged, match=r"round-off hides what holds the beam.*restraint\.axial"):
        operators.factor(0.0, 1.0)
