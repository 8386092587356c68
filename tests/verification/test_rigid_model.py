"""The beam as a rigid body: momentum, bouncing and rocking in closed form, and a two-DOF model integrated by SciPy."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.integrators.scheme_choice import USUAL, scheme_of
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated
from tests.shared.case_texts import GOOD, written
from tests.shared.command import alone, on_ranks
from tests.shared.models import BEAM, GRAVITY, SOLID, beam_model, out_of_reach, seat_of
from tests.shared.passages import followed
from tests.shared.toys import steps_of

LENGTH, DEPTH, WIDTH, DENSITY = 0.51, 0.012, 0.02, 7919.0
MASS = DENSITY * LENGTH * DEPTH * WIDTH
INERTIA = MASS * (LENGTH**2 + DEPTH**2) / 12.0
RIGID: dict[str, Any] = {"model": {"type": "rigid"}}
PUSH = {"type": "harmonic_force", "amplitude": 20.0, "frequency": 20.0}


def still(model: Model, heave: float = 0.0, turning: float = 0.0) -> State:
    """The undeformed body with a speed of its middle (m/s), turning (rad/s)."""
    operators, contact, space = model.system.operators, model.system.contact, model.space
    x, dimension = space.tabulate_dof_coordinates(), model.case.mesh.dimension
    v = np.zeros((len(x), dimension))
    v[:, -1] = heave + turning * (x[:, 0] - 0.5 * LENGTH)
    v[:, 0] = -turning * x[:, dimension - 1]
    q = np.linalg.lstsq(np.asarray(model.body.expansion), v.reshape(-1))[0]
    depth = contact.depth(np.zeros(contact.interface.size))
    return State(0.0, imaged(operators, np.zeros_like(q)), imaged(operators, q), depth, np.zeros(contact.size))


def probed(model: Model, x: np.ndarray) -> np.ndarray:
    """The first probe in the bending direction."""
    return np.asarray(next(iter(model.probes.values())).evaluate(x, model.system.operators)[..., -1])


@pytest.mark.parametrize(("mesh", "motions"), [({}, 3), (SOLID, 2), ({**SOLID, "cell": "tetrahedron"}, 6)])
def test_mass_and_inertia_are_those_of_the_block(mesh: dict[str, Any], motions: int) -> None:
    """Kinetic energies of heave and pitch; a symmetric solid keeps these two."""
    model = beam_model({**RIGID, "mesh": {**BEAM["mesh"], **mesh}}, (GRAVITY, {**PUSH, "point": 0.15}))
    assert model.dofs == motions
    for state, energy in ((still(model, heave=2.0), 2.0 * MASS), (still(model, turning=3.0), 4.5 * INERTIA)):
        assert 0.5 * state.v[VALUE] @ state.v[1] == pytest.approx(energy, rel=1e-9)


def test_a_force_moves_and_turns_the_free_body() -> None:
    """M a = F and I alpha = F s at any place: u = F/w (t - sin(w t)/w) (1/M + s r/I) for F sin(w t)."""
    model = beam_model(RIGID, ({**PUSH, "point": 0.15},), {"test": 0.37})
    model = replace(model, system=out_of_reach(model.system, 10.0))
    dt, omega = 1.0e-4, 2.0 * pi * 20.0
    steps = steps_of(model.system, model.law, scheme_of("discrete-gradient"), still(model), dt, 500)
    times = dt * np.arange(1, 501)
    share = 1.0 / MASS + (0.15 - 0.255) * (0.37 - 0.255) / INERTIA
    expected = 20.0 / omega * (times - np.sin(omega * times) / omega) * share
    found = np.array([probed(model, step.new.u[VALUE]) for step in steps])
    # the axial restraint, half a thickness off the axis, holds pitch back by 1e-3 in this time
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


def test_rocking_between_faces_that_stay_closed() -> None:
    """Two frequencies of a rigid bar on an elastic foundation: 2 k A in heave at x = 25 mm, 2 k A L^2/12 about it."""
    k, area, arm = 1.0e9, 0.05 * WIDTH, 0.025 - 0.255
    model = beam_model(RIGID, (GRAVITY,))
    heave, turn = 2.0 * k * area, 2.0 * k * area * (arm**2 + 0.05**2 / 12.0)
    stiffness = np.array([[heave, heave * arm], [heave * arm, turn]])
    expected = np.linalg.eigvals(np.diag([1.0 / MASS, 1.0 / INERTIA]) @ stiffness).real
    found = np.linalg.eigvalsh(model.system.contact.springs(k).matrix.toarray())[-2:]
    assert found == pytest.approx(np.sort(expected), rel=1e-9)


def impact(depth: float, rate: float) -> float:
    """The IMPACT function of ADAMS, max(0, K d^2.2 + step(d) c d'), with Table 2 of the paper and d_max of its text."""
    if depth <= 0.0:
        return 0.0
    share = min(depth / FULL, 1.0)
    return max(STIFFNESS * depth**2.2 + DAMPING * share**2 * (3.0 - 2.0 * share) * rate, 0.0)


STIFFNESS, DAMPING, FULL, GAP = 1.0e5 * 1.0e3**2.2, 1.0e4, 1.0e-5, 0.107e-3
ADAMS: dict[str, Any] = {
    **RIGID,
    "support": {"length": 0.05, "clearance": GAP},
    "contact": {
        "stiffness": STIFFNESS,
        "points": [0.0, 0.05],
        "patch": 0.005,
        "law": {"type": "adams-impact", "exponent": 2.2, "damping": DAMPING, "full_depth": FULL},
    },
    "time": {"end": 0.1, "step": 1.0e-5},
}


def test_the_beam_of_adams_agrees_with_two_equations_of_motion() -> None:
    """IMPACT at both ends of both faces from the seat; heave and pitch by SciPy's DOP853."""
    model = beam_model(ADAMS, (GRAVITY, {**PUSH, "point": 0.15}), {"start": 0.0, "end": 0.51})
    seat = seat_of(model).state
    contact, weight = model.system.contact, MASS * 9.81
    places = np.unique(np.round(contact.positions[:, 0], 12))
    assert places == pytest.approx([0.005 / 6.0, 0.05 - 0.005 / 6.0], rel=1e-3)  # means of half hats
    forces = contact.weights * seat.pressure
    gland = forces[contact.faces == contact.face_names.index("gland")].sum()
    assert gland == pytest.approx(weight * (0.255 - places[1]) / (places[1] - places[0]), rel=1e-3)
    ends = [probe.evaluate(seat.u[VALUE], model.system.operators)[-1] for probe in model.probes.values()]
    pitch = (ends[1] - ends[0]) / LENGTH
    rolling = 1.0e3 * (0.5 * DEPTH) ** 2  # N m/rad of the axial restraint, half a thickness off the axis

    def rates(time: float, state: np.ndarray) -> list[float]:
        y, turn, v, spin = state
        shaken = 20.0 * float(np.sin(2.0 * pi * 20.0 * time))
        push, moment = shaken - weight, shaken * (0.15 - 0.255) - rolling * turn
        for x in places - 0.255:
            here, speed = y + turn * x, v + spin * x
            force = impact(-here, -speed) - impact(here - GAP, speed)
            push, moment = push + force, moment + x * force
        return [v, spin, push / MASS, moment / INERTIA]

    times = 1.0e-5 * np.arange(1, 10001)
    start = [0.5 * (ends[0] + ends[1]), pitch, 0.0, 0.0]
    exact = solve_ivp(rates, (0.0, 0.1), start, "DOP853", t_eval=times, rtol=1e-9, atol=1e-12)
    expected = exact.y[0] + exact.y[1] * 0.255
    plan = March(
        model.system,
        model.law,
        USUAL,
        EffectiveOperators(model.system, USUAL),
        1.0e-5,
        10000,
    )
    tip = model.probes["end"].matrix[-1:]  # type: ignore[attr-defined]
    passage = followed(CompiledLoop(plan), seat, 10000, tip)
    assert passage.forces.max() > 100.0
    assert np.abs(passage.probes[:, 0] - expected).max() < 2e-3 * np.ptp(expected)


def test_from_the_undeformed_pose_the_beam_falls_to_its_seat() -> None:
    """Without forcing, contact damping leaves it where the search for the seat puts it; gravity has done the work."""
    asked = {"analysis": {"type": "transient", "start": "undeformed"}, "time": {"end": 0.4, "step": 2.0e-5}}
    model = beam_model({**ADAMS, **asked}, (GRAVITY,), {"end": 0.51})
    begin = seated(model)
    assert begin.word == "undeformed"
    assert not np.any(begin.state.u)
    response = respond(model, begin.state, 20000, 2.0e-3)
    assert response.verdict == "passed"
    place = response.history["displacement"][:, 0, 1]
    assert place[0] == 0.0
    assert place[-1] == pytest.approx(probed(model, seat_of(model).state.u[VALUE]), rel=1e-4)
    assert place.min() < 1.05 * place[-1] < 0.0, "it did not fall"
    left = [response.history[name][-1].sum() for name in ("load_work", "contact_energy", "contact_dissipation")]
    assert left[2] == pytest.approx(left[0] - left[1], rel=1e-3)


@pytest.mark.slow(minutes=0.3)
@alone
def test_ranks_agree_on_a_solid(tmp_path: Path) -> None:
    """A tetrahedral mesh keeps its six motions; a run on two ranks writes what one writes."""
    text = GOOD.replace(
        "dimension = 2\ndegree = 2",
        'dimension = 3\ndegree = 1\ncell = "tetrahedron"\nsize = 0.06\nsupport_size = 0.0125',
    )
    text = text.replace("end = 0.6", "end = 0.01").replace('stiffness = "auto"', "stiffness = 1e9")
    case = written(tmp_path, text.replace("[time]", '[model]\ntype = "rigid"\n\n[time]'))
    lateral = "restraint.lateral=1e6"
    assert gapbeam.run(case, [lateral], tmp_path / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", tmp_path / "2", "--set", lateral)
    assert done.returncode == 0, done.stderr
    one, two = (open_results(tmp_path / str(count)) for count in (1, 2))
    assert one.summary["model"]["dofs"] == 6
    assert one.summary["model"]["type"] == "rigid"
    for name in ("displacement", "contact_force", "kinetic_energy"):
        size = float(np.abs(one.history[name]).max())
        assert np.abs(one.history[name].values - two.history[name].values).max() < 1e-6 * size, name
    assert np.abs(one.history["strain_energy"].values).max() < 1e-9 * np.abs(one.history["load_work"].values).max()
