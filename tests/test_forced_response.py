"""Linear responses of a beam out of reach of its support, against closed forms; and base motion in its three forms."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from solver.analyses.transient import EffectiveOperators, March, march
from solver.energy import open_ledger
from solver.integrators.generalized_alpha import GeneralizedAlpha
from solver.integrators.midpoint import Midpoint
from solver.output.rows import Recorder
from solver.system import State, imaged
from tests.models import SOLID, beam_model, mass_of, out_of_reach, seat_of, stiffness_of

LENGTH, E, DENSITY = 0.51, 2.1e11, 7919.0
FREE = (4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464, 17.278759657399481)


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
    scheme = scheme or Midpoint()
    plan = March(model.system, model.law, scheme, EffectiveOperators(model.system, scheme), dt, steps)
    return [step.refreshed or step.new for step in march(plan, start or at_rest(model))]


def probe(model, name, found):
    """Displacement or velocity of a probe in the bending direction."""
    return np.array([model.probes[name].evaluate(x, model.system.operators)[-1] for x in found])


def free_beam_response(t, x, point, force, frequency, thickness, width, roots=FREE):
    """Displacement of a free Euler-Bernoulli beam under F sin(w t) from rest: two rigid motions and five modes.

    Each mode with mass m and natural w_n answers with phi(x) phi(point) F / m (sin w t - w/w_n sin w_n t) / (w_n^2 - w^2),
    a rigid one with (w t - sin w t) / w^2.
    """
    mass, omega = DENSITY * LENGTH * thickness * width, 2.0 * pi * frequency
    lever = (x / LENGTH - 0.5) * (point / LENGTH - 0.5) * 12.0
    total = (1.0 + lever) * (omega * t - np.sin(omega * t)) / omega**2
    for root in roots:
        ratio = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
        shape, at_point = (
            np.cosh(root * s) + np.cos(root * s) - ratio * (np.sinh(root * s) + np.sin(root * s))
            for s in (x / LENGTH, point / LENGTH)
        )
        natural = (root / LENGTH) ** 2 * thickness / np.sqrt(12.0) * np.sqrt(E / DENSITY)
        wave = np.sin(omega * t) - omega / natural * np.sin(natural * t)
        total = total + shape * at_point * wave / (natural**2 - omega**2)
    return total * force / mass


@pytest.mark.parametrize("dimension", [2, 3])
def test_free_beam_under_a_harmonic_force(dimension: int) -> None:
    """A slender free beam (4 mm) shaken at 60 Hz from rest: the sum of its closed-form modes within 0.3 % over 50 ms.

    The first natural frequency is 81.4 Hz; rigid motion alone would miss by over a tenth.
    Source: free-free eigenfunctions of Euler-Bernoulli beams and Duhamel's integral.
    """
    thickness, width, dt, steps = 0.004, 0.005, 5.0e-5, 1000
    mesh = {"size": 0.02, "support_size": 0.0125, "cells_through_thickness": 1, "dimension": dimension}
    mesh |= {"cells_across_width": 1} if dimension == 3 else {}
    shaker = {"type": "harmonic_force", "point": 0.15, "amplitude": 2.0, "frequency": 60.0}
    model = floating(
        beam_model(
            {
                "beam": {"thickness": thickness, "width": width},
                "mesh": mesh,
                "restraint": {"axial": 1.0e-3, "lateral": 1.0e-3},
            },
            (shaker,),
            {"tip": LENGTH, "test": 0.37},
        )
    )
    found = [state.u[0] for state in states(model, dt, steps)]
    t = dt * np.arange(1, steps + 1)
    for name, x in (("tip", LENGTH), ("test", 0.37)):
        expected = free_beam_response(t, x, 0.15, 2.0, 60.0, thickness, width)
        rigid = free_beam_response(t, x, 0.15, 2.0, 60.0, thickness, width, roots=())
        assert np.linalg.norm(rigid - expected) > 0.1 * np.linalg.norm(expected)
        error = np.linalg.norm(probe(model, name, found) - expected) / np.linalg.norm(expected)
        assert error < 3e-3


@pytest.mark.parametrize("scheme", [Midpoint(), Midpoint(implicit=True)])
def test_steady_state_of_a_damped_beam_is_the_discrete_one(scheme: Midpoint) -> None:
    """Started on its steady state the midpoint rule stays on it: u = Re U exp(i w t), to 1e-6 over 50 steps.

    The rule replaces w by w' = (2/dt) tan(w dt/2), so U = (K + i w' C - w'^2 M)^-1 F / cos(w dt/2) exactly, at any step.
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
        recorder = Recorder(model)
        start = at_rest(model)
        ledger = open_ledger(model.system, model.law, start)
        recorder.row(start, ledger)
        rows = [recorder.row(state, ledger) for state in states(model, dt, 50, start)]
        absolute, relative = (
            np.array([row[f"acceleration_{kind}"][0] for row in rows]) for kind in ("absolute", "relative")
        )
        t = dt * (np.arange(50) + 0.5)
        assert relative[:, -1] == pytest.approx(-20.0 * np.sin(2.0 * pi * 20.0 * t), abs=5e-5)
        assert np.abs(relative[:, :-1]).max() < 5e-5
        shares.append(np.abs(absolute[:, -1]).max() / 20.0)
        assert shares[-1] == pytest.approx((2.0 * pi * 20.0 * dt) ** 2 / 24.0, rel=0.02)
    assert shares[0] / shares[1] == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("scheme", [Midpoint(), GeneralizedAlpha.newmark(), GeneralizedAlpha.from_spectral_radius(0.5)])
def test_free_fall(scheme: Midpoint | GeneralizedAlpha) -> None:
    """A beam that nothing holds falls by g t^2 / 2 without straining: exact for these schemes.

    Round-off in K u leaves 1e-6 of the displacement, 5e-5 of the velocity.
    """
    model = floating(beam_model(probes={"tip": LENGTH, "end": 0.0}))
    last = states(model, 1.0e-3, 50, scheme=scheme)[-1]
    for name in ("tip", "end"):
        assert probe(model, name, [last.u[0]])[0] == pytest.approx(-0.5 * 9.81 * 0.05**2, rel=1e-6)
        assert probe(model, name, [last.v[0]])[0] == pytest.approx(-9.81 * 0.05, rel=5e-5)
    assert float(last.u[0] @ last.u[2]) < 1e-12
