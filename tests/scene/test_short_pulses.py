"""Pulses in files of structures: computed steps resolve them, and what does not suit a load is said as of a case."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
import scipy

import gapbeam as gb
from gapbeam.solver.scene_file.scene_reader import read_scene

MASS, SPRING, STOP, GAP = 2.0, 20.0, 1e5, 1e-4
FILE = f"""
[[structure]]
name = "ball"
model = {{ type = "mass", mass = {MASS}, stiffness = {SPRING} }}

[[pair]]
name = "stop"
between = ["ball.at"]
region = {{ type = "half-plane", clearance = {GAP} }}
law = {{ type = "kelvin-voigt", stiffness = {STOP} }}

[[load]]
point = "ball.at"
LOAD

[time]
end = 1.0
"""
STEP = 'type = "step_force"\namplitude = 100.0\nstart = {start}\nend = {end}\n'
RECORD = 'type = "recorded_force"\nfile = "pulse.csv"\ninterpolation = "monotone"\nholes = "linear"\n'


def written(folder: Path, kind: str, start: float, length: float) -> Path:
    """Return a file with a pulse of 100 N: a step force, a jump that stays, or rows at even times or corners."""
    load = STEP.format(start=start, end=start + length) if kind in ("step", "jump") else RECORD
    load = load.replace(f"end = {start + length}\n", "") if kind == "jump" else load
    edge = 0.05 * length
    corners = np.array([0.0, start, start + edge, start + length, start + length + edge, 1.5])
    times = np.arange(0.0, 1.5, edge) if kind == "even" else corners
    forces = np.interp(times, corners, [0.0, 0.0, 100.0, 100.0, 0.0, 0.0])
    np.savetxt(folder / "pulse.csv", np.column_stack([times, forces]), delimiter=",")
    path = folder / "pulse.toml"
    path.write_text(FILE.replace("LOAD", load))
    return path


@pytest.mark.parametrize("kind", ["step", "jump", "even", "corners"])
@pytest.mark.parametrize(("start", "length"), [(0.003, 0.02), (0.4, 0.02), (0.9, 0.005)])
def test_computed_steps_resolve_a_pulse(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, start: float, length: float
) -> None:
    """A mass on a soft spring is pushed against a stop: its largest force by SciPy, to 3 % and the stated error."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    path = written(tmp_path, kind, start, length)
    scene, end = read_scene(path), start + 0.06 if kind == "jump" else 1.0
    outcome = gb.run(path, {"time.end": end}, output=tmp_path / "run")
    errors = {one["name"]: one["error"] for one in outcome.summary["errors"]["figures"]}
    peak = float(outcome.history["contact_force"].max())
    push = scene.case.load[0].time_function().value

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], (float(push(t)) - SPRING * y[0] - STOP * max(y[0] - GAP, 0.0)) / MASS]

    exact = scipy.integrate.solve_ivp(rates, (0.0, end), [0.0, 0.0], rtol=1e-9, atol=1e-12, max_step=2e-4)
    expected = STOP * (exact.y[0].max() - GAP)
    assert peak == pytest.approx(expected, rel=0.03)
    if kind != "jump":  # which is a part of a step late
        assert abs(peak - expected) <= errors["stop largest recorded force"] + 1e-3 * expected


@pytest.mark.parametrize(
    ("load", "changes", "words"),
    [
        (STEP.format(start=0.1, end=0.12), {"time.step": 0.03}, "step = 0.03: longer than the pulse of 0.02 s"),
        (STEP.format(start=2.0, end=3.0), {}, 'number 1 (name "force") start = 2 is not within the run, 1 s'),
        ('type = "harmonic_force"\namplitude = 1.0\nfrequency = 50.0\n', {"time.step": 5e-3}, "4 steps in a period of"),
        ('type = "harmonic_force"\namplitude = 1.0\nfrequency = 5.0\nramp = 9.0\n', {}, "ramp = 9 is longer than the"),
        (RECORD, {"time.step": 0.03}, "the march takes aliases of the load recorded"),
        (RECORD, {"load.recorded.scale": 0.0}, "is 0 all the time: it does nothing"),
        (STEP.format(start=0.1, end=0.12), {"time.step": 1e-3}, ""),
        (RECORD, {"time.step": 5e-5}, ""),
    ],
)
def test_what_does_not_suit_a_load_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, load: str, changes: dict[str, float], words: str
) -> None:
    """Warnings about loads, and about given steps, are those of cases; of what suits there is none."""
    path = written(tmp_path, "corners", 0.1, 0.02)
    path.write_text(FILE.replace("LOAD", load))
    with caplog.at_level(logging.WARNING, "gapbeam"):
        read_scene(path, changes)
    assert words in caplog.text
    assert bool(words) == bool(caplog.text)
