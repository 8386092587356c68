"""Swept sines against the chirp of SciPy, and the motion of an oscillator under one against that of SciPy."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import chirp

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.loads.step_force import SweptSineLoad
from tests.regression.test_compiled_run import run_both, same_history
from tests.shared.models import COARSE, GRAVITY, beam_case
from tests.shared.toys import start, steps_of, stopped_oscillator

UP = {"start_frequency": 5.0, "end_frequency": 80.0, "duration": 2.0}
DOWN = {"start_frequency": 80.0, "end_frequency": 5.0, "duration": 2.0}


def load(**keys: Any) -> SweptSineLoad:
    """Return a swept force of 3 N."""
    return SweptSineLoad.model_validate({"type": "swept-sine", "point": 0.15, "amplitude": 3.0, **keys})


@pytest.mark.parametrize("spacing", ["linear", "logarithmic"])
@pytest.mark.parametrize("way", [UP, DOWN], ids=("up", "down"))
def test_the_sweep_is_a_chirp(way: dict[str, float], spacing: str) -> None:
    """Phase and amplitude are those of `scipy.signal.chirp`; the phase grows by the frequency."""
    signal = load(**way, spacing=spacing).signal
    times = np.linspace(0.0, 2.0, 20_001)
    first, last = way["start_frequency"], way["end_frequency"]
    expected = 3.0 * chirp(times, first, 2.0, last, method=spacing, phi=-90.0)
    np.testing.assert_allclose(signal.value(times), expected, atol=1e-9)
    slope = np.gradient(signal.cycles(times), times, edge_order=2)
    np.testing.assert_allclose(slope, signal.frequency(times), rtol=1e-5)
    halfway = 0.5 * (first + last) if spacing == "linear" else np.sqrt(first * last)
    assert signal.frequency(np.array([0.0, 1.0, 2.0])) == pytest.approx([first, halfway, last])
    assert [signal.value(float(t)) for t in times[::997]] == signal.value(times)[::997].tolist()


@pytest.mark.parametrize("spacing", ["linear", "logarithmic"])
def test_there_and_back(spacing: str) -> None:
    """The way back mirrors the frequency; behind it the first one is held, or nothing acts, both without a jump."""
    held = load(**UP, spacing=spacing, back=True).signal
    times = np.linspace(0.0, 5.0, 50_001)
    slope = np.gradient(held.cycles(times), times)
    np.testing.assert_allclose(slope[1:19_999], slope[39_999:20_001:-1], rtol=1e-6)
    np.testing.assert_allclose(slope[times > 4.001], 5.0, rtol=1e-9)
    assert np.abs(np.diff(held.value(times))).max() < 3.0 * 2.0 * np.pi * 80.0 * 1.001e-4
    stopped = load(**UP, spacing=spacing, back=True, after="stop", ramp=0.2).signal
    values = stopped.value(times)
    inside = (times > 0.2) & (times < 3.8)
    assert np.array_equal(values[inside], held.value(times)[inside])
    assert np.all(values[times >= 4.0] == 0.0)
    assert np.abs(values[(times < 0.02) | ((times > 3.98) & (times < 4.0))]).max() < 0.03
    assert np.abs(values[inside]).max() == pytest.approx(3.0, rel=1e-3)


def test_means_over_intervals() -> None:
    """Means are those of a fine quadrature, over intervals shorter and longer than periods, ramp and end included."""
    signal = load(**UP, after="stop", ramp=0.3).signal
    edges = np.array([0.0, 0.001, 0.25, 0.8, 1.31, 2.4, 2.5])
    means = signal.mean(edges[:-1], edges[1:])
    for mean, (begin, end) in zip(means, pairwise(edges), strict=True):
        fine = begin + (end - begin) * (np.arange(200_000) + 0.5) / 200_000
        assert mean == pytest.approx(float(np.mean(signal.value(fine))), abs=1e-7)


def test_an_oscillator_under_a_sweep() -> None:
    """Through its resonance, a march of order 2 goes to the solution that `solve_ivp` finds under SciPy's chirp."""
    spring, ratio = (2.0 * np.pi * 20.0) ** 2, 0.02
    sweep = {"start_frequency": 10.0, "end_frequency": 30.0, "duration": 1.0}
    signal = load(**sweep, spacing="linear").signal
    system = stopped_oscillator(1.0, spring, gap=1.0e3, damping_ratio=ratio, force=signal.value)

    def motion(t: float, y: np.ndarray) -> list[float]:
        force = 3.0 * float(chirp(t, 10.0, 1.0, 30.0, method="linear", phi=-90.0))
        return [y[1], force - spring * y[0] - 2.0 * ratio * np.sqrt(spring) * y[1]]

    times = np.linspace(0.0, 1.0, 501)
    exact = solve_ivp(motion, (0.0, 1.0), [0.0, 0.0], "DOP853", times, rtol=1e-9, atol=1e-12).y[0]
    errors = []
    for refined in (1, 2):
        scheme = scheme_of("discrete-gradient")
        steps = steps_of(system, kelvin_voigt(1.0e6, 0.0), scheme, start(system), 1.0e-3 / refined, 1000 * refined)
        found = np.array([step.new.u[0, 0] for step in steps])[2 * refined - 1 :: 2 * refined]
        errors.append(np.abs(found - exact[1:]).max() / np.abs(exact).max())
    assert errors[1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_compiled_and_step_by_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both time loops take the same sweep, as a force and as an acceleration of the base."""
    force = {"type": "swept-sine", "point": 0.4, "amplitude": 300.0, **DOWN, "duration": 0.02}
    base = {"type": "swept-sine", "name": "base", "quantity": "acceleration", "amplitude": 20.0, **UP, "ramp": 0.01}
    model = {"type": "reduced", "modes": 8, "shapes": 4}
    changes = {"mesh": COARSE, "model": model, "time": {"end": 0.02, "step": 5e-5}}
    case = beam_case(changes, (GRAVITY, force, base), {"tip": 0.51})
    compiled, steps = run_both(case, tmp_path, monkeypatch)
    assert (compiled.exit_status, steps.exit_status) == (0, 0)
    assert compiled.summary["gates"]["impacts"] > 0
    same_history(tmp_path / "compiled", tmp_path / "steps", 1.0e-6)
