"""Supports that move in time, from the case: resting beams, base motion, closures, releases, walls around a beam."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.diagnostics.assumption import ASIDE, TRAVEL
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import model_of
from gapbeam.solver.run.assumptions.pose_rows import watch_of
from gapbeam.solver.supports.support import Array
from gapbeam.solver.system.semi_discrete import State

LENGTH, THICKNESS, WIDTH = 0.4, 0.01, 0.02
YOUNG, DENSITY, GRAVITY = 2.0e11, 7850.0, 9.81
MASS = DENSITY * LENGTH * THICKNESS * WIDTH
LEFT = {"name": "left", "from": 0.0, "to": 0.02, "clearance": 1.0e-3}
RIGHT = {"name": "right", "from": 0.38, "to": 0.4, "clearance": 1.0e-3}
WEIGHT = {"type": "gravity", "acceleration": GRAVITY}


def tables(loads: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """Return a short beam in two slots, rigid but for its contacts."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": YOUNG, "poisson_ratio": 0.3, "density": DENSITY},
        "support": [LEFT, RIGHT],
        "mesh": {"size": 0.05, "support_size": 0.01, "cells_through_thickness": 2},
        "model": {"type": "rigid"},
        "contact": {"stiffness": 1.0e11},
        "load": [dict(load) for load in loads],
        "probe": [{"name": "middle", "point": 0.5 * LENGTH}],
        "time": {"end": 0.1, "step": 1.0e-4},
        **more,
    }


def marched(case: dict[str, Any]) -> tuple[Simulation, list[State], Ledger]:
    """March a case; return its states from the start on, and the ledger at the end."""
    simulation = gapbeam.model(gapbeam.read_case(case))
    start = simulation.start(simulation.seat_or_failure())
    system, law = simulation.model.system, simulation.model.law
    states, ledger = [start], open_ledger(system, law, start)
    for step in simulation.march(start):
        ledger = enter_step(system, law, ledger, step)
        if step.refreshed is not None:
            ledger = restate(system, law, ledger, step.refreshed)
        states.append(step.refreshed or step.new)
    return simulation, states, ledger


def heights(simulation: Simulation, states: list[State]) -> Array:
    """Return the displacement of the probe along the bending axis, (states,)."""
    (probe,) = simulation.model.probes.values()
    return np.array([probe.evaluate(state.u[0], simulation.model.system.operators)[-1] for state in states])


def motion(name: str, support: str, amplitude: float, **more: Any) -> dict[str, Any]:
    """Return the harmonic motion of a support."""
    keys = {"amplitude": amplitude, "frequency": 5.0, "phase": 90.0, **more}
    return {"type": "support_motion", "name": name, "support": support, **keys}


def test_a_resting_beam_follows_its_supports() -> None:
    """Both supports move by w = A (cos(2 pi f t) - 1), A f^2 below g: u = w, the force is m (g + w'')."""
    amplitude, omega = 2.0e-3, 2.0 * pi * 5.0
    both = [motion(f"of_{one}", one, amplitude) for one in ("left", "right")]
    simulation, states, ledger = marched(tables([WEIGHT, *both], damping={"mass": 0.0, "stiffness": 0.0}))
    times = np.array([state.time for state in states])
    found = heights(simulation, states)
    assert np.max(np.abs(found - found[0] - amplitude * (np.cos(omega * times) - 1.0))) < 1.0e-3 * amplitude
    weights = simulation.model.system.contact.weights
    forces = np.array([weights @ state.pressure for state in states])
    means = np.convolve(forces, np.full(40, 1.0 / 40.0), "valid")  # the start of w'' makes the beam bounce a little
    middles = np.convolve(times, np.full(40, 1.0 / 40.0), "valid")
    assert np.max(np.abs(means / MASS - GRAVITY + amplitude * omega**2 * np.cos(omega * middles))) < 0.1 * GRAVITY
    assert abs(ledger.residual) <= max(ledger.round_off, 1.0e-10 * ledger.exchanged)
    works = dict(zip((load.name for load in simulation.model.system.loads), ledger.load_work, strict=True))
    gained = ledger.total - ledger.start - works["gravity"] + ledger.algorithmic + ledger.lost
    assert works["of_left"] + works["of_right"] == pytest.approx(gained, rel=1e-9)


def recorded(path: Path, values: Array, times: Array) -> str:
    """Write a record, and return its path."""
    path.write_text("".join(f"{t!r}, {x!r}\n" for t, x in zip(times.tolist(), values.tolist(), strict=True)))
    return str(path)


