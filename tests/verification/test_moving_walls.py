"""A mass before a wall that moves as given: balls, closed springs, resting masses, and the work of the wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.system.operators import Load, WallMotion, Walls
from gapbeam.solver.system.semi_discrete import VALUE, SemiDiscreteSystem, State
from tests.shared.dense_beams import dense_beam, thrown_start
from tests.shared.toys import SCHEMES, ledger_of, start, steps_of, stopped_oscillator

STIFFNESS = 1.0e6
Function = Callable[[Any], Any]


def before_a_wall(place: Function, speed: Function, gap: float = 0.0, **more: Any) -> SemiDiscreteSystem:
    """A mass that meets a stop above it, which comes down by `place`: the gap is gap - u - place."""
    system = stopped_oscillator(gap=gap, **more)
    walls = Walls((WallMotion(len(system.loads), place, speed),), np.array([[-1.0]]))
    wall = Load("wall", np.zeros(1), lambda _time: 0.0)
    return replace(system, contact=replace(system.contact, walls=walls), loads=(*system.loads, wall))


def steady(speed: float) -> tuple[Function, Function]:
    """A wall of one speed."""
    return lambda time: speed * time, lambda time: speed + 0.0 * time


@pytest.mark.parametrize("name", SCHEMES)
def test_a_ball_that_a_moving_wall_hits(name: str) -> None:
    """A ball at rest leaves an elastic wall of speed w with 2 w; the work of the wall is what the ball has gained."""
    speed, scheme = 0.3, SCHEMES[name]
    law, system = kelvin_voigt(STIFFNESS), before_a_wall(*steady(speed), gap=1.0e-3)
    dt = 0.01 * 2.0 * pi / np.sqrt(STIFFNESS)
    state = start(system)
    steps = steps_of(system, law, scheme, state, dt, 200)
    ledger = ledger_of(system, law, state, steps)
    last = steps[-1].new
    assert last.pressure[0] == 0.0
    assert last.v[VALUE][0] == pytest.approx(-2.0 * speed, rel=1.0e-9 if scheme.conserves_energy else 0.03)
    assert last.depth[0] == pytest.approx(-(1.0e-3 - last.u[VALUE][0] - speed * last.time), rel=1e-9)
    assert abs(ledger.residual) < 1.0e-11 * ledger.kinetic
    assert ledger.load_work[0] == pytest.approx(ledger.kinetic + ledger.algorithmic, rel=1e-11)
    if scheme.conserves_energy:
        assert abs(ledger.algorithmic) < 1.0e-9 * ledger.kinetic


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_impulses_of_a_moving_wall(restitution: float) -> None:
    """By Moreau and Jean's scheme the ball leaves with (1 + e) w, and the wall does m (1 + e) w^2 of work."""
    speed, scheme = 0.3, scheme_of("moreau-jean", restitution=restitution)
    law, system = replace(kelvin_voigt(STIFFNESS), stores_energy=False), before_a_wall(*steady(speed), gap=1.05e-3)
    state = start(system)
    steps = steps_of(system, law, scheme, state, 1.0e-4, 100)
    ledger = ledger_of(system, law, state, steps)
    assert steps[-1].new.v[VALUE][0] == pytest.approx(-(1.0 + restitution) * speed, rel=1e-9)
    assert ledger.load_work[0] == pytest.approx((1.0 + restitution) * speed**2, rel=1e-9)
    assert abs(ledger.residual) < 1.0e-11 * ledger.kinetic


def constant_acceleration(acceleration: float) -> tuple[Function, Function]:
    """A wall that midpoint rules follow exactly."""
    return lambda time: 0.5 * acceleration * time**2, lambda time: acceleration * time


