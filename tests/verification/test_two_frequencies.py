"""Motions of two frequencies: closed forms, what is none, and a self-excited mass under a load against SciPy."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam as gb
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.run_atlas import PeriodicScene, run_atlas
from gapbeam.studies.atlas.two_frequencies import two_frequencies
from gapbeam.studies.trials.axes import Axis

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
TIMES = np.arange(1200)


def mixed(f: float, g: float, start: float = 0.0) -> Array:
    """Return a motion with lines at combinations of two frequencies, up to high orders."""
    a, b = 2.0 * pi * f * TIMES + start, 2.0 * pi * g * TIMES + 3.0 * start
    return np.column_stack([np.tanh(1.5 * np.cos(a)) + 0.4 * np.cos(b), np.cos(b) * (1.0 + 0.4 * np.cos(a - b))])


def test_two_frequencies_are_those_of_closed_forms() -> None:
    """Also of a record at other phases, which is of the same motion; one of other sizes is not."""
    f, g = 0.05, 0.05 * GOLDEN
    found, later = (two_frequencies(mixed(f, g, start), 1.0, driven=False) for start in (0.0, 0.7))
    assert found is not None
    assert later is not None
    assert sorted(found.frequencies) == pytest.approx([g, f], rel=1e-6)
    assert found.is_same(later, 1e-4, 1e-2)
    assert not found.is_same(later._replace(sizes=1.1 * later.sizes), 1e-4, 1e-2)
    strobes = np.tanh(2.0 * np.cos(2.0 * pi * GOLDEN * TIMES[:256, None]))
    driven = two_frequencies(strobes, 1.0, driven=True)
    assert driven is not None
    assert driven.frequencies == pytest.approx((1.0 - GOLDEN,), rel=1e-6)


def logistic(samples: int) -> Array:
    x = [0.3]
    while len(x) < samples:
        x.append(3.9 * x[-1] * (1.0 - x[-1]))
    return np.array(x)[:, None]


OTHERS = {
    "one frequency": (np.cos(0.3 * TIMES[:, None]), False),
    "locked at 2:3": (mixed(0.05, 0.075), False),
    "a third frequency": (np.cos(np.outer(TIMES[:400], [0.3, 0.47, 0.71])).sum(axis=1, keepdims=True), False),
    "decays to a cycle": ((np.cos(0.3 * TIMES) + 0.1 * np.exp(-TIMES / 1000.0) * np.cos(0.47 * TIMES))[:500], False),
    "chaos": (logistic(256), True),
    "locked strobes": (np.cos(2.0 * pi * 3.0 / 7.0 * TIMES[:256]), True),
    "rest": (np.zeros((256, 1)), True),
    "failed": (np.full((256, 1), np.nan), False),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_motions_are_none(name: str) -> None:
    signal, driven = OTHERS[name]
    assert two_frequencies(signal.reshape(len(signal), -1), 1.0, driven=driven) is None


@pytest.mark.slow(minutes=0.3)
def test_a_self_excited_mass_under_a_load(tmp_path: Path) -> None:
    """A weak load leaves a frequency of its own, a strong one entrains it; peaks and frequency against SciPy."""
    law, load = gb.KelvinVoigt(stiffness=400.0, damping=4.0), 2.9
    body = gb.mass(1.0, stiffness=100.0, damping=0.1, name="body")
    stop = gb.Contact(body["at"], gb.Slot(2e-3), law, name="stop")
    push = gb.Feedback(body["at"], body["at"], [], [], [], [0.0, 1.0])

    def scene_at(texts: tuple[str, ...]) -> PeriodicScene:
        amplitude = float(texts[0].split("=")[1])
        shake = gb.Force(body["at"], lambda t, size: size * np.cos(2.0 * pi * load * t), name="shake", size=amplitude)
        return PeriodicScene(gb.Scene(body, contacts=[stop], feedbacks=[push], loads=[shake]), 1 / load, 1 / 900, 0.0)

    sizes = ("0.05", "0.2")
    result = run_atlas(scene_at, [Axis("shake.size", sizes)], tmp_path, starts=4, inputs={}, follow=True)
    weak, strong = (json.loads((tmp_path / "atlas.json").read_text())[k]["responses"] for k in (0, 1))
    assert [(one["order"], one["starts"]) for one in (*weak, *strong)] == [(-1, 4), (1, 4)]
    assert [one.order for one in result.branches] == [1]
    assert "2 stable responses at 2 points" in result.headline()
    words = (tmp_path / "atlas.csv").read_text()
    assert "two frequencies, 2.9 and 0.69" in words

    def rate(t: float, y: Any) -> list[float]:
        x, v = y
        deep = abs(x) - 1e-3
        hit = max(400.0 * deep + 4.0 * v * np.sign(x), 0.0) * np.sign(x) if deep > 0.0 else 0.0
        return [v, -100.0 * x + 0.9 * v - hit + 0.05 * np.cos(2.0 * pi * load * t)]

    times = np.arange(80 * 32, 480 * 32) / (32.0 * load)
    x = solve_ivp(rate, (0.0, times[-1]), [0.0, 0.01], "LSODA", times, rtol=1e-7, atol=1e-11, max_step=0.02).y[0]
    assert weak[0]["peak"]["at"] == pytest.approx(np.abs(x).max(), rel=5e-3)
    strobes = x[::32] - x[::32].mean()
    power = np.abs(np.fft.rfft(np.hanning(len(strobes)) * strobes, 64 * len(strobes)))
    assert weak[0]["frequencies"] == pytest.approx([load, load * power.argmax() / (64 * len(strobes))], rel=1e-3)