@pytest.mark.parametrize(
    ("model", "force", "allowed"),
    [("rigid", 0.0, 1e-12), ("rigid", 60.0, 1e-11), ("beam", 60.0, 1e-9), ("full", 60.0, 1e-9)],
)
def test_equal_motions_are_a_base_motion(model: str, force: float, allowed: float, tmp_path: Path) -> None:
    """All supports move by w = a t^2 / 2: the beam moves as in the frame with the acceleration a, plus w.

    A midpoint rule integrates w exactly, and the weak restraint acts along the beam: the motions differ by round-off,
    which impacts multiply.
    """
    acceleration, times = 30.0, np.linspace(0.0, 0.02, 9)
    files = {
        "displacement": recorded(tmp_path / "w.csv", 0.5 * acceleration * times**2, times),
        "acceleration": recorded(tmp_path / "a.csv", np.full_like(times, acceleration), times),
    }
    keys: dict[str, Any] = {
        "model": {"type": model},
        "damping": {"mass": 0.0, "stiffness": 1.0e-6},
        "contact": {"stiffness": 1.0e11, "damping": 1.0e6},
        "time": {"end": 0.02, "step": 1.0e-4},
    }
    walls = [
        {"type": "recorded_support_motion", "name": one, "support": one, "file": files["displacement"]}
        for one in ("left", "right")
    ]
    frame = {"type": "recorded_motion", "file": files["acceleration"]}
    push = {
        "type": "harmonic_force", "name": "push", "point": LENGTH, "amplitude": force, "frequency": 200.0,
    }  # fmt: skip
    one, absolute, _ = marched(tables([WEIGHT, push, *walls], **keys))
    two, relative, _ = marched(tables([WEIGHT, push, frame], **keys))
    place = np.array([0.5 * acceleration * state.time**2 for state in absolute])
    apart = heights(one, absolute) - place - heights(two, relative)
    opened = [np.max(state.depth) for state in relative]
    assert max(opened) > 0.0
    assert (min(opened) < 0.0) == (force > 0.0)
    assert np.max(np.abs(apart)) < allowed * place[-1]


@pytest.mark.parametrize("scheme", ["discrete-gradient", "generalized-alpha"])
def test_a_closure_squeezes_the_beam(scheme: str) -> None:
    """A slot all along the beam closes by 20 um onto it: p = closure / (h / E + 2 / eps), in plane stress exactly."""
    closed, stiffness = 2.0e-5, 1.0e13
    slot = {"name": "slot", "from": 0.0, "to": LENGTH, "clearance": 1.0e-5}
    closure = {"type": "clearance_change", "times": [0.0, 0.01, 0.02], "changes": [0.0, -1.5e-5, -1.0e-5 - closed]}
    case = tables(
        [closure],
        support=[slot],
        model={"type": "full"},
        contact={"stiffness": stiffness},
        damping={"mass": 0.0, "stiffness": 1.0e-6},
        time={"end": 0.03, "step": 1.0e-4, "scheme": scheme},
    )
    simulation, states, ledger = marched(case)
    contact, last = simulation.model.system.contact, states[-1]
    pressure = closed / (THICKNESS / YOUNG + 2.0 / stiffness)
    assert last.pressure == pytest.approx(np.full(contact.size, pressure), rel=1e-5)
    stored = 0.5 * pressure * closed * LENGTH * WIDTH
    # generalized-alpha weighs the pressures at both ends of a step by 1/3 and 2/3, of first order in such a work
    assert ledger.load_work[0] == pytest.approx(stored, rel=1e-4 if scheme == "discrete-gradient" else 5e-3)
    assert ledger.strain + ledger.contact == pytest.approx(stored, rel=1e-4)
    assert abs(ledger.residual) <= max(ledger.round_off, 1.0e-10 * ledger.exchanged)


