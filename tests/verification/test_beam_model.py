"""Beam elements against closed forms, and against the plane finite elements that they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from gapbeam.solver.case.case import Case
from gapbeam.solver.models.timoshenko_beam import SteppedBeam, TimoshenkoBeam, of_elements
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.models import BEAM, GRAVITY, beam_case, beam_model, bending_frequencies, face_forces, seat_of
from tests.verification.test_reduction import LOADS, PROBES, apart, tip_motion


def prismatic(case: Case, elements: int) -> TimoshenkoBeam:
    """Return the beam of a case without segments."""
    (part,) = SteppedBeam.of_case(case, elements).parts
    return part


STOCKY = prismatic(beam_case({"beam": {**BEAM["beam"], "length": 0.1}, "support": {"length": 0.02}}), 80)


def frequencies(operators: DenseOperators, held: int = 0) -> np.ndarray:
    """Return the frequencies of a beam with its first DOFs held, rigid ones left out, Hz."""
    squares = eigh(operators.stiffness[held:, held:], operators.mass[held:, held:], eigvals_only=True)
    return np.sqrt(squares[squares > 1e-6 * squares[5]]) / (2.0 * np.pi)


def free_free(beam: TimoshenkoBeam, guess: float) -> float:
    """Return the first symmetric frequency of a free Timoshenko beam near a guess, Hz, from its equation of motion.

    w = a cosh(p x) + b cos(q x) about the middle, with moment and shear force zero at the ends; p and q follow from
    (E I p^2 + rho I om^2 - kappa G A) Theta = -kappa G A w' and its partner (Huang 1961).
    """
    half = 0.5 * beam.length

    def condition(frequency: float) -> float:
        om2 = (2.0 * np.pi * frequency) ** 2
        # E I w'''' + (rho I + rho A E I / kappa G A) om2 w'' + (rho I rho A om2^2 / kappa G A - rho A om2) w = 0
        second = (beam.inertia + beam.mass * beam.bending / beam.shear) * om2 / beam.bending
        last = (beam.inertia * beam.mass * om2 / beam.shear - beam.mass) * om2 / beam.bending
        root = np.sqrt(second**2 - 4.0 * last)
        p, q = np.sqrt(0.5 * (root - second)), np.sqrt(0.5 * (root + second))
        # theta from shear equilibrium, kappa G A (w'' - theta') + rho A om2 w = 0
        turn_p = p + beam.mass * om2 / (beam.shear * p)
        turn_q = -q + beam.mass * om2 / (beam.shear * q)
        moment = np.array([turn_p * p * np.cosh(p * half), turn_q * q * np.cos(q * half)])
        shear = np.array([(p - turn_p) * np.sinh(p * half), (-q - turn_q) * np.sin(q * half)])
        return float(moment[0] * shear[1] - moment[1] * shear[0])

    return float(brentq(condition, 0.97 * guess, 1.03 * guess, xtol=1e-10))


def test_a_cantilever_bends_exactly() -> None:
    operators = of_elements([STOCKY]).dense
    force = np.zeros(operators.size)
    force[-2] = 1.0
    moved = np.linalg.solve(operators.stiffness[2:, 2:], force[2:])
    length = STOCKY.length
    assert moved[-2] == pytest.approx(length**3 / (3.0 * STOCKY.bending) + length / STOCKY.shear, rel=1e-9)
    assert moved[-1] == pytest.approx(length**2 / (2.0 * STOCKY.bending), rel=1e-9)


def test_rigid_motions_cost_no_energy_and_have_the_mass_of_the_beam() -> None:
    operators, x = of_elements([STOCKY]).dense, np.linspace(0.0, STOCKY.length, STOCKY.elements + 1)
    shift, turn = np.tile([1.0, 0.0], len(x)), np.stack([x, np.ones_like(x)], axis=1).reshape(-1)
    for motion in (shift, turn):
        assert np.abs(operators.stiffness @ motion).max() < 1e-9 * np.abs(operators.stiffness).max()
    length = STOCKY.length
    assert shift @ operators.mass @ shift == pytest.approx(STOCKY.mass * length)
    assert turn @ operators.mass @ turn == pytest.approx(STOCKY.mass * length**3 / 3.0 + STOCKY.inertia * length)


def test_free_frequencies_are_those_of_the_timoshenko_equation() -> None:
    found = frequencies(of_elements([STOCKY]).dense)
    assert found[0] == pytest.approx(free_free(STOCKY, found[0]), rel=2e-5)
    assert found[2] == pytest.approx(free_free(STOCKY, found[2]), rel=4e-4)
    slender = 4.7300407448627**2 / (2.0 * np.pi * STOCKY.length**2) * np.sqrt(STOCKY.bending / STOCKY.mass)
    assert found[0] < 0.98 * slender  # Euler and Bernoulli's beam is stiffer


def test_a_slender_cantilever_has_the_frequencies_of_euler_and_bernoulli() -> None:
    thin = prismatic(beam_case({"beam": {**BEAM["beam"], "thickness": 0.001}}), 60)
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    wanted = roots**2 / (2.0 * np.pi * thin.length**2) * np.sqrt(thin.bending / thin.mass)
    assert frequencies(of_elements([thin]).dense, held=2)[:3] == pytest.approx(wanted, rel=2e-4)


def test_frequencies_are_those_of_plane_stress() -> None:
    plane = bending_frequencies(beam_model({"mesh": {**BEAM["mesh"], "size": 0.01}}), 3)
    beam = prismatic(beam_case(), 102)
    assert frequencies(of_elements([beam]).dense)[:3] == pytest.approx(plane, rel=5e-4)


def test_the_seat_carries_the_weight_at_its_edges() -> None:
    model = beam_model({"model": {"type": "beam"}}, (GRAVITY,), PROBES)
    state = seat_of(model).state
    forces = face_forces(model.system.contact, state.pressure)
    weight = 7919.0 * 0.51 * 0.012 * 0.02 * 9.81
    assert forces["base"] - forces["gland"] == pytest.approx(weight, rel=1e-6)
    # rigid statics with the gland pressing at x = 0 and the base at its edge: 38.986 N and 48.494 N
    assert forces["gland"] == pytest.approx(38.986, rel=0.03)
    # fields: the section stays plane and turns with the axis
    u = model.expand(state.u[VALUE]).reshape(-1, 2)
    places = model.space.tabulate_dof_coordinates()[:, :2]
    tip = np.isclose(places[:, 0], 0.51)
    slope = np.polyfit(places[tip, 1], u[tip, 0], 1)[0]
    near = np.isclose(places[:, 1], 0.0) & (places[:, 0] > 0.45)
    assert -slope == pytest.approx(np.polyfit(places[near, 0], u[near, 1], 1)[0], rel=0.02)


def test_beam_elements_rattle_like_plane_elements() -> None:
    contact = {"stiffness": 2e11}
    plane = beam_model({"contact": contact}, LOADS, PROBES)
    beam = beam_model({"contact": contact, "model": {"type": "beam"}}, LOADS, PROBES)
    assert apart(tip_motion(plane)[..., 1], tip_motion(beam)[..., 1]) < 0.03


def test_plane_strain_stiffens_the_beam() -> None:
    strain = prismatic(beam_case({"mesh": {**BEAM["mesh"], "plane": "strain"}}), 4)
    assert strain.bending == pytest.approx(prismatic(beam_case(), 4).bending / (1.0 - 0.3**2))
