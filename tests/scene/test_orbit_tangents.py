"""Tangents of periodic responses: closed forms, identities of dimensions, differences of orbits that converge anew."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.scene.scene import SceneState

STEPS = 400


def wave(t: Any, amplitude: float, frequency: float) -> Any:
    return amplitude * (np.cos(frequency * t + 0.7) + 0.3 * np.cos(2.0 * frequency * t))


def settled(scene: gb.Scene, period: float, periods: int = 80) -> SceneState:
    """Return the state of the response that a march from rest comes to."""
    near = gb.history(scene, period / STEPS, periods * period).last.state
    near.t = 0.0
    return gb.periodic(scene, period, STEPS, near, passes=12).state


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


def drawn(seed: int) -> tuple[gb.Scene, dict[str, float], list[str]]:
    """Return a scene of an oscillator, a tube or a disc in contact, six parameters or more, and figures."""
    r = np.random.default_rng(seed)
    kind, law_kind = r.choice(["oscillator", "tube", "round"]), r.choice(["kelvin", "elastic", "hunt", "gap", "cubic"])
    w, g, ratio = 2.0 * pi * 10.0 ** r.uniform(0, 2), 10.0 ** r.uniform(-5, -3), 10.0 ** r.uniform(-2, -0.9)
    at = "tip" if kind == "tube" else "at"
    if kind == "oscillator":
        body = gb.mass(1.0, stiffness=w * w, damping=2.0 * ratio * w, name="body")
    elif kind == "round":
        body = gb.from_modes([w, 1.13 * w], ratio, {"at": np.eye(2)}, name="body")
    else:
        modes = np.arange(int(r.integers(3, 10))) + 0.5
        shapes = np.sqrt(2.0) * np.sin(np.outer([0.37, 0.81, 1.0], modes) * pi)
        points = dict(zip(("low", "high", "tip"), shapes, strict=True))
        body = gb.from_modes(w * (2.0 * modes) ** r.uniform(1, 2), ratio, points, name="body")
    K = float(w * w * 10.0 ** r.uniform(0.5, 2.5))
    law = {
        "kelvin": gb.KelvinVoigt(stiffness=K, damping=0.1 * np.sqrt(K)), "elastic": gb.KelvinVoigt(stiffness=K),
        "hunt": gb.HuntCrossley(stiffness=K / np.sqrt(g), chi=0.3 / (w * g)),
        "gap": gb.ElastoGap(stiffness=K, damping=0.1 * np.sqrt(K)), "cubic": gb.Cubic(stiffness=K, scale=g),
    }[law_kind]  # fmt: skip
    over = {f"c0.{name}": value for name, value in zip(law.kind.names, law.values, strict=True) if value}
    contacts = []
    for i, name in enumerate(("low", "high") if kind == "tube" else ("at",)):
        region = gb.Disc(g) if kind == "round" else gb.Slot(2.0 * g) if r.random() < 0.5 else gb.HalfPlane(g)
        rough: dict[str, Any] = {"friction": 0.2, "sliding": 0.05 * w * g} if kind == "round" else {}
        offset = g * r.uniform(-0.3, 0.3, 2 if kind == "round" else None)
        contacts.append(gb.Contact(body[name], region, law, name=f"c{i}", offset=offset, **rough))
        if i == 0:
            over |= {
                "c0.clearance": region.values[region.kind.names.index("clearance")],
                **({"c0.friction": 0.2} if rough else {"c0.offset": offset}),
            }
    amplitude, frequency = w * w * g * 10.0 ** r.uniform(0, 0.7), w * r.uniform(0.4, 1.6)
    along = {"direction": [1.0, 0.4]} if kind == "round" else {}
    load = gb.Force(body[at], wave, name="load", amplitude=amplitude, frequency=frequency, **along)
    over |= {"load.amplitude": amplitude, "load.frequency": frequency, "body.damping_factor": 1.0}
    figures = [f"{at}.peak", f"{at}.rms", f"{at}.harmonic_1", "c0.peak_force", "c0.impulse"]
    if kind != "tube" and (kind == "round" or law_kind not in ("elastic", "cubic")):
        figures.append("c0.work")
    return gb.Scene(body, contacts=contacts, loads=[load]), over, figures


def figures_of(scene: gb.Scene, x: Any, period: float, figures: list[str]) -> tuple[Any, Any]:
    """Return figures of a period from x, and its change, by the march alone."""
    n = scene.size
    start = SceneState(0.0, x[:n, None].copy(), x[n:, None].copy(), np.zeros((0, 1)), np.zeros((scene.motions, 1)))
    found = gb.history(scene, period / STEPS, period, start)
    values = []
    for name in figures:
        owner, _, kind = name.partition(".")
        if kind == "work":
            values.append(found.last.energy["law"] + found.last.energy["friction"])
            continue
        series = (found.force if kind in ("peak_force", "impulse") else found.displacement)[owner].reshape(STEPS, -1)
        size = np.linalg.norm(series, axis=1)
        if kind == "harmonic_1":
            turns = np.exp(-2j * pi * np.arange(1, STEPS + 1) / STEPS)
            values.append(2.0 / STEPS * np.linalg.norm(turns @ series))
        else:
            mean = np.sqrt(np.mean(size**2)) if kind == "rms" else period * size.mean()
            values.append(size.max() if "peak" in kind else mean)
    end = found.last.state
    return np.array(values), np.concatenate([end.q, end.v])[:, 0] - x


def converged(scene: gb.Scene, x: Any, period: float, figures: list[str], inverse: Any) -> Any:
    """Return figures of the orbit near x, by chords down to round-off."""
    best, kept = np.inf, np.zeros(0)
    for _ in range(14):
        values, miss = figures_of(scene, x, period, figures)
        if np.abs(miss).max() < best:
            best, kept = np.abs(miss).max(), values
        x = x + inverse @ miss
    return kept


def compare(seed: int) -> str:
    """Compare all slopes of a drawn orbit with Richardson differences to 1e-7; return "" or why there are none."""
    scene, over, figures = drawn(seed)
    frequency = over["load.frequency"]
    period = 2.0 * pi / frequency
    try:
        start = settled(scene, period)
        found = gb.tangents(scene, figures, over, period=period, steps=STEPS, start=start)
    except (gb.UserError, gb.NotConverged) as error:
        return str(error)
    x, n = np.concatenate([found.state.q, found.state.v])[:, 0], 2 * scene.size
    e = 1e-7 * np.repeat([np.abs(found.state.q).max(), np.abs(found.state.v).max()], scene.size)
    sides = [[figures_of(scene, x + s * e[i] * np.eye(n)[i], period, figures)[1] for i in range(n)] for s in (1, -1)]
    inverse = -np.linalg.inv((np.array(sides[0]) - np.array(sides[1])).T / (2.0 * e))
    for path, value in over.items():
        table = []
        for level in range(2, 6):
            h, at = 1e-3 * 4.0**-level * abs(value), dict[int, Any]()
            for k in (-2, -1, 1, 2):
                T = 2.0 * pi / (value + k * h) if path == "load.frequency" else period
                at[k] = converged(scene.with_({path: value + k * h}), x, T, figures, inverse)
            table.append((8.0 * (at[1] - at[-1]) - at[2] + at[-2]) / (12.0 * h))
        best = np.abs(np.diff(table, axis=0)).argmin(axis=0)
        for i, name in enumerate(figures):
            most = found.values[figures[0]] * found.values["c0.peak_force"] if name == "c0.work" else found.values[name]
            size = max(abs(table[best[i] + 1][i]), most / abs(value))
            assert abs(found.slopes[name][path] - table[best[i] + 1][i]) <= 1e-7 * size, (seed, name, path)
    return ""


@pytest.mark.parametrize("seed", [11])
def test_slopes_of_a_drawn_orbit_are_those_of_orbits_that_converge_anew(seed: int) -> None:
    """Five figures and the work by all parameters, to 1e-7 of the larger of slope and figure over parameter.

    The work is what is left of elastic work to and fro: it is measured by force times displacement.
    """
    assert compare(seed) == ""


@pytest.mark.slow(minutes=0.4)
@pytest.mark.parametrize("first", range(12, 52, 5))
def test_slopes_of_twenty_drawn_orbits(first: int) -> None:
    """At least two of five draws settle, and none of these is wrong or refused."""
    answers = [compare(seed) for seed in range(first, first + 5)]
    assert [one for one in answers if one and not one.startswith("periodic")] == []
    assert answers.count("") >= 2


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
