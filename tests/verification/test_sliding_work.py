"""The work of sliding against closed forms: a whirl on a plane and in a hole, a beam that slides along its support."""

from __future__ import annotations

from math import atan, cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, instants_of, why_not_compiled
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.models.model import build_model
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated
from tests.verification.test_orbits_in_a_ring import (
    CLEARANCE,
    LENGTH,
    MASS,
    SOFT,
    SPRING,
    ring,
    translation,
    wall_force,
)

RADIUS, OMEGA, WEIGHT, PLANE = 1.0e-3, 100.0, 10.0, 1.0e8  # m, rad/s, N, N/m


def whirl_on_a_plane(steps: int, mu: float = 0.0) -> tuple[March, State]:
    """Return one turn of 1 kg on two springs along a circle, pressed on a plane by its constant weight."""
    contact = ContactOperator(
        interface=Interface(3, np.arange(3), np.arange(3)),
        gap_matrix=csr_matrix([[0.0, 0.0, 1.0]]),
        weights=np.ones(1),
        initial_gap=np.zeros(1),
        faces=np.zeros(1, dtype=int),
        support=Support((Face("plane", -1.0),), area=1.0),
        positions=np.zeros((1, 3)),
        tangents=csr_matrix(np.eye(3)[:2]),
        frictionless=mu == 0.0,
        measures_sliding=True,
    )
    operators = DenseOperators(np.eye(3), np.diag([OMEGA**2, OMEGA**2, 0.0]))
    weight = Load("weight", np.array([0.0, 0.0, -1.0]), lambda _time: WEIGHT)
    system, scheme = SemiDiscreteSystem(operators, contact, (weight,)), scheme_of("implicit-midpoint")
    law = ContactLaw(Spring(PLANE), friction=CoulombFriction(mu, 1.0e-9) if mu > 0.0 else None)
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), 2.0 * pi / OMEGA / steps, steps)
    place, speed = np.array([RADIUS, 0.0, -WEIGHT / PLANE]), np.array([0.0, OMEGA * RADIUS, 0.0])
    images = imaged(operators, place), imaged(operators, speed)
    return plan, begun(plan, State(0.0, *images, contact.depth(place), np.array([WEIGHT])))


def work_of(plan: March, start: State, compiled: bool) -> float:
    """Return the work of sliding of a march, J."""
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    if compiled:
        assert why_not_compiled(plan) is None
        *_, last = CompiledLoop(plan).blocks(start, plan.steps, accounts)
        recorded = instants_of(last, len(last.times)).sliding_work
        assert recorded is not None
        assert recorded[-1] == pytest.approx(accounts.sliding.by_face, rel=1e-14)
    else:
        for step in march(plan, start):
            accounts.take(step)
    found = accounts.sliding.by_face
    assert found is not None
    return float(found[0])


@pytest.mark.parametrize("compiled", [False, True], ids=["python", "compiled"])
def test_work_of_a_full_whirl_on_a_plane(compiled: bool) -> None:
    """N w r over a turn to 1e-6 with 4000 compiled steps; the chords of the midpoint rule to 1e-9 with 40.

    A step of that rule turns by 2 atan(w h / 2) and keeps the radius: its chord is 2 r sin(atan(w h / 2)).
    """
    exact = WEIGHT * 2.0 * pi * RADIUS
    if compiled:
        assert work_of(*whirl_on_a_plane(4000), compiled) == pytest.approx(exact, rel=1e-6)
    chords = 40 * WEIGHT * 2.0 * RADIUS * sin(atan(pi / 40))
    assert work_of(*whirl_on_a_plane(40), compiled) == pytest.approx(chords, rel=1e-9)


def test_both_marches_find_the_same_work() -> None:
    """A beam between base and gland under noise for 200 steps, step by step and compiled: to 1e-9."""
    case = Path(__file__).parents[2] / "cases" / "random-vibration.toml"
    keys = ("model.elements=12", "time.step=1e-4", "time.end=0.02", "output.errors=none", "wear.coefficient=1e-14")
    simulation = gapbeam.model(gapbeam.read_case(case, keys))
    start = begun(simulation.plan, simulation.seat().state)
    works = [work_of(simulation.plan, start, compiled) for compiled in (False, True)]
    assert works[0] > 1.0e-6
    assert works[1] == pytest.approx(works[0], rel=1e-9)


def test_friction_takes_its_share_of_the_work() -> None:
    """Friction takes mu times the work of sliding from the energy, as long as the mass slides all the time."""
    plan, start = whirl_on_a_plane(80, mu=0.02)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    for step in march(plan, start):
        accounts.take(step)
    found = accounts.sliding.by_face
    assert found is not None
    assert accounts.ledger.friction_loss > 0.0
    assert accounts.ledger.friction_loss == pytest.approx(0.02 * found[0], rel=1e-6)


