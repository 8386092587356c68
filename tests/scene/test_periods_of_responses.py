"""Periods of responses: those of the loads, in steps that see these, from functions that may fail."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats

import gapbeam as gb

W = 2.6
PERIOD = 2.0 * np.pi / W


def scene(wall: bool = False) -> gb.Scene:
    """Return an oscillator with a stop under a harmonic force, or above a stop that moves."""
    body = gb.mass(1.0, stiffness=1.0, damping=0.2, name="body")
    moved = {"wall": lambda t: 0.1 * np.cos(W * t)} if wall else {}
    stop = gb.Contact(body["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=30.0), name="stop", **moved)
    push = gb.Force(body["at"], 0.3 if wall else lambda t: 1.7 * np.cos(W * t), name="shaker")
    return gb.Scene(body, contacts=[stop], loads=[push])


OVER = {"stop.clearance": 0.5}
CALLS: dict[str, Callable[[gb.Scene, Any, int], Any]] = {
    "atlas": lambda one, period, steps: gb.atlas(
        one, period=period, starts=gb.drawn_starts(one, 2, displacement={"at": (-0.5, 0.4)}), steps=steps,
        settle=5, rounds=1,
    ),
    "uncertain": lambda one, period, steps: gb.uncertain(
        one, {"stop.clearance": stats.uniform(0.4, 0.2)}, period=period, steps=steps, members=32, settle=5, rounds=1,
        measure=2,
    ),
    "periodic": lambda one, period, steps: gb.periodic(one, period, steps),
    "tangents": lambda one, period, steps: gb.tangents(
        one, ["at.rms"], OVER, period=period, steps=steps, start=one.state()
    ),
    "optimize": lambda one, period, steps: gb.optimize(
        one, "at.rms", {"stop.clearance": (0.3, 0.5, 0.7)}, period=period, steps=steps, start=one.state()
    ),
}  # fmt: skip


@pytest.mark.parametrize("share", [0.5, 0.4139, 1.001])
@pytest.mark.parametrize("name", CALLS)
def test_a_period_that_is_not_that_of_the_load_is_refused(name: str, share: float) -> None:
    """A map over another span has fixed points, too, which are no responses."""
    with pytest.raises(gb.UserError, match="load shaker does not repeat after"):
        CALLS[name](scene(), share * PERIOD, 50)


@pytest.mark.parametrize("name", CALLS)
def test_a_period_that_is_not_that_of_a_wall_is_refused(name: str) -> None:
    with pytest.raises(gb.UserError, match="the wall of a contact does not repeat after"):
        CALLS[name](scene(wall=True), 0.7 * PERIOD, 50)


@pytest.mark.parametrize("steps", [-1, 0, 1, 2])
@pytest.mark.parametrize("name", CALLS)
def test_steps_that_do_not_see_the_load_are_refused(name: str, steps: int) -> None:
    with pytest.raises(gb.UserError, match="expected"):
        CALLS[name](scene(), PERIOD, steps)


@pytest.mark.parametrize(
    ("period", "words"),
    [
        (lambda at: 1.0 / at["shaker.frequency"], r"failed \(KeyError: 'shaker.frequency'\)"),
        (lambda _: "1", "returned text"),
        (lambda _: None, "returned None|finite|above 0"),
        (lambda _: np.ones(3), r"of shape \(3,\)"),
    ],
    ids=["an unknown path", "text", "nothing", "several"],
)
@pytest.mark.parametrize("name", ["atlas", "uncertain", "optimize"])
def test_functions_that_return_no_period_are_named(name: str, period: Any, words: str) -> None:
    with pytest.raises(gb.UserError, match=words):
        CALLS[name](scene(), period, 50)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda x: {"y": x["b"]}, r"the function failed \(KeyError: 'b'\)"),
        (lambda x: {"y": x["a"].tolist() + "1"}, r"the function failed \(TypeError"),
        (lambda _: {"y": "1"}, r"figure 'y': expected real numbers \(text\)"),
        (lambda x: {"y": x["a"] * 1j}, r"figure 'y': expected real numbers \(complex numbers\)"),
        (lambda x: x["a"], "expected figures by name"),
    ],
)
def test_functions_of_uncertain_values_that_fail_are_named(function: Any, words: str) -> None:
    with pytest.raises(gb.UserError, match=words):
        gb.uncertain(function, {"a": stats.norm()}, members=64)


def two_modes(high: float) -> gb.Scene:
    """Return a body of two modes, the second of a frequency, Hz, that is shaken between stops."""
    body = gb.from_modes(2.0 * np.pi * np.array([1.3, high]), 0.2, {"tip": [[1.0, 0.5]]})
    push = gb.Force(body["tip"], gb.sine, name="push", amplitude=50.0, frequency=1.0)
    stop = gb.Contact(body["tip"], gb.Slot(1.0), gb.KelvinVoigt(stiffness=400.0, damping=2.0), name="stop")
    return gb.Scene(body, contacts=[stop], loads=[push])


@pytest.mark.parametrize("high", [4e4, 4e6])
def test_multipliers_are_those_of_modes_that_the_step_resolves(high: float) -> None:
    """A mode of 100 times as many Hz as there are steps, or more, hides none: as steps that resolve one of 4 kHz."""
    found, exact = (
        gb.periodic(scene, 1.0, steps, gb.history(scene, 1.0 / steps, 8.0).last.state)
        for scene, steps in ((two_modes(high), 400), (two_modes(4e3), 40_000))
    )
    largest = float(np.abs(exact.multipliers).max())
    assert np.abs(found.multipliers).max() == pytest.approx(largest, rel=0.03)
    whole = gb.atlas(two_modes(high), period=1.0, starts=two_modes(high).state(), steps=400, settle=20, rounds=1)
    (one,) = whole.points[0].responses
    assert np.abs(one.multipliers).max() == pytest.approx(largest, rel=0.03)
    over = {"push.amplitude": 50.0}
    slopes = gb.tangents(two_modes(high), ["tip.rms"], over, period=1.0, steps=400, start=found.state)
    assert np.abs(slopes.multipliers).max() == pytest.approx(largest, rel=0.03)
