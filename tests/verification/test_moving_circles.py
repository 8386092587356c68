"""Round holes that are met as circles and move or open in time: base motions, rides on the wall, an opening hole."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, why_not_compiled
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import march
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated
from tests.verification.test_circles import AREA, HOLE
from tests.verification.test_moving_supports import recorded
from tests.verification.test_orbits_in_a_ring import CLEARANCE, LENGTH, MASS, SOFT, ring, translation

FREE = {"axial": 1.0e-3, "lateral": 1.0e-9}  # N/m
STILL = {"damping": {"mass": 0.0, "stiffness": 0.0}}
UNDEFORMED = {"type": "transient", "start": "undeformed"}
GRAVITY = {"type": "gravity", "direction": [0.0, 0.0, -1.0]}
MESH = {"dimension": 3, "size": LENGTH, "support_size": LENGTH / 2.0, "cells_through_thickness": 2}
HALVES = [HOLE | {"name": "left", "to": LENGTH / 2.0}, HOLE | {"name": "right", "from": LENGTH / 2.0}]


def followed(model: Model, start: State, steps: int, compiled: bool) -> tuple[Array, State, Accounts]:
    """Return places of the middle, (steps + 1, 3), the end and the accounts of a march."""
    plan = replace(Simulation(model).plan, steps=steps)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    probe, operators = model.probes["mid"], plan.system.operators
    rows, end = [probe.evaluate(start.u[VALUE], operators)], start
    if compiled:
        assert why_not_compiled(plan) is None
        loop = CompiledLoop(plan)
        for block in loop.blocks(start, 1, accounts, steps=steps):
            rows += [probe.evaluate(x, operators) for x in loop.modal.dofs(block.records.q)]
            end = block.end
        return np.array(rows), end, accounts
    for step in march(plan, start):
        accounts.take(step)
        end = step.new
        rows.append(probe.evaluate(end.u[VALUE], operators))
    return np.array(rows), end, accounts


@pytest.mark.parametrize("compiled", [True, False])
def test_equal_motions_of_all_holes_are_a_base_motion(compiled: bool, tmp_path: Path) -> None:
    """Two holes move by w = a t^2 / 2, aside and up: as in the frame with the acceleration a, plus w, to 1e-12."""
    acceleration, steps, dt = 30.0, 100, 1.0e-4
    times = np.linspace(0.0, 1.1 * steps * dt, 9)
    file = recorded(tmp_path / "w.csv", 0.5 * acceleration * times**2, times)
    rate = recorded(tmp_path / "a.csv", np.full_like(times, acceleration), times)
    along = [0.0, 0.6, 0.8]
    walls = [
        {"type": "recorded_support_motion", "name": one["name"], "support": one["name"], "file": file}
        | {"direction": along}
        for one in HALVES
    ]
    frame = {"type": "recorded_motion", "file": rate, "direction": along}
    push = {"type": "harmonic_force", "name": "push", "point": 0.0, "amplitude": 20.0, "frequency": 200.0}
    keys: dict[str, Any] = STILL | {"support": HALVES, "contact": {"stiffness": SOFT, "damping": 1.0e4}}
    keys |= {"mesh": MESH, "time": {"end": steps * dt, "step": dt}}
    found = []
    for loads in (walls, [frame]):
        model = ring(2, SOFT, dt, **keys, load=[GRAVITY, push, *loads])
        places, _, accounts = followed(model, seated(model).state, steps, compiled)
        assert abs(accounts.ledger.residual) <= max(accounts.ledger.round_off, 1e-10 * accounts.ledger.exchanged)
        assert accounts.peaks.force.max() > 10.0
        found.append(places[:, 1:])
    w = 0.5 * acceleration * (dt * np.arange(steps + 1)) ** 2
    absolute, relative = found
    assert np.ptp(relative) > CLEARANCE
    assert np.abs(absolute - w[:, None] * along[1:] - relative).max() < 1e-12 * w[-1]


@pytest.mark.parametrize("compiled", [True, False])
def test_a_tube_rides_on_the_wall_of_a_hole_that_circles(compiled: bool) -> None:
    """The middle of the hole goes round on the radius A: K A_s (rho - A - c) = m omega^2 rho, to 1e-5, for a turn."""
    radius, omega, steps = 1.0e-4, 2.0 * pi * 100.0, 100
    dt = 2.0 * pi / omega / 100.0
    motion = {"type": "support_motion", "support": "ring", "amplitude": radius, "frequency": 100.0}
    loads = [
        motion | {"name": "aside", "phase": 90.0, "direction": [0.0, 1.0, 0.0]},
        motion | {"name": "up", "direction": [0.0, 0.0, 1.0]},
    ]
    hole = HOLE | {"lateral": radius}
    model = ring(2, SOFT, dt, **STILL, restraint=FREE, support=[hole], load=loads, analysis=UNDEFORMED)
    operators, contact = model.system.operators, model.system.contact
    mass = float(translation(model, 0.0, 1.0) @ operators.apply_mass(translation(model, 0.0, 1.0)))
    assert mass == pytest.approx(MASS, rel=1e-3)
    stiffness = SOFT * float(contact.weights.sum())
    # the midpoint rule goes round a circle by a chord: omega of its equations is 2/dt tan(omega dt / 2)
    slower = 2.0 / dt * np.tan(0.5 * omega * dt)
    rho = stiffness * (radius + CLEARANCE) / (stiffness - mass * slower**2)
    u, v = (imaged(operators, translation(model, *one)) for one in ((rho, 0.0), (0.0, slower * rho)))
    depth = contact.depth(contact.interface.trace(u[VALUE], operators))
    start = State(0.0, u, v, depth, np.zeros(contact.size))
    places, end, accounts = followed(model, start, steps, compiled)
    assert np.hypot(*places[:, 1:].T) == pytest.approx(np.full(steps + 1, rho), rel=1e-5)
    assert end.pressure @ contact.weights == pytest.approx(mass * omega**2 * rho, rel=2e-3)
    assert abs(accounts.ledger.residual) <= max(accounts.ledger.round_off, 1e-10 * accounts.ledger.exchanged)


def test_both_marches_take_the_same_steps_in_holes_that_move_and_open() -> None:
    """Orbits of a thrown tube, with work of the walls: places to 1e-9, works to 1e-8."""
    dt, steps = 1.0e-5, 300
    motion = {"type": "support_motion", "name": "shake", "support": "left", "amplitude": 5.0e-5, "frequency": 150.0}
    opening = {"type": "clearance_change", "name": "open", "support": "right"}
    loads = [
        motion | {"direction": [0.0, 1.0, 0.3]},
        opening | {"times": [0.0, 1.0e-3, 3.0e-3], "changes": [0.0, -5.0e-5, 4.0e-5]},
    ]
    thrown = {"type": "transient", "start": "undeformed", "motion": {"velocity": [0.0, 0.1, -0.15]}}
    model = ring(2, SOFT, dt, **STILL, restraint=FREE, mesh=MESH, support=HALVES, load=loads, analysis=thrown)
    found = [followed(model, seated(model).state, steps, compiled) for compiled in (True, False)]
    (fast, end, one), (slow, last, other) = found
    assert np.abs(fast - slow).max() < 1e-9 * np.abs(slow).max()
    assert end.depth == pytest.approx(last.depth, abs=1e-9 * CLEARANCE)
    assert one.ledger.load_work == pytest.approx(other.ledger.load_work, rel=1e-8)
    assert np.all(np.abs(other.ledger.load_work) > 1e-6 * other.ledger.start)
    for accounts in (one, other):
        assert abs(accounts.ledger.residual) <= max(accounts.ledger.round_off, 1e-9 * accounts.ledger.exchanged)


@pytest.mark.parametrize("contact", ["circle", "points"])
def test_a_tube_sinks_as_its_hole_opens(contact: str) -> None:
    """Slowly by a clearance: it ends that much lower, as deep as at first; met as a circle as at 64 points around."""
    dt, steps, time = 1.0e-4, 800, 0.06
    opening = {"type": "clearance_change", "name": "open", "support": "ring"}
    smooth = [0.0, *(time * (k + 1.0) / 20.0 for k in range(20))]
    loads = [
        GRAVITY,
        opening | {"times": smooth, "changes": [CLEARANCE * (1.0 - np.cos(pi * t / time)) / 2.0 for t in smooth]},
    ]
    hole = HOLE | {"region": {"type": "hole", "contact": contact}}
    model = ring(4 if contact == "points" else 2, SOFT, dt, **STILL, support=[hole], load=loads)
    response = respond(model, seated(model).state, steps, dt)
    assert response.verdict == "passed"
    place = response.history["displacement"][:, 0, 2]
    sunk = 9.81 * MASS / (SOFT * AREA)
    assert place[-1] - place[0] == pytest.approx(-CLEARANCE, abs=0.05 * CLEARANCE)
    if contact == "circle":
        assert place[0] == pytest.approx(-CLEARANCE - sunk, rel=1e-4)
        omega = sqrt(SOFT * AREA / MASS)
        assert omega * dt < 0.6  # the bounce on the wall is resolved
