"""Supports with a mass, a spring and a damper: statics and impacts by hand, SciPy with events, limits, energy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import gapbeam
import gapbeam.solver.march.simulation
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.models.body import body_key
from gapbeam.solver.seat.start import start_of_case
from gapbeam.solver.system.semi_discrete import VALUE
from tests.verification.test_own_contact import AREA, GRAVITY, LENGTH, MASS, PLACES, stops, tables

BODY = {"mass": 0.3, "stiffness": 4.0e4, "damping": 6.0}
SOFT_CONTACT = 4.0e5 / AREA  # Pa/m: 4e5 N/m at a stop


def under_the_middle(body: dict[str, float] | None, **more: Any) -> dict[str, Any]:
    """Return one narrow stop below the center of the bar."""
    middle = 0.5 * LENGTH
    stop = {"name": "stop", "from": middle - 5.0e-4, "to": middle + 5.0e-4, "clearance": 0.0, "region": "stop"}
    return stop | ({} if body is None else {"body": body}) | more


def on_two(bodies: list[dict[str, float]], **own: Any) -> list[dict[str, Any]]:
    """Return two stops with bodies."""
    return [one | {"body": body} for one, body in zip(stops(**own), bodies, strict=True)]


def run(folder: Path, case: dict[str, Any], **more: Any) -> xr.Dataset:
    """Return the history of a case without error estimates."""
    case = case | {"output": {"errors": "none", "checkpoint_interval": 0.0, "fields_interval": case["time"]["end"]}}
    done = gapbeam.run(case | more, output=folder)
    assert done.exit_status == 0, done.message
    return gapbeam.open_results(folder).history


def test_each_body_sinks_by_what_it_carries_and_its_own_weight() -> None:
    """Q = -(m_b g / 2 + m_s g) / k at both stops, and the bar by R / K more; springs alike, so that nothing turns."""
    bodies = [{"mass": mass, "stiffness": 2.0e4} for mass in (0.3, 0.3)]
    simulation = gapbeam.model(gapbeam.read_case(tables(on_two(bodies, stiffness=[SOFT_CONTACT] * 2))))
    seat = simulation.seat()
    carried = 0.5 * MASS * GRAVITY
    assert seat.state.u[VALUE][-2:] == pytest.approx([-(carried + 0.3 * GRAVITY) / 2.0e4] * 2, rel=1e-9)
    tip = simulation.model.probes["tip"].evaluate(seat.state.u[VALUE], simulation.model.system.operators)
    sunk = (carried + 0.3 * GRAVITY) / 2.0e4 + carried / 4.0e5
    assert tip[-1] == pytest.approx(-sunk, rel=1e-6)


def test_springs_that_differ_tilt_the_bar() -> None:
    """Different masses and springs: each by its own, and the ends of the bar by the lever."""
    bodies = [{"mass": 0.3, "stiffness": 4.0e4}, {"mass": 0.1, "stiffness": 1.0e4}]
    simulation = gapbeam.model(gapbeam.read_case(tables(on_two(bodies, stiffness=[SOFT_CONTACT] * 2))))
    state = simulation.seat().state
    sunk = -(0.5 * MASS + np.array([0.3, 0.1])) * GRAVITY / np.array([4.0e4, 1.0e4])
    assert state.u[VALUE][-2:] == pytest.approx(sunk, rel=1e-4)
    faces = sunk - 0.5 * MASS * GRAVITY / 4.0e5
    end = faces[0] + (faces[1] - faces[0]) * (LENGTH - PLACES[0]) / (PLACES[1] - PLACES[0])
    tip = simulation.model.probes["tip"].evaluate(state.u[VALUE], simulation.model.system.operators)
    assert tip[-1] == pytest.approx(end, rel=1e-3)


@pytest.mark.parametrize("restitution", [0.8, 0.4])
def test_a_bar_hits_a_mass_on_a_soft_spring(restitution: float, tmp_path: Path) -> None:
    """One impact: v1 = v (M - e m) / (M + m), v2 = v M (1 + e) / (M + m); and no energy is missing."""
    speed, body = 0.2, {"mass": 0.3, "stiffness": 1.0}
    case = tables(
        [under_the_middle(body, clearance=1.0e-4)],
        load=[], contact={"stiffness": 1.0e13, "law": {"type": "hunt-crossley", "restitution": restitution}},
        analysis={"type": "transient", "start": "undeformed", "motion": {"velocity": -speed}},
        time={"end": 2.0e-3, "step": 1.0e-6}, gates={"accept_energy_loss": True},
    )  # fmt: skip
    found = run(tmp_path / "run", case)
    assert float(found["contact_force"].max()) > 100.0
    assert float(found["contact_force"][-1].sum()) == 0.0
    bar = float(found["velocity"].sel(probe="tip", component="y")[-1])
    struck = float(found["support_velocity"].sel(support_body="stop", support_axis="y")[-1])
    assert MASS * bar + 0.3 * struck == pytest.approx(-MASS * speed, rel=1e-5)
    expected = -speed * MASS * (1.0 + restitution) / (MASS + 0.3)
    assert bar == pytest.approx(-speed * (MASS - restitution * 0.3) / (MASS + 0.3), abs=2e-3 * speed)
    assert struck == pytest.approx(expected, rel=2e-3)


def test_kelvin_voigt_takes_the_reduced_mass_for_its_restitution(tmp_path: Path) -> None:
    """A stop below the whole bar: the damping is computed from M m / (M + m), and the impact has the asked e."""
    speed, body = 0.1, {"mass": 0.3, "stiffness": 1.0}
    whole = under_the_middle(body, clearance=1.0e-4) | {"from": 0.0, "to": LENGTH}
    case = tables(
        [whole], load=[], contact={"stiffness": 1.0e11, "law": {"type": "kelvin-voigt", "restitution": 0.5}},
        analysis={"type": "transient", "start": "undeformed", "motion": {"velocity": -speed}},
        mesh={"size": 0.02, "support_size": 0.02, "cells_through_thickness": 1},
        time={"end": 1.5e-3, "step": 2.0e-7}, gates={"accept_energy_loss": True},
    )  # fmt: skip
    found = run(tmp_path / "run", case)
    bar = float(found["velocity"].sel(probe="tip", component="y")[-1])
    struck = float(found["support_velocity"].sel(support_body="stop", support_axis="y")[-1])
    assert (bar - struck) / speed == pytest.approx(0.5, abs=2e-3)


def two_masses(end: float, gap: float, contact: float, damper: float, push: float) -> Any:
    """Return bar and body between impacts of a linear contact, by SciPy, with an event at every opening and closing."""
    mass, spring, dashpot = BODY["mass"], BODY["stiffness"], BODY["damping"]

    def force(x: np.ndarray) -> float:
        depth, rate = x[1] - x[0] - gap, x[3] - x[2]
        return max(0.0, contact * depth + damper * rate) if depth > 0.0 else 0.0

    def rates(time: float, x: np.ndarray) -> list[float]:
        pressed, frame = force(x), push * np.sin(2.0 * np.pi * 30.0 * time)
        bar = pressed / MASS - GRAVITY - frame
        body = (-pressed - spring * x[1] - dashpot * x[3]) / mass - GRAVITY - frame
        return [x[2], x[3], bar, body]

    def closes(_time: float, x: np.ndarray) -> float:
        return float(x[1] - x[0] - gap)

    def lets_go(_time: float, x: np.ndarray) -> float:
        return float(contact * (x[1] - x[0] - gap) + damper * (x[3] - x[2]))

    return solve_ivp(
        rates, (0.0, end), [0.0, 0.0, 0.0, 0.0], "DOP853", dense_output=True, rtol=1e-10, atol=1e-13,
        events=[closes, lets_go], max_step=2e-5,
    )  # fmt: skip


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(
    ("march", "end", "gap", "blows"), [("compiled", 0.06, 5.0e-4, 4), ("python", 6.0e-3, 5.0e-5, 1)]
)
def test_two_mass_impact_oscillator(
    march: str, end: float, gap: float, blows: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bar falls on a sprung mass and bounces, frame shaken, against SciPy with events; the balance closes."""
    if march == "python":
        monkeypatch.setattr(gapbeam.solver.march.simulation, "why_not_compiled", lambda _plan: "asked for by a test")
    contact, damper, push = 5.0e5, 20.0, 8.0
    case = tables(
        [under_the_middle(BODY, clearance=gap, stiffness=contact / AREA, damping=damper / AREA)],
        load=[
            {"type": "gravity", "acceleration": GRAVITY},
            {"type": "base_motion", "amplitude": push, "frequency": 30.0},
        ],
        damping={"mass": 0.0, "stiffness": 1.0e-5},  # of the beam, which is rigid: none may act on the body
        analysis={"type": "transient", "start": "undeformed"},
        time={"end": end, "step": 1.0e-5}, gates={"accept_energy_loss": True},
    )  # fmt: skip
    found = run(tmp_path / "run", case)
    answer = two_masses(end, gap, contact, damper, push)
    assert len(answer.t_events[0]) >= blows
    times = found["time"].values
    bar = found["displacement"].sel(probe="tip", component="y").values
    body = found["support_displacement"].sel(support_body="stop", support_axis="y").values
    expected = answer.sol(times)
    assert np.max(np.abs(bar - expected[0])) < 2e-3 * np.max(np.abs(expected[0]))
    assert np.max(np.abs(body - expected[1])) < 4e-3 * np.max(np.abs(expected[1]))
    moving = 0.5 * MASS * found["velocity"].sel(probe="tip", component="y") ** 2
    speed = found["support_velocity"].sel(support_body="stop", support_axis="y")
    np.testing.assert_allclose(found["kinetic_energy"], moving + 0.5 * BODY["mass"] * speed**2, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(found["strain_energy"], 0.5 * BODY["stiffness"] * body**2, rtol=1e-9, atol=1e-13)
    lost = np.trapezoid(BODY["damping"] * speed.values**2, times)
    assert float(found["structural_dissipation"][-1]) == pytest.approx(lost, rel=1e-3)
    force = BODY["stiffness"] * body + BODY["damping"] * speed.values
    np.testing.assert_allclose(found["support_force"].values[:, 0, 0], force, rtol=1e-12)
    assert float(np.abs(found["energy_residual"]).max()) < 5e-11 * float(found["kinetic_energy"].max())


@pytest.mark.slow(minutes=0.1)
def test_stiff_springs_make_rigid_supports(tmp_path: Path) -> None:
    """The motion differs from that in supports that stand still by something like 1 / k."""
    motion = {"velocity": 2.0e-3, "spin": 5.0e-3, "point": 0.0}
    own = {"stiffness": [SOFT_CONTACT] * 2, "damping": [30.0 / AREA] * 2}
    analysis = {"type": "transient", "motion": motion}
    keys = {"analysis": analysis, "time": {"end": 0.008, "step": 1.0e-5}}

    def tip(name: str, support: list[dict[str, Any]]) -> np.ndarray:
        found = run(tmp_path / name, tables(support, **keys))
        return np.asarray(found["displacement"].sel(probe="tip", component="y").values)

    rigid = tip("rigid", stops(**own))
    errors = []
    for spring in (1.0e7, 1.0e8, 1.0e9):
        body = {"mass": 0.01, "stiffness": spring, "damping": 0.2 * np.sqrt(0.01 * spring)}
        errors.append(np.max(np.abs(tip(f"{spring:g}", on_two([body, body], **own)) - rigid)))
    assert errors[0] < 0.2 * np.ptp(rigid)
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.2)


