"""Parameters of least figures: against closed forms and a fine grid."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import minimize_scalar

import gapbeam as gb


@pytest.mark.slow(minutes=0.1)
def test_the_best_absorber_is_that_of_the_receptance_of_midpoint_steps() -> None:
    """|U_1| of U = (K cos a + i C w sin a / a - M (w / a)^2 sin^2 a / cos a)^-1 F, a = pi / steps, over the joint."""
    w, c, steps = 1.3, 0.05, 40

    def make(p: dict[str, float]) -> gb.Scene:
        body, small = gb.mass(1.0, stiffness=2.0, damping=0.1, name="body"), gb.mass(0.1, name="small")
        joint = gb.Joint((small["at"], body["at"]), stiffness=p["stiffness"], damping=c)
        return gb.Scene(body, small, joints=[joint], loads=[gb.Force(body["at"], lambda t: np.cos(w * t))])

    def amplitude(k: float) -> float:
        a, pair = pi / steps, np.array([[1.0, -1.0], [-1.0, 1.0]])
        K, C, M = k * pair + np.diag([2.0, 0.0]), c * pair + np.diag([0.1, 0.0]), np.diag([1.0, 0.1])
        whole = K * np.cos(a) + 1j * C * w * np.sin(a) / a - M * (w / a) ** 2 * np.sin(a) ** 2 / np.cos(a)
        return float(abs(np.linalg.solve(whole, [1.0, 0.0])[0]))

    first = {"stiffness": 0.12}
    period = 2.0 * pi / w
    start = gb.periodic(make(first), period, steps).state
    over = {"stiffness": (0.05, first["stiffness"], 0.4)}
    found = gb.optimize(make, "body.at.harmonic_1", over, period=period, steps=steps, start=start)
    exact = minimize_scalar(amplitude, bounds=(0.05, 0.4), method="bounded", options={"xatol": 1e-9})
    assert found.values["stiffness"] == pytest.approx(exact.x, rel=1e-5)
    assert found.tangents.values["body.at.harmonic_1"] == pytest.approx(exact.fun, rel=1e-9)
    assert found.is_stable


@pytest.mark.slow(minutes=0.3)
def test_the_least_motion_with_forces_below_a_limit_is_that_of_a_fine_grid() -> None:
    """A smaller gap moves less and hits harder: the best one lies on the limit, between two members of the grid."""
    period, steps, limit = 2.0 * pi / 0.8, 200, 2.0
    body = gb.mass(1.0, stiffness=1.0, damping=0.1)
    stop = gb.Contact(body["at"], gb.Slot(1.0), gb.KelvinVoigt(stiffness=30.0, damping=0.5), name="stop")
    scene = gb.Scene(body, contacts=[stop], loads=[gb.Force(body["at"], lambda t: 0.5 * np.cos(0.8 * t))])
    grid = np.linspace(0.6, 1.2, 121)
    many = gb.ensemble(scene, {"stop.clearance": grid}, step=period / steps, end=80 * period, settle=79 * period)
    best = int(np.argmin(np.where(many.peak_force["stop"] <= limit, many.rms["at"], np.inf)))
    near = gb.history(scene, period / steps, 60 * period).last.state
    near.t = 0.0
    over, kept = {"stop.clearance": (0.6, 1.0, 1.2)}, {"period": period, "steps": steps, "start": near}
    found = gb.optimize(scene, "at.rms", over, limits={"stop.peak_force": limit}, **kept)
    assert grid[best - 1] <= found.values["stop.clearance"] <= grid[best]
    assert found.tangents.values["stop.peak_force"] == pytest.approx(limit, rel=1e-6)
    assert found.tangents.values["at.rms"] <= many.rms["at"][best]
    with pytest.raises(gb.NotConverged, match=r"limit of stop\.peak_force"):
        gb.optimize(scene, "at.rms", over, limits={"stop.peak_force": 0.1}, passes=2, **kept)
    with pytest.raises(gb.UserError, match=r"expected \(lowest, first, highest\) by path"):
        gb.optimize(scene, "at.rms", {"stop.clearance": (1.0, 0.5, 2.0)}, **kept)


@pytest.mark.parametrize("seed", range(3))
def test_a_search_that_fails_says_what_came_nearest(seed: int) -> None:
    """Of a linear mass the stiffest spring moves least; a limit below that is kept nowhere, and that is said."""
    random = np.random.default_rng(seed)
    period, steps, soft = 2.0 * pi / 0.8, 100, float(random.uniform(2.0, 3.0))
    stiff = soft * float(random.uniform(1.5, 3.0))

    def make(p: dict[str, float]) -> gb.Scene:
        body = gb.mass(1.0, stiffness=1.0, damping=0.4, name="body")
        joint = gb.Joint((body["at"],), stiffness=p["k"])
        return gb.Scene(body, joints=[joint], loads=[gb.Force(body["at"], lambda t: np.cos(0.8 * t))])

    start = gb.periodic(make({"k": soft}), period, steps).state
    scene = make({"k": stiff})
    one = gb.history(scene, period / steps, period, gb.periodic(scene, period, steps).state)
    least = float(np.abs(one.displacement["at"]).max())
    asked = {"period": period, "steps": steps, "start": start, "limits": {"at.peak": 0.5 * least}}
    with pytest.raises(gb.NotConverged, match=r"none of \d+ responses kept the limits at.peak = ") as caught:
        gb.optimize(make, "at.rms", {"k": (soft, soft, stiff)}, **asked)
    words = str(caught.value).rpartition("the nearest was k = ")[2]
    assert float(words.partition(",")[0]) == pytest.approx(stiff, rel=1e-4)
    assert float(words.rpartition("at.peak = ")[2]) == pytest.approx(least, rel=1e-3)


@pytest.mark.parametrize("others", [0, 1])
def test_figures_take_structure_and_point_however_many_structures_there_are(others: int) -> None:
    """The motion without contact, f / |k - m w^2|: of a single structure only "at" was known."""
    w, f = 0.8, 0.1
    body, free = gb.mass(1.0, stiffness=1.0, damping=0.1, name="body"), gb.mass(1.0, stiffness=3.0, name="other")
    stop = gb.Contact(body["at"], gb.HalfPlane(9.0), gb.KelvinVoigt(stiffness=30.0), name="stop")
    shaker = gb.Force(body["at"], lambda t, size: size * np.cos(w * t), name="shaker", size=f)
    scene = gb.Scene(body, *[free] * others, contacts=[stop], loads=[shaker])
    asked, exact = {"period": 2.0 * pi / w, "steps": 400}, f / abs(1.0 - w * w + 0.1j * w)
    orbit = gb.periodic(scene, start=scene.state(), **asked).state
    found = gb.tangents(scene, ["body.at.harmonic_1"], {"shaker.size": f}, start=orbit, **asked)
    assert found.values["body.at.harmonic_1"] == pytest.approx(exact, rel=1e-3)
    limits = {"peak/body.at": 1.1 * exact, "peak_force/stop": 1.0}
    given = {"shaker.size": stats.uniform(0.0, 2.0 * f)}
    spread = gb.uncertain(scene, given, limits=limits, members=256, settle=60, measure=1, **asked)
    point = "body.at" if others else "at"
    over = spread.exceeded[f"peak/{point}"]
    assert over.low <= 0.45 <= over.high