@pytest.mark.parametrize(("cells", "accuracy"), [(2, 5e-2), (4, 5e-3)])
def test_work_rate_of_a_tube_that_whirls_in_a_hole(cells: int, accuracy: float) -> None:
    """F(r) W r of the full annular rub, F W r with the run's own forces and speeds to 5e-4, 32 and 64 points around.

    A point at the angle phi from the deepest one is pressed by K (r cos phi - c) per area and slides with W r cos phi:
    the integral of both around the tube is F(r) W r, and the same sum over any points F W r, with their resultant F.
    """
    radius, step, steps = 1.3 * CLEARANCE, 2.0e-5, 1000
    hole = {"name": "ring", "from": 0.0, "to": LENGTH, "clearance": CLEARANCE, "region": "hole"}
    springs = {"vertical": SPRING, "lateral": SPRING}
    joint = {"name": "j", "type": "elastic", "point": LENGTH / 2.0, "stiffness": springs}
    still = {"type": "transient", "start": "undeformed"}
    model = ring(cells, SOFT, step, support=[hole], joint=[joint], analysis=still, wear={})
    operators, contact = model.system.operators, model.system.contact
    omega = sqrt((SPRING * radius + wall_force(radius, SOFT)) / (MASS * radius))
    u, v = (imaged(operators, translation(model, *motion)) for motion in ((radius, 0.0), (0.0, omega * radius)))
    depth = contact.depth(contact.interface.trace(u[0], operators))
    response = respond(model, State(0.0, u, v, depth, np.zeros(contact.size)), steps, 10 * step)
    work = response.history["sliding_work"][:, 0]
    exact = wall_force(radius, SOFT) * omega * radius
    assert work[-1] / (steps * step) == pytest.approx(exact, rel=accuracy)
    forces = np.hypot(*response.history["contact_resultant"][:, 0].T)
    speeds = np.hypot(*response.history["velocity"][:, 0, 1:].T)
    rates = np.diff(work) / (10 * step)
    chord = cos(atan(omega * step / 2.0))  # over the speed at its ends
    assert np.mean(rates[1:]) == pytest.approx(chord * np.mean((forces * speeds)[2:]), rel=5e-4)


STEP, STIFFNESS = 5.0e-5, 1.0e9
SLIDE: dict[str, Any] = {
    "beam": {"length": 0.2, "thickness": 0.01, "width": 0.02},
    "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
    "support": [{"name": "floor", "from": 0.0, "to": 0.2, "region": "stop", "clearance": 0.0}],
    "restraint": {"axial": 1.0e-6},
    "contact": {"stiffness": STIFFNESS},
    "mesh": {"size": 0.02, "support_size": 0.02, "cells_through_thickness": 2},
    "load": [{"type": "gravity", "acceleration": 10.0, "direction": [0.6, -0.8]}],
    "probe": [{"name": "tip", "point": 0.2}],
    "wear": {},
    "analysis": {"type": "transient", "start": "undeformed"},
    "time": {"end": 0.01, "step": STEP, "scheme": "discrete-gradient"},
}
KINDS = {
    "rigid": {"type": "rigid"},
    "beam": {"type": "beam", "elements": 10},
    "reduced": {"type": "reduced"},
    "full": {"type": "full"},
}


@pytest.mark.parametrize("dimension", [2, pytest.param(3, marks=pytest.mark.slow(minutes=0.1))])
@pytest.mark.parametrize("kind", KINDS)
def test_a_beam_slides_down_a_slope(kind: str, dimension: int) -> None:
    """Without friction: the integral of N(t) g sin(a) t in every model, in a slice and in space, within 1e-3.

    Let down at once, the beam is a mass on the stiffness of its support: N = m g cos(a) (1 - cos(w t)), at the
    frequency of the steps, w = 2 / h atan(w0 h / 2).
    """
    across = [0.6, -0.8] if dimension == 2 else [0.6, 0.0, -0.8]
    gravity = {"type": "gravity", "acceleration": 10.0, "direction": across}
    mesh = SLIDE["mesh"] | {"dimension": dimension} | ({"cells_across_width": 2} if dimension == 3 else {})
    case = gapbeam.read_case(SLIDE | {"model": KINDS[kind], "mesh": mesh, "load": [gravity]})
    model = build_model(case, MPI.COMM_SELF)
    end = 200 * STEP
    response = respond(model, seated(model).state, 200, end)
    mass = 7850.0 * 0.2 * 0.01 * 0.02
    w = 2.0 / STEP * atan(sqrt(STIFFNESS * 0.2 * 0.02 / mass) * STEP / 2.0)
    turning = end * sin(w * end) / w + (cos(w * end) - 1.0) / w**2  # integral of t cos(w t)
    exact = 8.0 * mass * 6.0 * (0.5 * end**2 - turning)
    assert response.history["sliding_work"][-1, 0] == pytest.approx(exact, rel=1e-3)