def test_beam_and_reduced_model_agree(tmp_path: Path) -> None:
    """A bar on two bodies under its weight, shaken: motion of tip and bodies in both models."""
    bodies = [{"mass": 0.3, "stiffness": 4.0e4, "damping": 5.0}, {"mass": 0.1, "stiffness": 1.0e4, "damping": 5.0}]
    shaker = {"type": "base_motion", "amplitude": 20.0, "frequency": 60.0}
    keys = {
        "load": [{"type": "gravity", "acceleration": GRAVITY}, shaker],
        "damping": {"frequencies": [50.0, 2000.0], "ratios": [0.02, 0.02]},
        "time": {"end": 0.02, "step": 2.0e-5},
    }
    beam, reduced = (
        run(tmp_path / model["type"], tables(on_two(bodies, stiffness=[SOFT_CONTACT] * 2), model=model, **keys))
        for model in ({"type": "beam", "elements": 20}, {"type": "reduced"})
    )
    for name in ("support_displacement", "support_force"):
        size = float(np.abs(beam[name]).max())
        np.testing.assert_allclose(reduced[name], beam[name], atol=0.01 * size)
    tips = [found["displacement"].sel(probe="tip", component="y").values for found in (beam, reduced)]
    np.testing.assert_allclose(tips[1], tips[0], atol=0.01 * np.ptp(tips[0]))


