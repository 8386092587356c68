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
    assert abs(peak - expected) <= errors["stop largest recorded force"] + 1e-3 * expected


class Jump:
    """A force of 100 N from a time on, with its mean."""

    def __init__(self, start: float) -> None:
        self.start = start

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """Return the force at times."""
        return np.asarray(np.where(t >= self.start, 100.0, 0.0))

    def mean_over(self, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return its means over steps."""
        return np.asarray(100.0 * np.maximum(ends - np.maximum(starts, self.start), 0.0) / (ends - starts))


def oscillating(kind: str, start: float, folder: Path) -> gb.Scene:
    """Return a mass on a spring that a force of 100 N pushes from a time on."""
    if kind == "own":
        ball = gb.Structure(M=[[MASS]], K=[[SPRING * 100]], points={"at": [[1.0]]})
        return gb.Scene(ball, loads=[gb.Force(ball["at"], Jump(start))])
    path = written(folder, kind, start, 3.0)
    path.write_text(path.read_text().replace(f"stiffness = {SPRING} ", f"stiffness = {SPRING * 100} "))
    return read_scene(path).scene.with_({"stop.clearance": 1.0})


@pytest.mark.parametrize("kind", ["step", "jump", "own"])
def test_a_jump_within_a_step_keeps_the_order(tmp_path: Path, kind: str) -> None:
    """The motion is F / k (1 - cos w (t - start)): a quarter of the step has a sixteenth of the worst error.

    A force by its value in the middle of a step comes up to half a step late or early: a quarter of the error.
    """
    omega, worst = np.sqrt(SPRING * 100 / MASS), dict[float, float]()
    for start in np.random.default_rng(5).uniform(0.1, 0.12, 8):
        scene = oscillating(kind, float(start), tmp_path)
        for step in (0.004, 0.001):
            found = gb.history(scene, step=step, end=1.0)
            exact = 0.05 * (1.0 - np.cos(omega * np.maximum(found.t - start, 0.0)))
            error = float(np.abs(found.displacement[next(iter(found.displacement))] - exact).max())
            worst[step] = max(worst.get(step, 0.0), error)
    assert worst[0.004] / worst[0.001] == pytest.approx(16.0, rel=0.05)


@pytest.mark.parametrize("spring", [SPRING, 2.0])
@pytest.mark.parametrize(
    ("speed", "load"), [(0.5, ""), (0.02, ""), (0.0, 'type = "constant_force"\namplitude = 5.0\n'), (0.0, "weight")]
)
def test_computed_steps_resolve_what_begins_all_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spring: float, speed: float, load: str
) -> None:
    """Bodies that are thrown, pushed or dropped at t = 0 strike a stiff stop: the first blow by its energy, to 1 %."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    text = FILE.replace('[[load]]\npoint = "ball.at"\nLOAD', f'[[load]]\npoint = "ball.at"\n{load}' if load else "")
    if load == "weight":
        text = text.replace('point = "ball.at"\nweight', 'type = "gravity"').replace(
            "clearance =", "normal = -1, clearance ="
        )
    text = text.replace(f"stiffness = {SPRING} }}", f"stiffness = {spring} }}\nvelocity = {speed}")
    push = {"": 0.0, "weight": 9.81 * MASS}.get(load, 5.0)
    half = 0.5 * (push - spring * GAP)
    energy = 0.5 * MASS * speed**2 + push * GAP - 0.5 * spring * GAP**2
    deepest = (half + np.sqrt(half**2 + 0.5 * (STOP + spring) * energy)) * 2.0 / (STOP + spring)
    path = tmp_path / "blow.toml"
    path.write_text(text.replace("end = 1.0", "end = 0.05"))
    found = gb.run(path, output=tmp_path / "run").history["contact_force"].max()
    assert float(found) == pytest.approx(STOP * deepest, rel=0.01)


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
