"""The midpoint rule with exact frequencies: free motion, statics, energy in contact, order, and steps that it saves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.scene.linear_scheme import LinearScheme
from gapbeam.solver.scene.scene import Scene

EXACT = gb.midpoint(exact_frequencies=True)


def test_free_vibration_is_exact() -> None:
    """Eight steps a period: a cosine; with a damper, an exponential of the exact root at every step."""
    mass = gb.mass(2.0, stiffness=2.0 * 3.0**2)
    h = 2 * np.pi / 3.0 / 8
    scene = gb.Scene(mass)
    found = gb.history(scene, h, 800 * h, scene.state({mass: 0.7}, {mass: -1.2}), EXACT)
    assert np.allclose(found.displacement["at"], 0.7 * np.cos(3 * found.t) - 0.4 * np.sin(3 * found.t), atol=1e-11)
    assert found.last["at"].velocity == pytest.approx(-1.2, abs=1e-10)
    assert found.last.balance == pytest.approx(0.5 * 2.0 * 1.2**2 + 0.5 * 18.0 * 0.7**2, rel=1e-12)
    plain = gb.history(scene, h, 800 * h, scene.state({mass: 0.7}, {mass: -1.2}))
    assert np.abs(plain.displacement["at"] - found.displacement["at"]).max() > 1.0
    for damping in (0.4, 14.0):  # below and beyond critical damping, 2 m w = 12
        damped = gb.Scene(gb.mass(2.0, stiffness=2.0 * 3.0**2, damping=damping))
        x = gb.history(damped, h, 40 * h, damped.state({damped.structures[0]: 0.7}), EXACT).displacement["at"]
        roots = np.exp(h * np.roots([2.0, damping, 18.0]))
        assert np.abs(x[2:] - roots.sum().real * x[1:-1] + roots.prod().real * x[:-2]).max() < 1e-13


def test_statics_and_rigid_motions_are_exact() -> None:
    """A beam under a sudden weight comes to its static sag; a free mass accelerates as Newton says."""
    body = gb.from_modes(2 * np.pi * np.array([5.0, 30.0, 90.0]), 0.3, {"tip": [1.0, -0.8, 0.6]})
    scene = gb.Scene(body, loads=[gb.Force(body["tip"], 10.0)])
    found = gb.history(scene, 0.01, 20.0, scheme=EXACT)
    assert found.displacement["tip"][-1] == pytest.approx(float(gb.seat(scene).q[:, 0] @ [1.0, -0.8, 0.6]), rel=1e-10)
    free = gb.mass(2.0)
    thrown = gb.history(gb.Scene(free, loads=[gb.Force(free["at"], 3.0)]), 0.1, 2.0, scheme=EXACT)
    assert thrown.displacement["at"][-1] == pytest.approx(0.5 * 1.5 * 2.0**2, rel=1e-12)


def rattle(damping: float = 0.0, stiffness: float = 3e4) -> Scene:
    modes = np.arange(5) + 0.5
    shapes = np.sqrt(2.0) * np.sin(np.outer([0.5, 1.0], modes) * np.pi)
    body = gb.from_modes(2 * np.pi * 4 * modes**1.5, damping, {"middle": shapes[0], "tip": shapes[1]}, name="body")
    gap = gb.Contact(body["tip"], gb.Slot(2e-3), gb.KelvinVoigt(stiffness=stiffness), name="gap")
    push = gb.Force(body["middle"], lambda t: 3.0 * np.sin(2 * np.pi * 3.0 * t))
    return gb.Scene(body, contacts=[gap], loads=[push])


def test_energy_in_contact_is_kept() -> None:
    """Forced, undamped, with many impacts and modes that the step does not resolve: the balance holds to round-off."""
    found = gb.history(rattle(), 1.0 / 150, 20.0, scheme=EXACT)
    assert np.count_nonzero(np.diff((found.force["gap"] != 0.0).astype(int)) > 0) > 50
    passed = sum(abs(one) for one in found.last.energy.values())
    assert abs(found.last.balance) < 1e-11 * passed


def test_order_is_two_and_half_of_the_steps_do() -> None:
    """Periodic contact: errors of the orbit against 6400 steps a period fall by four; 200 steps do what 400 did."""
    scene, period = rattle(0.05, 3e3), 1.0 / 3.0
    start = gb.history(scene, period / 400, 100 * period, scheme=EXACT).last.state
    start.t = 0.0

    def orbit(n: int, scheme: LinearScheme) -> Any:
        found = gb.periodic(scene, period, n, start, scheme=scheme)
        x = gb.history(scene, period / n, period, found.state, scheme).displacement["tip"]
        return x[n // 100 - 1 :: n // 100]

    best = orbit(6400, EXACT)
    size = np.ptp(best)

    def error(n: int, scheme: LinearScheme) -> float:
        return float(np.sqrt(np.mean((orbit(n, scheme) - best) ** 2)) / size)

    exact = {n: error(n, EXACT) for n in (200, 400, 800)}
    plain = {n: error(n, gb.midpoint()) for n in (200, 400)}
    assert exact[200] / exact[400] == pytest.approx(4.0, rel=0.1)
    assert exact[400] / exact[800] == pytest.approx(4.0, rel=0.1)
    assert exact[200] < plain[400]
    assert plain[200] > 3.0 * exact[200]


def test_large_structures_are_refused() -> None:
    """Exact frequencies are those of modes."""
    n = 700
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    scene = gb.Scene(gb.Structure(np.eye(n), K, points={"end": 0}))
    with pytest.raises(gb.UserError, match="exact frequencies are for modes"):
        gb.history(scene, 0.1, 1.0, scheme=EXACT)
