"""Modal damping: every mode has the damping asked for, and decays by it."""

from __future__ import annotations

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import march
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.semi_discrete import imaged
from tests.shared.case_texts import assert_says
from tests.verification.test_joints_and_masses import (
    DENSITY,
    HEAD,
    INERTIA,
    LENGTH,
    ROOT,
    THICKNESS,
    TIP,
    WIDTH,
    frequencies,
    joint,
    model_with,
    tables,
)

RATIO = 0.03


@pytest.mark.parametrize("kind", ["beam", "reduced"])
def test_every_mode_has_its_damping(kind: str) -> None:
    """C x = 2 z w M x for the modes of a beam with a joint and a mass."""
    head = {"name": "head", "point": TIP, "mass": HEAD, "rotary_inertia": INERTIA}
    model = model_with(joint(ROOT, "clamped"), damping={"ratio": RATIO}, model={"type": kind}, mass=[head])
    operators = model.system.operators
    assert isinstance(operators, DenseOperators)
    omega = 2.0 * np.pi * frequencies(model)
    for number in range(8):
        x = imaged(operators, np.ascontiguousarray(operators.modes[1][:, number]))
        force, expected = model.system.damping_force(x), 2.0 * RATIO * omega[number] * x[1]
        np.testing.assert_allclose(force, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_an_oscillator_decays() -> None:
    """A rigid beam on two springs from m g / k: its envelope falls as exp(-z w t)."""
    stiffness, gravity = 4.0e4, 9.81
    joints = [joint(place, "elastic", stiffness={"vertical": stiffness / 2.0}) for place in (ROOT, TIP)]
    case = tables(
        {"type": "rigid"},
        joint=joints,
        load=[{"type": "gravity", "acceleration": gravity}],
        damping={"ratio": RATIO},
        analysis={"type": "transient", "start": "undeformed"},
        time={"end": 0.2, "step": 2.0e-5},
    )
    simulation = gapbeam.model(gapbeam.read_case(case))
    operators, tip = simulation.model.system.operators, simulation.model.probes["tip"]
    states = [step.new for step in simulation.march()]
    heights = np.array([tip.evaluate(state.u[0], operators)[-1] for state in states])
    times = np.array([state.time for state in states])
    mass = DENSITY * LENGTH * THICKNESS * WIDTH
    omega = np.sqrt(stiffness / mass)
    damped = omega * np.sqrt(1.0 - RATIO**2)
    rest = mass * gravity / stiffness
    wave = np.cos(damped * times) + RATIO * omega / damped * np.sin(damped * times)
    theory = rest * (np.exp(-RATIO * omega * times) * wave - 1.0)
    assert np.abs(heights - theory).max() < 1e-4 * rest


def test_a_full_model_is_refused() -> None:
    """It has no modes at hand."""
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case(tables({"type": "full"}, damping={"ratio": 0.01}))
    assert_says(str(caught.value), ["0.01, with the model full", 'type = "reduced" in [model]'])


def test_without_a_model_it_implies_one_with_modes() -> None:
    """A case that says only its damping ratio is reduced; one that says its model keeps it."""
    given = tables({"type": "beam"}, damping={"ratio": 0.01})
    assert gapbeam.read_case(given).model.type == "beam"
    del given["model"]
    assert gapbeam.read_case(given).model.type == "reduced"
    del given["damping"]
    assert gapbeam.read_case(given).model.type == "full"


def test_modal_damping_costs_compiled_steps_nothing() -> None:
    """Dashpots of one mode each are part of the diagonal; a compiled march is that of step by step, to 1e-9."""
    head = {"name": "head", "point": TIP, "mass": HEAD, "rotary_inertia": INERTIA}
    fallen = {"type": "transient", "start": "undeformed"}
    model = model_with(
        joint(ROOT, "clamped"), damping={"ratio": RATIO}, model={"type": "beam", "elements": 12}, mass=[head],
        analysis=fallen, time={"end": 0.02, "step": 5.0e-5},
    )  # fmt: skip
    modal = modal_system(model.system)
    assert modal is not None
    assert len(modal.dashpots.coefficients) == 0
    assert modal.damping == pytest.approx(2.0 * RATIO * np.sqrt(modal.squares), rel=1e-6)
    simulation = Simulation(model)
    start = simulation.start(simulation.seat_or_failure())
    *_, last = CompiledLoop(simulation.plan).blocks(start)
    for step in march(simulation.plan, start):
        end = step.new
    assert last.end.u[0] == pytest.approx(end.u[0], abs=1e-9 * np.abs(end.u[0]).max())