def test_a_release_lets_the_beam_fall() -> None:
    """Stops below are gone within 0.2 ms; the beam falls by h, and meets them after sqrt(2 h / g)."""
    fall, step = 2.0e-3, 1.0e-4
    stops = [{**one, "clearance": 0.0, "region": {"type": "stop"}} for one in (LEFT, RIGHT)]
    away = [
        {
            "type": "clearance_change", "name": f"{one}_release", "support": one, "times": [0.0, 2.0e-4],
            "changes": [0.0, fall],
        }
        for one in ("left", "right")
    ]  # fmt: skip
    case = tables([WEIGHT, *away], support=stops, time={"end": 0.025, "step": step})
    _, states, ledger = marched(case)
    times = np.array([state.time for state in states])
    pressed = np.array([np.any(state.pressure > 0.0) for state in states])
    flight = (times > 5.0e-4) & (times < sqrt(2.0 * fall / GRAVITY) - step)
    assert not np.any(pressed[flight])
    landed = times[(times > 5.0e-4) & pressed][0]
    assert landed == pytest.approx(sqrt(2.0 * fall / GRAVITY), abs=3.0e-4)
    assert abs(ledger.residual) <= max(ledger.round_off, 1.0e-10 * ledger.exchanged)


def test_a_clearance_follows_its_table() -> None:
    """No row is overshot, the speed is continuous, and nothing moves after the last row."""
    closure = {"type": "clearance_change", "times": [0.0, 0.1, 0.15, 0.3], "changes": [0.0, -1e-4, -1e-4, -3e-4]}
    slot = {"name": "slot", "from": 0.1, "to": 0.12, "clearance": 1.0e-3}
    (load,) = gapbeam.read_case(tables([closure], support=[slot])).load
    function = load.time_function()
    times = np.linspace(0.0, 0.5, 5001)
    values = function.value(times)
    assert function.rate is not None
    rates = function.rate(times)
    assert values[[0, 1000, 1500, 3000, 5000]] == pytest.approx([0.0, -1e-4, -1e-4, -3e-4, -3e-4], abs=1e-18)
    assert np.all(np.diff(values) <= 1e-18)
    assert np.max(np.abs(np.diff(rates))) < 1e-2 * np.max(np.abs(rates))
    assert rates == pytest.approx(np.gradient(values, times), abs=1e-2 * np.max(np.abs(rates)))
    assert load.travel == (-3e-4, 0.0)


ROUND: dict[str, Any] = {
    "beam": {"length": LENGTH, "thickness": THICKNESS, "width": THICKNESS, "section": "round"},
    "mesh": {"dimension": 3, "size": 0.1, "support_size": 0.02, "cells_through_thickness": 2, "cells_across_width": 2},
}
REGIONS: dict[str, Any] = {
    "slot": "slot",
    "stop": {"type": "stop", "side": "above"},
    "hole": "hole",
    "polygon": {"type": "polygon", "walls": [-45.0, 45.0, 180.0]},
    "profile": {"type": "profile", "angles": [-90.0, 0.0, 90.0], "recesses": [0.0, 1e-5, 0.0]},
}


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", REGIONS)
def test_walls_move_as_their_support_is_placed(name: str) -> None:
    """A motion by w opens gaps as an offset of w does, a motion sideways as lateral, a change of clearance likewise."""
    moved = {**RIGHT, "clearance": 1.0e-4, "region": REGIONS[name]}
    sideways = {"hole", "polygon", "profile"}
    loads: list[dict[str, Any]] = [
        {"type": "clearance_change", "support": "right", "times": [0.0, 1.0], "changes": [0.0, 3.0e-5]},
        {"type": "support_motion", "name": "up", "support": "right", "amplitude": 4.0e-5, "frequency": 0.25},
    ]
    places = {"clearance": 3.0e-5, "offset": 4.0e-5}
    if name in sideways:
        aside = {"direction": [0.0, 2.0, 0.0], "support": "right", "amplitude": -2.0e-5, "frequency": 0.25}
        loads.append({"type": "support_motion", "name": "aside", **aside})
        places["lateral"] = -2.0e-5
    case = tables([WEIGHT, *loads], support=[LEFT, moved], **(ROUND if name in sideways else {}))
    model = gapbeam.model(gapbeam.read_case(case)).model
    body, contact = model.body, model.system.contact
    for number, (key, value) in enumerate(places.items()):
        other = gapbeam.read_case(case | {"support": [LEFT, {**moved, key: moved.get(key, 0.0) + value}]})
        placed = model_of(other, body).system.contact
        one = replace(contact.walls, motions=contact.walls.motions[number : number + 1])
        found = replace(one, growths=contact.walls.growths[number : number + 1]).opened(1.0)
        expected = placed.initial_gap - contact.initial_gap
        assert np.max(np.abs(expected)) > 0.5e-5
        assert found == pytest.approx(expected, abs=1e-15)