def test_bodies_are_cheap_to_change() -> None:
    """Cases that differ in them alone share their meshed and assembled beam."""
    one, other = (gapbeam.read_case(tables(support)) for support in (stops(), on_two([BODY, BODY])))
    assert body_key(one) == body_key(other)


def test_only_the_rough_one_of_two_bodies_drags() -> None:
    """A bar that is pulled along two sprung stops: friction 0 at one, 0.3 at the other, of its pressure."""
    pull = {"amplitude": 50.0, "frequency": 50.0, "point": LENGTH, "direction": [1.0, 0.0]}
    case = tables(
        on_two([BODY, BODY], stiffness=[SOFT_CONTACT] * 2, friction=[0.0, 0.3]),
        model={"type": "reduced", "contact": "all"},
        contact={"friction": {"coefficient": 0.2, "slip_velocity": 1.0e-7}},
        load=[{"type": "gravity", "acceleration": GRAVITY}, {"type": "harmonic_force", **pull}],
        time={"end": 2.0e-3, "step": 1.0e-4},
    )
    simulation = gapbeam.model(gapbeam.read_case(case))
    *_, last = simulation.march(simulation.start(simulation.seat()))
    contact, stage = simulation.model.system.contact, last.stage
    assert stage.traction is not None
    pressed = stage.pressure > 0.0
    for face, coefficient in enumerate((0.0, 0.3)):
        here = pressed & (contact.faces == face)
        assert here.any()
        ratio = np.linalg.norm(stage.traction[here], axis=1) / stage.pressure[here]
        np.testing.assert_allclose(ratio, coefficient, rtol=1e-3)