RUB = {"force": 1.0, "turns": 1.5, "mu": 0.1, "damping": 0.5, "gap": 0.5, "stiffness": 100.0}  # m = k = 1
AROUND, RUBBED, WORK_RATE = 256, 0.514884522543, 0.1149571542  # points, m, W


def annular_rub(steps: int, turns: int) -> tuple[March, State]:
    """Return a mass on two springs that a force which turns presses on points around a round gap, on its orbit.

    The points act together as one spring of the stiffness Kc does at the radius of the orbit, in the mean over angles.
    """
    force, speed, gap = RUB["force"], RUB["turns"], RUB["gap"]
    turned = 2.0 * pi * (np.arange(AROUND) + 0.5) / AROUND
    outward, along = (
        np.column_stack([np.cos(turned), np.sin(turned)]),
        np.column_stack([-np.sin(turned), np.cos(turned)]),
    )
    deepest = np.linspace(0.0, 2.0 * pi / AROUND, 64, endpoint=False)[:, None] - turned
    resultant = float(np.mean(np.sum(np.maximum(RUBBED * np.cos(deepest) - gap, 0.0) * np.cos(deepest), axis=1)))
    contact = ContactOperator(
        interface=Interface(2, np.arange(2), np.arange(2)),
        gap_matrix=csr_matrix(-outward),
        weights=np.ones(AROUND),
        initial_gap=np.full(AROUND, gap),
        faces=np.zeros(AROUND, dtype=int),
        support=Support((Face("hole", -1.0),), area=1.0),
        positions=np.zeros((AROUND, 3)),
        tangents=csr_matrix(along),
        measures_sliding=True,
    )
    pressed = RUB["stiffness"] * (RUBBED - gap)
    loads = (
        Load("across", np.array([1.0, 0.0]), lambda time: force * np.cos(speed * time)),
        Load("up", np.array([0.0, 1.0]), lambda time: force * np.sin(speed * time)),
    )
    system = SemiDiscreteSystem(DenseOperators(np.eye(2), np.eye(2)), contact, loads, mass_damping=RUB["damping"])
    law = ContactLaw(Spring(pressed / resultant), friction=CoulombFriction(RUB["mu"], 1.0e-7))
    scheme, period = scheme_of("discrete-gradient"), 2.0 * pi / speed
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), period / steps, turns * steps)
    lag = atan(
        (RUB["damping"] * speed * RUBBED + RUB["mu"] * pressed) / ((1.0 - speed**2) * RUBBED + pressed)
    )  # of the motion behind the force
    place = RUBBED * np.array([cos(lag), -sin(lag)])
    images = imaged(system.operators, place), imaged(system.operators, speed * np.array([-place[1], place[0]]))
    depth = contact.depth(place)
    return plan, begun(plan, State(0.0, *images, depth, law.static(depth).pressure))


def rub_rate(steps: int, turns: int) -> float:
    """Return the work rate of friction in an annular rub of some turns, W; the ledger has the same."""
    plan, start = annular_rub(steps, turns)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    for step in march(plan, start):
        accounts.take(step)
    assert accounts.sliding.by_face is not None
    work = RUB["mu"] * float(accounts.sliding.by_face[0])
    assert accounts.ledger.friction_loss == pytest.approx(work, rel=1e-6)
    return work / (plan.dt * plan.steps)


def test_work_rate_of_the_full_annular_rub() -> None:
    """The work rate mu N W r, with ((k - m W^2) r + N)^2 + (c W r + mu N)^2 = F^2: to 5e-4 with 128 steps a turn."""
    pressed, speed = RUB["stiffness"] * (RUBBED - RUB["gap"]), RUB["turns"]
    across = RUB["damping"] * speed * RUBBED + RUB["mu"] * pressed
    assert np.hypot((1.0 - speed**2) * RUBBED + pressed, across) == pytest.approx(RUB["force"], rel=1e-10)
    assert RUB["mu"] * pressed * speed * RUBBED == pytest.approx(WORK_RATE, rel=1e-9)
    assert rub_rate(128, 2) == pytest.approx(WORK_RATE, rel=5e-4)


@pytest.mark.slow(minutes=1)
def test_work_rate_of_the_full_annular_rub_is_exact() -> None:
    """To 1e-6 over three turns, from 256 and 512 steps a turn, whose errors are of second order."""
    coarse, fine = (rub_rate(steps, 3) for steps in (256, 512))
    assert 3.0 < (coarse - WORK_RATE) / (fine - WORK_RATE) < 5.0
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(WORK_RATE, rel=1e-6)