def test_base_and_gland_move_as_one_support() -> None:
    """[support] needs no name: a change of clearance moves the gland alone, a motion base and gland."""
    closing = {"type": "clearance_change", "times": [0.0, 1.0], "changes": [0.0, -4.0e-5]}
    lifting = {"type": "support_motion", "amplitude": 3.0e-5, "frequency": 0.25}
    case = tables([WEIGHT, closing, lifting], support={"length": 0.05, "clearance": 1.0e-4})
    contact = gapbeam.model(gapbeam.read_case(case)).model.system.contact
    base = contact.faces == contact.face_names.index("base")
    assert contact.walls.opened(1.0) == pytest.approx(np.where(base, -3.0e-5, 3.0e-5 - 4.0e-5), abs=1e-18)
    assert contact.walls.grown(0.0, 1.0) == pytest.approx(contact.walls.opened(1.0), abs=1e-18)


def test_a_beam_in_holes_that_move_sideways() -> None:
    """Both holes move aside by w: the seated beam comes along, in the middle of them as it was."""
    amplitude = 1.0e-3
    holes = [{**one, "clearance": 1.0e-5, "region": "hole"} for one in (LEFT, RIGHT)]
    both = [motion(f"of_{one}", one, amplitude, direction=[0.0, 1.0, 0.0], frequency=10.0) for one in ("left", "right")]
    case = tables(
        [WEIGHT, *both], support=holes, **ROUND, damping={"mass": 0.0, "stiffness": 0.0},
        contact={"stiffness": 1e11, "damping": 1e7}, time={"end": 0.05, "step": 1e-4},
    )  # fmt: skip
    simulation, states, ledger = marched(case)
    (probe,) = simulation.model.probes.values()
    ends = [probe.evaluate(states[k].u[0], simulation.model.system.operators) for k in (0, -1)]
    assert ends[1][1] - ends[0][1] == pytest.approx(-2.0 * amplitude, abs=2.0e-5)
    assert abs(ends[1][2]) < 1.5e-5
    watch, last = watch_of(simulation.model.case, simulation.model), states[-1]
    watch.see(np.array([last.time]), last.u[:1], np.array([1.0]))
    assert 0.0 < watch.closest[ASIDE, 0] < 2.0e-5 / (0.5 * THICKNESS), "motion in the holes, not with them"
    assert watch.closest[TRAVEL, 0] < 2.0e-5 / THICKNESS
    assert abs(ledger.residual) <= max(ledger.round_off, 1.0e-10 * ledger.exchanged)


SETTINGS: dict[str, dict[str, Any]] = {
    "unilateral": {"contact": {"formulation": "unilateral"}},
    "impulses": {"contact": {"formulation": "unilateral"}, "time": {"scheme": "moreau-jean"}},
    "augmented": {"contact": {"formulation": "augmented-lagrangian"}, "time": {"scheme": "implicit-midpoint"}},
    "nitsche": {"contact": {"formulation": "nitsche"}, "time": {"scheme": "implicit-midpoint"}},
    "explicit": {
        "contact": {"mass": "redistributed"}, "time": {"scheme": "central-difference", "step": "auto", "end": 3e-4},
    },
    "friction": {"contact": {"friction": {"coefficient": 0.3}}},
    "touch speed": {"contact": {"stiffness": 1e11, "law": {"type": "hunt-crossley", "restitution": 0.6}}},
    "adaptive": {"time": {"adaptive": True}},
    "hht": {"time": {"scheme": "hht-alpha"}, "contact": {"stiffness": 1e11}},
}  # fmt: skip


@pytest.mark.parametrize("name", SETTINGS)
def test_the_energy_balance_closes_whatever_marches(name: str) -> None:
    """A support strikes the beam of a mesh: the balance with the work of the wall closes to 1e-9 of the exchanged."""
    given = SETTINGS[name]
    case = tables(
        [WEIGHT, motion("hit", "right", 2.0e-3, frequency=100.0, phase=-90.0)],
        model={"type": "full"},
        contact=given.get("contact", {}),
        time={"end": 0.004, "step": 1.0e-4} | given.get("time", {}),
    )
    simulation, states, ledger = marched(case)
    work = dict(zip((load.name for load in simulation.model.system.loads), ledger.load_work, strict=True))["hit"]
    assert work > 0.0
    assert abs(ledger.residual) <= max(ledger.round_off, 1.0e-9 * ledger.exchanged)
    contact, last = simulation.model.system.contact, states[-1]
    values = contact.interface.trace(last.u[0], simulation.model.system.operators)
    assert last.depth == pytest.approx(contact.depth(values, last.time), abs=1e-12)
