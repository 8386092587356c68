"""Tangents of periodic responses: closed forms, identities of dimensions, differences of orbits that converge anew."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from benchmarks.drawn_tangents import RIGHT, STEPS, compare, settled, wave
from gapbeam.solver.scene.limit_cycle import state_of


def test_an_oscillator_that_touches_nothing_has_the_derivatives_of_its_midpoint_steps() -> None:
    """U = F / |k cos a + i c w sin a / a - m (w / a)^2 sin^2 a / cos a| with a = pi / steps, at any step."""
    at, steps = {"k": 2.0, "m": 0.7, "c": 0.3, "shake.amplitude": 1.4, "shake.frequency": 1.9}, 40

    def make(p: dict[str, float]) -> gb.Scene:
        one = gb.mass(p["m"], stiffness=p["k"], damping=p["c"])
        force, w = p["shake.amplitude"], p["shake.frequency"]
        return gb.Scene(one, loads=[gb.Force(one["at"], lambda t: force * np.cos(w * t))])

    def amplitude(p: dict[str, complex]) -> Any:
        a, w = pi / steps, p["shake.frequency"]
        real, imag = p["k"] * np.cos(a) - p["m"] * (w / a) ** 2 * np.sin(a) ** 2 / np.cos(a), p["c"] * w * np.sin(a) / a
        return p["shake.amplitude"] / np.sqrt(real**2 + imag**2)

    period = 2.0 * pi / at["shake.frequency"]
    start = gb.periodic(make(at), period, steps).state
    found = gb.tangents(make, ["at.harmonic_1", "at.rms"], at, period=period, steps=steps, start=start)
    assert found.values["at.harmonic_1"] == pytest.approx(float(amplitude(at)), rel=1e-12)
    assert found.periods == pytest.approx(dict.fromkeys(at, 0.0) | {"shake.frequency": -period / at["shake.frequency"]})
    for path, value in at.items():
        exact = amplitude(at | {path: value + 1e-30j}).imag / 1e-30
        assert found.slopes["at.harmonic_1"][path] == pytest.approx(exact, rel=1e-9)
        assert found.slopes["at.rms"][path] == pytest.approx(exact / np.sqrt(2.0), rel=1e-9)


def test_slopes_obey_the_identities_of_their_dimensions() -> None:
    """sum_i e_i p_i dU/dp_i = e_U U for the exponents e of meter, second and kilogram (Euler), in hard contact."""
    at = {"m": 0.7, "k": 2.0, "c": 0.2, "gap": 0.4, "K": 60.0, "C": 0.8, "load.amplitude": 0.6, "load.frequency": 1.2}
    exponents = {
        "m": (0, 0, 1), "k": (0, -2, 1), "c": (0, -1, 1), "gap": (1, 0, 0), "K": (0, -2, 1), "C": (0, -1, 1),
        "load.amplitude": (1, -2, 1), "load.frequency": (0, -1, 0),
    }  # fmt: skip
    figures = {
        "at.peak": (1, 0, 0), "at.rms": (1, 0, 0), "at.harmonic_2": (1, 0, 0), "stop.peak_force": (1, -2, 1),
        "stop.impulse": (1, -1, 1), "stop.work": (2, -2, 1),
    }  # fmt: skip

    def make(p: dict[str, float]) -> gb.Scene:
        one = gb.mass(p["m"], stiffness=p["k"], damping=p["c"])
        stop = gb.Contact(
            one["at"], gb.HalfPlane(p["gap"]), gb.KelvinVoigt(stiffness=p["K"], damping=p["C"]), name="stop"
        )
        kept = {name: p[f"load.{name}"] for name in ("amplitude", "frequency")}
        return gb.Scene(one, contacts=[stop], loads=[gb.Force(one["at"], wave, **kept)])

    period = 2.0 * pi / at["load.frequency"]
    start = settled(make(at), period)
    found = gb.tangents(make, list(figures), at, period=period, steps=STEPS, start=start)
    many = gb.ensemble(make(at), members=1, step=period / STEPS, end=period, start=found.state)
    for kind in ("peak_force", "impulse", "work"):
        assert found.values[f"stop.{kind}"] == pytest.approx(getattr(many, kind)["stop"][0], rel=1e-10)
    for name, own in figures.items():
        for unit in range(3):
            parts = [exponents[path][unit] * value * found.slopes[name][path] for path, value in at.items()]
            size = max(map(abs, parts))
            assert sum(parts) == pytest.approx(own[unit] * found.values[name], abs=1e-8 * size)


@pytest.mark.parametrize("seed", [11])
def test_slopes_of_a_drawn_orbit_are_those_of_orbits_that_converge_anew(seed: int) -> None:
    """Five figures and the work by all parameters, to 1e-7 of the larger of slope and figure over parameter."""
    found = compare(seed)
    assert found.reason == ""
    assert found.worst <= RIGHT, found
    assert found.unsure == 0


@pytest.mark.slow(minutes=0.4)
@pytest.mark.parametrize("first", range(12, 52, 5))
def test_slopes_of_twenty_drawn_orbits(first: int) -> None:
    """At least two of five draws settle, and none of these is wrong or refused."""
    found = [one for one in map(compare, range(first, first + 5)) if one.settled]
    assert [one for one in found if one.reason or not one.worst <= RIGHT] == []
    assert len(found) >= 2


def touching(gap: float, damping: float = 0.0, stiffness: float = 1.0) -> tuple[gb.Scene, float]:
    """Return an oscillator under a load of 40 steps a period, and that period."""
    one = gb.mass(1.0, stiffness=stiffness, damping=0.3)
    stop = gb.Contact(one["at"], gb.HalfPlane(gap), gb.KelvinVoigt(stiffness=5.0, damping=damping), name="stop")
    load = gb.Force(one["at"], lambda t, amplitude: amplitude * np.cos(0.6 * t), name="load", amplitude=1.0)
    return gb.Scene(one, contacts=[stop], loads=[load, gb.Force(one["at"], 0.0, name="push")]), 2.0 * pi / 0.6


def test_what_has_no_derivative_is_refused() -> None:
    """Grazing within round-off, multipliers of 1, starts beside the orbit, figures of 0, two maxima, wrong names."""
    free, period = touching(10.0, 1.0)
    start = gb.periodic(free, period, 40).state
    peak = gb.history(free, period / 40, period, start).displacement["at"].max()

    def slopes(
        scene: gb.Scene, path: str = "load.amplitude", figure: str = "at.rms", at: float = 1.0, **kept: Any
    ) -> float:
        given = {"period": period, "steps": 40, "start": start, **kept}
        return gb.tangents(scene, [figure], {path: at}, **given).slopes[figure][path]

    assert slopes(free, figure="stop.impulse") == 0.0  # far from the stop
    assert slopes(free) > 0.0
    below = touching(float(np.nextafter(peak, 1.0)), 1.0)[0]
    drift, _ = touching(1e3, stiffness=0.0)
    lifted = start.spread(1)
    lifted.q += 1e-3
    for message, call in {
        "contact stop opens, closes or grazes within round-off": lambda: slopes(below),
        "from 1: near a fold": lambda: slopes(drift, start=gb.periodic(drift, period, 40).state),
        "changes the start by": lambda: slopes(free, start=lifted),
        "expected one of at.peak, at.rms": lambda: slopes(free, figure="at.work"),
        "name.value": lambda: slopes(free, "loud.amplitude"),
        "reached at 2 steps within round-off": lambda: slopes(free, "push.value", "at.peak", 0.0),
        "is 0 within round-off, where it has no derivative": lambda: slopes(free, figure="at.harmonic_3"),
    }.items():
        with pytest.raises(gb.UserError, match=message):
            call()


def test_forces_of_contacts_that_share_a_star_add_up() -> None:
    """Two stops of half the stiffness side by side have the figures and derivatives of one stop, by each kind."""

    def stops(count: int) -> gb.Scene:
        one = gb.mass(0.7, stiffness=2.0, damping=0.2)
        law = gb.KelvinVoigt(stiffness=60.0 / count, damping=0.8 / count)
        contacts = [gb.Contact(one["at"], gb.HalfPlane(0.4), law, name=f"stop {i}") for i in range(count)]
        return gb.Scene(one, contacts=contacts, loads=[gb.Force(one["at"], wave, amplitude=0.6, frequency=1.2)])

    kinds, period = ("peak_force", "impulse", "work"), 2.0 * pi / 1.2
    start = settled(stops(1), period)
    path, given = "stop *.clearance", {"period": period, "steps": STEPS}
    found = []
    for count, owner in ((1, "stop 0"), (2, "stop *")):
        begin = gb.periodic(stops(count), period, STEPS, state_of(stops(count), start.x, 0.0)).state
        found.append(
            gb.tangents(stops(count), [f"{owner}.{kind}" for kind in kinds], {path: 0.4}, start=begin, **given)
        )
    for kind in kinds:
        one, two = (each.values[f"{owner}.{kind}"] for each, owner in zip(found, ("stop 0", "stop *"), strict=True))
        assert two == pytest.approx(one, rel=1e-10)
        one, two = (
            each.slopes[f"{owner}.{kind}"][path] for each, owner in zip(found, ("stop 0", "stop *"), strict=True)
        )
        assert two == pytest.approx(one, rel=1e-7)


@pytest.mark.parametrize("modes", [4, 6, None])
@pytest.mark.parametrize("elements", [20, 30, 40])
def test_slopes_by_the_place_of_a_stop_are_those_of_orbits_beside(elements: int, modes: int | None) -> None:
    """The basis of modes changes with the mesh: an eigensolver gave them other signs, and each place was refused."""
    draw = np.random.default_rng(elements)
    section, steel = gb.section("rectangle", 0.006, width=0.02), gb.material(2.1e11, 7850.0)
    place, period, steps = 0.28 + draw.uniform(-0.12, 0.12) / elements, 1.0 / draw.uniform(24.0, 26.0), 300

    def make(p: dict[str, float]) -> gb.Scene:
        points = {"drive": 0.2, "stop": p["x"], "tip": 0.4}
        beam = gb.beam(0.4, section, steel, points, pinned=(0.0, 0.1), modes=modes, ratio=0.04, elements=elements)
        stop = gb.Contact(beam["stop"], gb.HalfPlane(5e-5), gb.KelvinVoigt(stiffness=1e4, damping=5.0), name="stop")
        push = gb.Force(beam["drive"], lambda t: 10.0 * np.sin(2.0 * np.pi / period * t))
        return gb.Scene(beam, contacts=[stop], loads=[push])

    def orbit(x: float) -> Any:
        scene = make({"x": x})
        near = gb.history(scene, period / steps, 60 * period).last.state
        near.t = 0.0
        return gb.periodic(scene, period, steps, near).state

    def rms(x: float) -> float:
        start = orbit(x)
        moved = gb.history(make({"x": x}), period / steps, period, start).displacement["tip"][-steps:]
        return float(np.sqrt(np.mean(moved**2)))

    found = gb.tangents(make, ["tip.rms"], {"x": place}, period=period, steps=steps, start=orbit(place))
    assert found.values["tip.rms"] == pytest.approx(rms(place), rel=1e-9)
    d = 1e-5
    beside = (rms(place + d) - rms(place - d)) / (2.0 * d)
    assert found.slopes["tip.rms"]["x"] == pytest.approx(beside, rel=2e-2)
