"""The work of sliding by mode of motion, on motions whose parts are known by hand, in both marches."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.statistic_figures import LEAST_STEPS
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, instants_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged
from gapbeam.solver.system.slip_modes import SlipModes

MASS, WALL, DT = 2.0, 8.0e6, 1.0e-5
HALF = pi * sqrt(MASS / WALL)  # s: a bounce on the wall


def on_a_floor(
    start: tuple[float, float],
    speed: tuple[float, float],
    modes: SlipModes,
    steps: int,
    weight: float = 0.0,
    push: float = 0.0,
    friction: CoulombFriction | None = None,
    dt: float = DT,
) -> tuple[March, State]:
    """Return the march of a mass over a floor, x along it and z above it, pressed at the start if it is in it."""
    contact = ContactOperator(
        interface=Interface(2, np.arange(2), np.arange(2)),
        gap_matrix=csr_matrix([[0.0, 1.0]]),
        weights=np.ones(1),
        initial_gap=np.zeros(1),
        faces=np.zeros(1, dtype=int),
        support=Support((Face("floor", 1.0),), area=1.0),
        positions=np.zeros((1, 3)),
        tangents=csr_matrix([[1.0, 0.0]]),
        frictionless=friction is None,
        measures_sliding=True,
        slip_modes=modes,
    )
    operators = DenseOperators(MASS * np.eye(2), np.zeros((2, 2)))
    loads = tuple(
        Load(name, along, lambda _time, size=size: size)
        for name, along, size in (("weight", np.array([0.0, -1.0]), weight), ("push", np.array([1.0, 0.0]), push))
    )
    system, scheme = SemiDiscreteSystem(operators, contact, loads), scheme_of("discrete-gradient")
    plan = March(
        system, ContactLaw(Spring(WALL), friction=friction), scheme, EffectiveOperators(system, scheme), dt, steps
    )
    place, velocity = np.array(start), np.array(speed)
    depth = contact.depth(place)
    state = State(0.0, imaged(operators, place), imaged(operators, velocity), depth, WALL * np.maximum(depth, 0.0))
    return plan, begun(plan, state)


def parts_of(plan: March, start: State, compiled: bool) -> tuple[Array, float]:
    """Return work by mode, (3,), J, and the whole."""
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    if compiled:
        *_, last = CompiledLoop(plan).blocks(start, plan.steps, accounts)
        recorded = instants_of(last, len(last.times)).work_by_mode
        assert recorded is not None
        assert np.array_equal(recorded[-1], accounts.sliding.parts_by_face)
    else:
        for step in march(plan, start):
            accounts.take(step)
    parts, whole = accounts.sliding.parts_by_face, accounts.sliding.by_face
    assert parts is not None
    assert whole is not None
    return parts[0], float(whole[0])


both = pytest.mark.parametrize("compiled", [False, True], ids=["python", "compiled"])


@both
def test_a_mass_that_lies_and_slides_only_slides(compiled: bool) -> None:
    """N v T, and no impact, since it is pressed when the march begins."""
    weight, v, steps = 20.0, 0.3, 400
    parts, whole = parts_of(*on_a_floor((0.0, -weight / WALL), (v, 0.0), SlipModes(HALF), steps, weight), compiled)
    assert parts == pytest.approx([0.0, weight * v * steps * DT, 0.0], rel=1e-9)
    assert whole == pytest.approx(parts.sum(), rel=1e-14)


@both
def test_a_bounce_with_a_tangential_speed_is_an_impact(compiled: bool) -> None:
    """The impulse 2 m v_n of an elastic bounce times v_t, all of it impact; with half of its time just half of that.

    The force over a bounce is a half sine, of which the first half carries half of the impulse.
    """
    down, v = 0.5, 0.3
    steps = round(2.0 * HALF / DT)
    exact = 2.0 * MASS * down * v
    parts, whole = parts_of(*on_a_floor((0.0, 0.25 * HALF * down), (v, -down), SlipModes(1.01 * HALF), steps), compiled)
    assert parts == pytest.approx([exact, 0.0, 0.0], rel=1e-9)
    assert whole == pytest.approx(exact, rel=1e-9)
    parts, whole = parts_of(*on_a_floor((0.0, 0.25 * HALF * down), (v, -down), SlipModes(0.5 * HALF), steps), compiled)
    assert parts == pytest.approx([0.5 * exact, 0.5 * exact, 0.0], rel=1e-2)
    assert parts.sum() == pytest.approx(whole, rel=1e-14)


@both
@pytest.mark.parametrize(("share", "error"), [(1.0, 0.015), (0.5, 0.035)])
def test_six_steps_tell_the_impact_wherever_in_a_step_it_begins(compiled: bool, share: float, error: float) -> None:
    """All of a bounce, or its first half, at eight instants of closing: what `LEAST_STEPS` promises."""
    step = HALF / LEAST_STEPS
    for part in np.arange(0.5, 1.5, 0.125):
        at = (0.0, part * step * 0.5), (0.3, -0.5)
        parts, whole = parts_of(*on_a_floor(*at, SlipModes(share * HALF), 20, dt=step), compiled)
        assert parts[0] == pytest.approx(share * whole, rel=error)


def test_a_mass_that_friction_holds_sticks() -> None:
    """Pushed by half of the limit it creeps at v0 / sqrt(3), which is sticking and N v0 / sqrt(3) of work a second."""
    weight, mu, creep, steps = 20.0, 0.4, 1.0e-5, 400
    law = CoulombFriction(mu, creep)
    at = (0.0, -weight / WALL), (creep / sqrt(3.0), 0.0)
    plan, start = on_a_floor(*at, SlipModes(HALF, creep), steps, weight, 0.5 * mu * weight, law)
    parts, whole = parts_of(plan, start, compiled=False)
    assert parts == pytest.approx([0.0, 0.0, weight * creep / sqrt(3.0) * steps * DT], rel=1e-6)
    assert whole == pytest.approx(parts.sum(), rel=1e-14)


def test_both_marches_find_the_same_parts_which_add_up() -> None:
    """A beam between base and gland under noise for 500 steps: every part to 1e-8, their sum to round-off."""
    case = Path(__file__).parents[2] / "cases" / "random-vibration.toml"
    keys = ("model.elements=12", "time.step=2e-4", "time.end=0.1", "output.errors=none", "wear.impact_time=3e-4")
    simulation = gapbeam.model(gapbeam.read_case(case, keys))
    start = begun(simulation.plan, simulation.seat().state)
    found = []
    for compiled in (False, True):
        plan = simulation.plan
        accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
        if compiled:
            list(CompiledLoop(plan).blocks(start, plan.steps, accounts))
        else:
            for step in march(plan, start):
                accounts.take(step)
        parts, whole = accounts.sliding.parts_by_face, accounts.sliding.by_face
        assert parts is not None
        assert parts.sum(axis=1) == pytest.approx(whole, rel=1e-13)
        found.append(parts)
    assert np.all(found[0][:, :2].max(axis=0) > 1.0e-7)
    assert found[1] == pytest.approx(found[0], rel=1e-8, abs=1e-15)
