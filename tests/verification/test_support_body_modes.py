"""Support bodies among the DOFs of a system: frequencies in contact, holes that give way, and what moves along."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.loads.load_choice import load_direction
from gapbeam.solver.models.model import with_support_bodies
from gapbeam.solver.supports.support import Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem, State
from tests.verification.test_own_contact import GRAVITY, LENGTH, MASS, PLACES, THICKNESS, tables
from tests.verification.test_support_bodies import SOFT_CONTACT, on_two


def closed(system: SemiDiscreteSystem, law: ContactLaw, state: State) -> np.ndarray:
    """Return K with the slopes of the contact in a state."""
    gap = system.contact.gap_matrix.toarray()
    slopes = system.contact.weights * law.static(state.depth).slope
    return np.asarray(system.operators.stiffness + gap.T @ (slopes[:, None] * gap))


def test_frequencies_in_steady_contact() -> None:
    """Bar and two bodies, seated: four frequencies of a system put together by hand."""
    bodies = [{"mass": 0.3, "stiffness": 4.0e4}, {"mass": 0.1, "stiffness": 1.0e4}]
    model = gapbeam.model(gapbeam.read_case(tables(on_two(bodies, stiffness=[SOFT_CONTACT] * 2)))).model
    seat = gapbeam.model(model.case).seat().state
    assert np.all(seat.pressure > 0.0)
    found = np.sqrt(eigh(closed(model.system, model.law, seat), model.system.operators.mass, eigvals_only=True))
    arms, contact = PLACES - 0.5 * LENGTH, 4.0e5
    inertia = MASS * (LENGTH**2 + THICKNESS**2) / 12.0
    rows = np.hstack([np.ones((2, 1)), arms[:, None], -np.eye(2)])
    stiffness = contact * rows.T @ rows + np.diag([0.0, 0.0, 4.0e4, 1.0e4])
    expected = np.sqrt(eigh(stiffness, np.diag([MASS, inertia, 0.3, 0.1]), eigvals_only=True))
    assert found[-4:] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("model", [{"type": "beam", "elements": 12}, {"type": "reduced", "modes": 6}])
def test_bending_frequencies_on_springs(model: dict[str, Any]) -> None:
    """Modes of a system put together by SciPy: its beam beside the bodies, which own contact springs couple to it."""
    bodies = [{"mass": 0.3, "stiffness": 4.0e4}, {"mass": 0.1, "stiffness": 1.0e4}]
    case = tables(on_two(bodies, stiffness=[SOFT_CONTACT] * 2), model=model)
    built = gapbeam.model(gapbeam.read_case(case)).model
    beam, contact = built.body.operators, built.body.contact
    size = beam.size
    masses, stiffness = np.eye(size + 2), np.zeros((size + 2, size + 2))
    masses[:size, :size], stiffness[:size, :size] = beam.mass, beam.stiffness
    masses[size:, size:], stiffness[size:, size:] = np.diag([0.3, 0.1]), np.diag([4.0e4, 1.0e4])
    for face in (0, 1):
        for point in np.flatnonzero(contact.faces == face):
            row = np.zeros(size + 2)
            row[:size] = contact.gap_matrix[point].toarray()[0]
            row[size + face] = -1.0
            stiffness += SOFT_CONTACT * contact.weights[point] * np.outer(row, row)
    expected = eigh(stiffness, masses, eigvals_only=True)
    state = gapbeam.model(built.case).seat().state
    found = eigh(closed(built.system, built.law, state), built.system.operators.mass, eigvals_only=True)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected[-1])


SPRUNG_HOLES = {
    "beam": {"length": LENGTH, "thickness": 0.02, "width": 0.02, "section": {"type": "tube", "wall": 2.0e-3}},
    "mesh": {"dimension": 3, "size": 0.1, "support_size": 0.025},
    "model": {"type": "beam", "elements": 10},
}


def holes() -> list[dict[str, Any]]:
    """Return two sprung holes without play at both ends."""
    body = {"mass": 0.2, "stiffness": 2.0e4, "damping": 3.0}
    both = (("left", 0.0, 0.05), ("right", LENGTH - 0.05, LENGTH))
    return [
        {"name": name, "from": start, "to": end, "clearance": 1.0e-4, "region": "hole", "body": body}
        for name, start, end in both
    ]


def test_a_hole_gives_way_sideways_too() -> None:
    """Gravity that leans by 45 degrees moves the bodies as far sideways as down: (m_b / 2 + m_s) g / (sqrt 2 k)."""
    load = [{"type": "gravity", "acceleration": GRAVITY, "direction": [0.0, 1.0, -1.0]}]
    simulation = gapbeam.model(gapbeam.read_case(tables(holes(), **(SPRUNG_HOLES | {"load": load}))))
    bodies = simulation.seat().state.u[VALUE][-4:]
    carried = 0.5 * simulation.model.case.profile.mass + 0.2
    sunk = carried * GRAVITY / np.sqrt(2.0) / 2.0e4
    assert bodies == pytest.approx([-sunk, sunk, -sunk, sunk], rel=1e-3)


SHAKER = {"type": "base_motion", "amplitude": 1.0, "frequency": 10.0, "direction": [0.0, 1.0, 0.0]}
WEIGHT_AND_SHAKER = [{"type": "gravity", "acceleration": GRAVITY}, SHAKER]


def test_a_frame_that_moves_takes_beam_and_bodies_along() -> None:
    """Weight and base motion, M^-1 f, move all mass alike, and change no gap in sprung holes."""
    case = tables(holes(), **(SPRUNG_HOLES | {"load": WEIGHT_AND_SHAKER}))
    model = gapbeam.model(gapbeam.read_case(case)).model
    contact, operators, size = model.system.contact, model.system.operators, model.body.operators.size
    assert operators.size == size + 4
    mass = operators.factor(1.0, 0.0)
    for load, moved in zip(model.system.loads, ([-1.0, 0.0], [0.0, -1.0]), strict=True):
        together = mass.solve(load.pattern)
        assert together[size:] == pytest.approx(moved * 2, abs=1e-12)
        assert np.abs(contact.gap_matrix @ together).max() < 1e-6
        assert np.abs(contact.gap_matrix[:, :size] @ together[:size]).max() > 0.9


def test_nothing_slips_around_a_hole_that_moves_along() -> None:
    """A point mass in a sprung hole: gap and slip on both sides of the contact, all around it."""
    support = [one | {"from": 0.0, "to": LENGTH} for one in holes()[:1]]
    case = gapbeam.read_case(tables(support, **(SPRUNG_HOLES | {"load": WEIGHT_AND_SHAKER})))
    turns = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    places = np.stack([np.full(8, 0.25), 0.01 * np.cos(turns), 0.01 * np.sin(turns)], axis=1)
    faces = Support(case.layout.faces, 1.0)
    opening = faces.opening(np.zeros(8, dtype=int), places)
    around = np.stack([np.zeros(8), -opening[:, 2], opening[:, 1]], axis=1)
    along = np.tile([1.0, 0.0, 0.0], (8, 1))
    three = Interface(3, np.arange(3), np.arange(3))
    contact = ContactOperator(
        three, csr_matrix(opening), np.ones(8), np.zeros(8), np.zeros(8, dtype=int), faces, places,
        tangents=csr_matrix(np.stack([along, around], axis=1).reshape(16, 3)),
    )  # fmt: skip
    patterns = [load_direction(load, 3) for load in case.load]
    loads = tuple(Load(one.name, along, lambda _t: 1.0) for one, along in zip(case.load, patterns, strict=True))
    system = with_support_bodies(case, SemiDiscreteSystem(DenseOperators(np.eye(3), np.eye(3)), contact, loads), 3)
    gap, slip = system.contact.gap_matrix, system.contact.tangents
    assert slip is not None
    for motion in ([0.0, 0.0, 1.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0, 1.0]):
        assert np.abs(gap @ np.array(motion)).max() < 1e-12
        assert np.abs(slip @ np.array(motion)).max() < 1e-12
        assert np.abs(slip[:, :3] @ np.array(motion[:3])).max() > 0.9