@pytest.mark.parametrize("scheme", ["discrete-gradient", "implicit-midpoint"])
def test_a_wall_reproduces_the_frame_that_moves(scheme: str) -> None:
    """A wall that moves by w, or the inertia of w'' in its frame: u differs by w, through impacts, to round-off.

    The relative motion satisfies the same discrete equations where the scheme integrates w exactly.
    """
    acceleration, dt = 40.0, 2.0e-4
    law = kelvin_voigt(STIFFNESS, damping=200.0)
    place, speed = constant_acceleration(acceleration)
    moved = before_a_wall(place, speed, gap=1.0e-3)
    shaken = stopped_oscillator(gap=1.0e-3, force=lambda _time: acceleration)
    chosen = scheme_of(scheme)
    absolute = steps_of(moved, law, chosen, start(moved), dt, 400)
    relative = steps_of(shaken, law, chosen, start(shaken), dt, 400)
    assert max(step.new.pressure[0] for step in relative) > 0.0
    pairs = list(zip(absolute, relative, strict=True))
    apart = [one.new.u[VALUE][0] + place(one.new.time) - two.new.u[VALUE][0] for one, two in pairs]
    assert np.max(np.abs(apart)) < 1.0e-12 * place(absolute[-1].new.time)
    depths = np.array([[one.new.depth[0], two.new.depth[0]] for one, two in pairs])
    assert np.max(np.abs(depths[:, 0] - depths[:, 1])) < 1.0e-12 * place(absolute[-1].new.time)