def test_a_clearance_closes_around_a_body(tmp_path: Path) -> None:
    """A slot that closes over a bar on a sprung body: the balance of energy closes to round-off."""
    slot = under_the_middle(BODY, clearance=1.0e-3) | {"region": "slot", "from": 0.1, "to": 0.4}
    closing = {"type": "clearance_change", "support": "stop", "times": [0.0, 0.01], "changes": [0.0, -0.9e-3]}
    case = tables(
        [slot], load=[{"type": "gravity", "acceleration": GRAVITY}, closing], time={"end": 0.02, "step": 2.0e-5},
        mesh={"size": 0.02, "support_size": 0.02, "cells_through_thickness": 1},
        gates={"accept_energy_loss": True},
    )  # fmt: skip
    found = run(tmp_path / "run", case)
    largest = float((found["kinetic_energy"] + found["strain_energy"] + found["contact_energy"]).max())
    assert float(np.abs(found["energy_residual"]).max()) < 1e-10 * largest


FALLS = {"type": "transient", "start": "undeformed"}


@pytest.mark.parametrize("start", ["rest", -2.0e-3, 1.0e-3])
def test_a_body_starts_where_the_case_says(start: str | float, tmp_path: Path) -> None:
    """Free of the beam: q = q_s + e^(-d t) ((q_0 - q_s) cos w t + (v_0 + d (q_0 - q_s)) / w sin w t)."""
    body = {"mass": 0.3, "stiffness": 4.0e3, "damping": 6.0, "displacement": start, "velocity": 0.0}
    if start != "rest":
        body["velocity"] = 0.05
    case = tables([under_the_middle(body, clearance=0.01)], analysis=FALLS, time={"end": 0.03, "step": 2.0e-5})
    found = run(tmp_path / "run", case)
    moved = found["support_displacement"].sel(support_body="stop", support_axis="y").values
    times, rest = found["time"].values, -0.3 * GRAVITY / 4.0e3
    first = rest if start == "rest" else float(start)
    lost = 6.0 / (2.0 * 0.3)
    turn = np.sqrt(4.0e3 / 0.3 - lost**2)
    swing = (first - rest) * np.cos(turn * times) + (body["velocity"] + lost * (first - rest)) / turn * np.sin(
        turn * times
    )
    assert moved == pytest.approx(rest + np.exp(-lost * times) * swing, abs=2e-3 * abs(rest))


def test_a_body_is_moved_from_the_seat() -> None:
    """The displacement and the velocity are added to where body and beam stand together."""
    body = {"mass": 0.3, "stiffness": 2.0e4, "displacement": -1.0e-3, "velocity": 0.2}
    simulation = gapbeam.model(gapbeam.read_case(tables([under_the_middle(body)])))
    seat = simulation.seat().state
    state = start_of_case(simulation.case, simulation.model, seat)
    assert state.u[VALUE][-1] - seat.u[VALUE][-1] == pytest.approx(-1.0e-3, rel=1e-12)
    assert state.v[VALUE][-1] == pytest.approx(0.2, rel=1e-12)
    assert state.u[VALUE][:-1] == pytest.approx(seat.u[VALUE][:-1], rel=1e-12)


def test_starts_of_bodies_that_are_refused() -> None:
    """A body within the beam, its own rest beside the seat, and a start of a periodic response."""
    inside = {"mass": 0.3, "stiffness": 2.0e4, "displacement": 2.0e-3}
    simulation = gapbeam.model(gapbeam.read_case(tables([under_the_middle(inside, clearance=1.0e-3)], analysis=FALLS)))
    with pytest.raises(UserError, match=r"body.displacement moves stop_below 0.001 m into the beam"):
        start_of_case(simulation.case, simulation.model, None)
    at_rest = {"mass": 0.3, "stiffness": 2.0e4, "displacement": "rest"}
    with pytest.raises(CaseError, match=r"starts at the seat[\s\S]*undeformed"):
        gapbeam.read_case(tables([under_the_middle(at_rest)]))
