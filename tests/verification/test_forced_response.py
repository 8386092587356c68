"""Linear responses of a beam out of reach of its support, against closed forms; and base motion in its three forms."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.system.semi_discrete import State, imaged
from tests.shared.models import SOLID, beam_model, mass_of, out_of_reach, seat_of, stiffness_of

LENGTH, E, DENSITY = 0.51, 2.1e11, 7919.0
FREE = (4.730040744862704, 7.853204624095838, 10.995607838001671, *((n + 0.5) * pi for n in range(4, 13)))
"""Roots of cos x cosh x = 1."""


def floating(model, **changes):
    """The model without contact."""
    return replace(model, system=replace(out_of_reach(model.system), **changes))


def at_rest(model, u=None, v=None):
    """A state at t = 0 without contact."""
    operators, contact = model.system.operators, model.system.contact
    zero = np.zeros(operators.size)
    depth = contact.depth(np.zeros(contact.interface.size))
    u, v = (imaged(operators, zero if x is None else x) for x in (u, v))
    return State(0.0, u, v, depth, np.zeros(contact.size))


def states(model, dt, steps, start=None, scheme=None):
    """All states of a march after its start."""
    scheme = scheme or scheme_of("discrete-gradient")
    plan = March(model.system, model.law, scheme, EffectiveOperators(model.system, scheme), dt, steps)
    return [step.refreshed or step.new for step in march(plan, start or at_rest(model))]


def probe(model, name, found):
    """Displacement or velocity of a probe in the bending direction."""
    return np.array([model.probes[name].evaluate(x, model.system.operators)[-1] for x in found])


def mode(root, s):
    """Free-free mode of mean square 1 at s = x / L: cosh + cos - q (sinh + sin) of z = root s, without cancellation."""
    k, z = root, root * s
    short = (np.cos(k) - np.sin(k) - np.exp(-k)) / (np.sinh(k) - np.sin(k))  # 1 - q
    q = 1.0 - short
    return 0.5 * (short * np.exp(z) + (1.0 + q) * np.exp(-z)) + np.cos(z) - q * np.sin(z)


def free_beam_response(t, x, point, force, frequency, thickness, width, roots):
    """Displacement of a free Euler-Bernoulli beam under F cos(w t) from rest: two rigid motions and some modes.

    A mode of natural frequency w_n takes part with phi(x) phi(point) (cos w t - cos w_n t) / (w_n^2 - w^2), a rigid
    motion with (1 - cos w t) / w^2, times F over the mass of the beam.
    """
    mass, omega = DENSITY * LENGTH * thickness * width, 2.0 * pi * frequency
    lever = (x / LENGTH - 0.5) * (point / LENGTH - 0.5) * 12.0
    total = (1.0 + lever) * (1.0 - np.cos(omega * t)) / omega**2
    for root in roots:
        natural = (root / LENGTH) ** 2 * thickness / np.sqrt(12.0) * np.sqrt(E / DENSITY)
        shapes = mode(root, x / LENGTH) * mode(root, point / LENGTH)
        total = total + shapes * (np.cos(omega * t) - np.cos(natural * t)) / (natural**2 - omega**2)
    return total * force / mass


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("dimension", [2, 3])
def test_free_beam_under_a_harmonic_force(dimension: int) -> None:
    """A slender free beam (4 mm) shaken with 60 Hz from rest for 25 ms: the sum of its closed-form modes.

    The first natural frequency is 81.4 Hz. The error, mostly of the step and the cells, is below 0.6 % of the elastic
    part, which is a third of the motion or more.
    Source: free-free eigenfunctions of Euler-Bernoulli beams and Duhamel's integral.
    """
    thickness, width, dt, steps, force, frequency, point = 0.004, 0.005, 5.0e-5, 500, 2.0, 60.0, 0.15
    mesh = {"dimension": dimension, "size": 0.02, "support_size": 0.02, "edge_size": 0.02, "cells_through_thickness": 1}
    mesh |= {"cells_across_width": 1} if dimension == 3 else {}
    shaker = {"type": "harmonic_force", "point": point, "amplitude": force, "frequency": frequency, "phase": 90.0}
    beam = {
        "beam": {"thickness": thickness, "width": width},
        "mesh": mesh,
        "restraint": {"axial": 1.0e-3, "lateral": 1.0e-3},
    }
    places = {"tip": LENGTH, "middle": 0.5 * LENGTH}
    model = floating(beam_model(beam, (shaker,), places))
    found = [state.u[0] for state in states(model, dt, steps)]
    t = dt * np.arange(1, steps + 1)
    for name, x in places.items():
        expected = free_beam_response(t, x, point, force, frequency, thickness, width, FREE)
        rigid = free_beam_response(t, x, point, force, frequency, thickness, width, ())
        elastic = np.linalg.norm(expected - rigid)
        assert elastic > 0.33 * np.linalg.norm(expected)
        assert np.linalg.norm(probe(model, name, found) - expected) < 6e-3 * elastic


@pytest.mark.parametrize("scheme", [scheme_of("discrete-gradient"), scheme_of("implicit-midpoint")])
def test_steady_state_of_a_damped_beam_is_the_discrete_one(scheme: TimeScheme) -> None:
    """Started on its steady state the midpoint rule stays on it: u = Re U exp(i w t), to 1e-6 over 50 steps.

    The rule replaces w by w' = (2/dt) tan(w dt/2), so U = (K + i w' C - w'^2 M)^-1 F / cos(w dt/2) at any step.
    Stiffness and mass damping, the force and its direction and the matrices of every step take part.
    Source: substitution of the harmonic motion into the rule.
    """
    dt, frequency, mass_damping, stiffness_damping = 1.0e-3, 60.0, 30.0, 2.0e-5
    shaker = {"type": "harmonic_force", "point": 0.15, "amplitude": 20.0, "frequency": frequency, "phase": 90.0}
    model = floating(
        beam_model({"damping": {"mass": mass_damping, "stiffness": stiffness_damping}}, (shaker,), {"tip": LENGTH})
    )
    mass, stiffness = mass_of(model), stiffness_of(model)
    omega = 2.0 * pi * frequency
    warped = 2.0 / dt * np.tan(0.5 * omega * dt)
    damping = mass_damping * mass + stiffness_damping * stiffness
    dynamic = (stiffness + 1j * warped * damping - warped**2 * mass).tocsc()
    force = model.system.loads[0].pattern * 20.0
    motion = spsolve(dynamic, force) / np.cos(0.5 * omega * dt)
    start = at_rest(model, motion.real.copy(), (1j * warped * motion).real.copy())
    end = states(model, dt, 50, start, scheme)[-1]
    turn = np.exp(1j * omega * 50 * dt)
    for found, expected in ((end.u[0], motion * turn), (end.v[0], 1j * warped * motion * turn)):
        assert np.linalg.norm(found - expected.real) < 1e-6 * np.linalg.norm(expected)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("dimension", [2, 3])
def test_base_motion_given_in_three_quantities(dimension: int) -> None:
    """Acceleration A, velocity A/w a quarter period behind and displacement A/w^2 in opposition: to 1e-10.

    Of a seated beam and of one that floats and falls.
    """
    omega = 2.0 * pi * 20.0
    quantities = {"acceleration": (3.0, 0.0), "velocity": (3.0 / omega, -90.0), "displacement": (3.0 / omega**2, 180.0)}
    motions = []
    for quantity, (amplitude, phase) in quantities.items():
        base = {"type": "base_motion", "quantity": quantity, "amplitude": amplitude, "frequency": 20.0, "phase": phase}
        model = beam_model({"mesh": SOLID if dimension == 3 else {}}, ({"type": "gravity"}, base), {"tip": LENGTH})
        found = states(model, 1.0e-3, 20, seat_of(model).state) + states(floating(model), 1.0e-3, 20)
        motions.append(probe(model, "tip", [state.u[0] for state in found]))
    accelerated, moved, displaced = motions
    span = np.repeat([np.ptp(accelerated[:20]), np.ptp(accelerated[20:])], 20)
    assert span.min() > 1e-5
    assert np.all(np.abs(moved - accelerated) < 1e-10 * span)
    assert np.all(np.abs(displaced - accelerated) < 1e-10 * span)


@pytest.mark.parametrize("dimension", [2, 3])
def test_floating_beam_stays_behind_when_its_support_moves(dimension: int) -> None:
    """The rigid limit: without contact the absolute acceleration is zero, the relative one minus the base's.

    Up to (w dt)^2 / 24 of it, what the midpoint differs from the mean over a step; a quarter of that at half the step.
    """
    shares = []
    for dt in (1.0e-3, 5.0e-4):
        base = {"type": "base_motion", "amplitude": 20.0, "frequency": 20.0}
        model = floating(beam_model({"mesh": SOLID if dimension == 3 else {}}, (base,), {"tip": LENGTH}))
        recorder = Recorder(model.case, model)
        start = at_rest(model)
        accounts = Accounts.opened(model.system, model.law, start, dt)
        recorder.row(start, accounts)
        rows = [recorder.row(state, accounts) for state in states(model, dt, 50, start)]
        absolute, relative = (
            np.array([row[f"acceleration_{kind}"][0, 0] for row in rows]) for kind in ("absolute", "relative")
        )
        t = dt * (np.arange(50) + 0.5)
        assert relative[:, -1] == pytest.approx(-20.0 * np.sin(2.0 * pi * 20.0 * t), abs=5e-5)
        assert np.abs(relative[:, :-1]).max() < 5e-5
        shares.append(np.abs(absolute[:, -1]).max() / 20.0)
        assert shares[-1] == pytest.approx((2.0 * pi * 20.0 * dt) ** 2 / 24.0, rel=0.02)
    assert shares[0] / shares[1] == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("scheme", map(scheme_of, ["discrete-gradient", "newmark", "generalized-alpha"]))
def test_free_fall(scheme: TimeScheme) -> None:
    """A beam that nothing holds falls by g t^2 / 2 without straining: exact for these schemes.

    Round-off in K u leaves 1e-6 of the displacement, 5e-5 of the velocity.
    """
    model = floating(beam_model(probes={"tip": LENGTH, "end": 0.0}))
    last = states(model, 1.0e-3, 50, scheme=scheme)[-1]
    for name in ("tip", "end"):
        assert probe(model, name, [last.u[0]])[0] == pytest.approx(-0.5 * 9.81 * 0.05**2, rel=1e-6)
        assert probe(model, name, [last.v[0]])[0] == pytest.approx(-9.81 * 0.05, rel=5e-5)
    assert float(last.u[0] @ last.u[2]) < 1e-12