def test_harmonic_walls_reproduce_the_frame_to_second_order() -> None:
    """A mass on a spring to the wall, pressed all the time: the difference to the moving frame falls as dt^2."""
    omega, amplitude, load = 40.0, 1.0e-3, 3.0

    def place(time: Any) -> Any:
        return amplitude * (1.0 - np.cos(omega * time))

    def speed(time: Any) -> Any:
        return amplitude * omega * np.sin(omega * time)

    law = kelvin_voigt(1.0e4, damping=20.0)
    moved = before_a_wall(place, speed, force=lambda _time: load)
    shaken = stopped_oscillator(force=lambda time: load + amplitude * omega**2 * float(np.cos(omega * time)))
    apart = []
    for dt in (1.0e-3, 5.0e-4, 2.5e-4):
        ends = []
        for system in (moved, shaken):
            state = replace(start(system, u=load / 1.0e4), pressure=np.array([load]))
            ends.append(steps_of(system, law, scheme_of("discrete-gradient"), state, dt, round(0.2 / dt))[-1].new)
        apart.append(abs(ends[0].u[VALUE][0] + place(0.2) - ends[1].u[VALUE][0]))
    assert np.log2(np.array(apart[:-1]) / apart[1:]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", SCHEMES)
def test_a_pressed_mass_follows_its_wall(name: str) -> None:
    """A wall that moves slowly carries a mass with it: u = -w, the force is the load, the work load times way."""
    load, law, way, duration = 2.0, kelvin_voigt(STIFFNESS, damping=1.0e3), 2.0e-3, 0.4

    def place(time: Any) -> Any:
        s = np.clip(time / duration, 0.0, 1.0)
        return way * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    def speed(time: Any) -> Any:
        s = np.clip(time / duration, 0.0, 1.0)
        return way * 30.0 * s * s * (1.0 - s) ** 2 / duration

    system = before_a_wall(place, speed, force=lambda _time: load)
    deep = load / STIFFNESS
    state: State = replace(start(system, u=deep), pressure=np.array([load]))
    dt = 2.0e-4
    steps = steps_of(system, law, SCHEMES[name], state, dt, round(0.5 / dt))
    ledger, last = ledger_of(system, law, state, steps), steps[-1].new
    assert last.u[VALUE][0] == pytest.approx(deep - way, rel=1e-6)
    assert last.pressure[0] == pytest.approx(load, rel=1e-5)
    assert ledger.load_work[1] == pytest.approx(load * way, rel=1e-4)
    assert ledger.load_work[0] == pytest.approx(-load * way, rel=1e-6)
    assert abs(ledger.residual) < 1.0e-11 * load * way


def dissipated(scheme: TimeScheme, law: ContactLaw, wall: float, speed: float) -> float:
    """What the damper takes when a mass of a speed meets a wall of another."""
    system = before_a_wall(*steady(wall), gap=1.0e-4)
    state = start(system, v=speed)
    return ledger_of(system, law, state, steps_of(system, law, scheme, state, 2.0e-5, 400)).contact_loss


@pytest.mark.parametrize("name", ["discrete-gradient", "implicit-midpoint", "generalized-alpha", "newmark"])
def test_dampers_see_the_speed_of_the_wall(name: str) -> None:
    """Mass or wall moves: the same relative speed costs the same energy in the damper of the contact."""
    law = kelvin_voigt(STIFFNESS, damping=300.0)
    still = dissipated(SCHEMES[name], law, 0.0, 0.5)
    assert still > 0.01
    assert dissipated(SCHEMES[name], law, 0.5, 0.0) == pytest.approx(still, rel=1e-9)
    assert dissipated(SCHEMES[name], law, 0.2, 0.3) == pytest.approx(still, rel=1e-9)


COMPILED = {
    "kelvin-voigt": kelvin_voigt(1.0e5, 30.0, touch_depth=1.0e-5),
    "by touch speed": ContactLaw(
        Spring(2.0e6, 1.5), Damper("hunt-crossley", 0.0), touch_product=0.6, slowest_touch=1e-4
    ),
}


@pytest.mark.parametrize("law", COMPILED)
@pytest.mark.parametrize("scheme", ["discrete-gradient", "implicit-midpoint", "generalized-alpha"])
def test_the_compiled_loop_moves_walls_as_the_march_does(scheme: str, law: str) -> None:
    """Two motions of the walls of a dense body: places, forces, energies and the work of each, to round-off."""
    still = dense_beam(seed=3)
    growths = np.stack([np.where(still.contact.faces == 0, 1.0, -1.0), np.linspace(0.2, 1.0, still.contact.size)])
    motions = (
        WallMotion(3, lambda time: 5.0e-3 * np.sin(20.0 * time), lambda time: 0.1 * np.cos(20.0 * time)),
        WallMotion(2, *steady(-2.0e-2)),
    )
    walls = [Load(name, np.zeros(8), lambda _time: 0.0) for name in ("closing", "shaken")]
    contact = replace(still.contact, walls=Walls(motions, growths))
    system = replace(still, contact=contact, loads=(*still.loads, *walls))
    chosen, found_law, steps, dt = SCHEMES[scheme], COMPILED[law], 150, 1.0e-3
    plan, first = March(system, found_law, chosen, EffectiveOperators(system, chosen), dt, steps), thrown_start(system)
    expected = Accounts.opened(system, found_law, begun(plan, first), dt)
    for step in march(plan, first):
        expected.take(step)
    end = step.refreshed or step.new
    passed = Accounts.opened(system, found_law, begun(plan, first), dt)
    *_, block = CompiledLoop(plan).blocks(first, accounts=passed, stops=40)
    scale, ledger = expected.ledger.exchanged, expected.ledger
    assert np.min(np.abs(ledger.load_work[2:])) > 1.0e-3 * scale
    assert passed.ledger.load_work == pytest.approx(ledger.load_work, abs=1e-8 * scale)
    for name in ("kinetic", "strain", "contact", "contact_loss", "algorithmic", "residual", "exchanged"):
        assert getattr(passed.ledger, name) == pytest.approx(getattr(ledger, name), abs=1e-8 * scale), name
    assert abs(passed.ledger.residual) < 1.0e-9 * scale
    assert block.end.u[VALUE] == pytest.approx(end.u[VALUE], abs=1e-7 * np.max(np.abs(end.u[VALUE])))
    assert block.end.depth == pytest.approx(end.depth, abs=1e-7 * np.max(np.abs(end.depth)))
    assert passed.peaks.force == pytest.approx(expected.peaks.force, rel=1e-7)
    with pytest.raises(ValueError, match="still walls"):
        CompiledLoop(plan).tangent(first)
