"""Runs of scenes into results folders, against closed forms and against what readers of folders ask for."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

GRAVITY, HEIGHT, STIFFNESS = 9.81, 0.1, 1e6


def ball(**law: float) -> gb.Scene:
    """Return a ball of 1 kg that falls from 0.1 m to a stiff floor; it moves toward +."""
    body = gb.mass(1.0, name="ball")
    floor = gb.Contact(
        body["at"], gb.HalfPlane(0.0), gb.KelvinVoigt(stiffness=STIFFNESS, **law), offset=-HEIGHT, name="floor"
    )
    return gb.Scene(body, contacts=[floor], loads=[gb.weight(body, GRAVITY, name="weight")])


def test_a_bouncing_mass_has_the_impacts_of_its_closed_form(tmp_path: Path) -> None:
    """Times, speeds, impulses and durations of free fall and half a sine; the largest force by energy."""
    outcome = gb.run(ball(), step=1e-5, end=0.5, every=10, output=tmp_path / "a")
    assert outcome.exit_status == 0, outcome.message
    results = gb.open_results(outcome)
    fall, speed, w = sqrt(2 * HEIGHT / GRAVITY), sqrt(2 * GRAVITY * HEIGHT), sqrt(STIFFNESS)
    rest = GRAVITY / w**2
    contact = 2.0 * (pi - np.arctan2(speed / w, rest)) / w  # of x'' = g - w^2 x from (0, speed) back to 0
    table = np.loadtxt(tmp_path / "a" / "impacts.csv", delimiter=",", skiprows=1, usecols=range(1, 5))
    for number, row in enumerate(table):
        assert row[0] == pytest.approx(fall + number * (contact + 2.0 * fall), abs=2e-6)
        assert row[1] == pytest.approx(speed, rel=2e-4)  # the mean over the step in which it touches
        assert row[2] == pytest.approx(2.0 * speed + GRAVITY * contact, rel=1e-5)
        assert row[3] == pytest.approx(contact, rel=1e-4)
    assert len(table) == results.summary["impacts"]["floor"]["count"] == 2
    peak = STIFFNESS * (rest + sqrt(rest**2 + (speed / w) ** 2))
    assert outcome.summary["peak_contact_force"]["floor"] == pytest.approx(peak, rel=1e-4)
    history = results.history
    assert history.sizes["time"] == 5001
    u = history["displacement"].sel(probe="at", component="y").values
    early = history["time"].values < fall
    assert np.abs(u - 0.5 * GRAVITY * history["time"].values ** 2)[early].max() < 1e-9
    assert np.abs(history["penetration"].sel(face="floor").values - (u - HEIGHT)).max() < 1e-12
    assert float(history["impulse"][-1, 0]) == pytest.approx(table[:, 2].sum(), rel=1e-9)
    residual = np.abs(history["energy_residual"].values).max()
    assert residual < 1e-9 * GRAVITY * HEIGHT


def test_folders_of_scenes_are_read_as_those_of_cases(tmp_path: Path) -> None:
    """Report, figures, export and comparison; the report says that there is nothing to draw."""
    oscillator = gb.mass(1.0, stiffness=1.0, damping=0.02, name="block")
    stop = gb.Contact(oscillator["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=100.0), name="stop")
    scene = gb.Scene(oscillator, contacts=[stop], loads=[gb.Force(oscillator["at"], lambda t: 0.5 * np.cos(0.7 * t))])
    for name, step in (("a", 0.02), ("b", 0.01)):
        outcome = gb.run(scene, step=step, end=100.0, period=2 * pi / 0.7, output=tmp_path / name)
        assert outcome.exit_status == 0
    (page,) = gb.report(tmp_path / "a", pdf=False)
    words = page.read_text(encoding="utf-8")
    assert "no geometry" in words
    assert "KelvinVoigt" in words
    assert gb.export(tmp_path / "a", tmp_path / "a.csv").is_file()
    assert gb.compare(tmp_path / "a", tmp_path / "b", output=tmp_path / "c").agree


def test_a_scheme_that_takes_energy_does_not_pass(tmp_path: Path) -> None:
    """Implicit Euler with coarse steps loses energy: status 3, the words of cases, and a remark on its balance."""
    body = gb.mass(1.0, stiffness=100.0)
    scene = gb.Scene(body)
    outcome = gb.run(
        scene, step=0.01, end=1.0, start=scene.state({body: 0.1}), scheme=gb.euler(), output=tmp_path / "a"
    )
    assert outcome.exit_status == 3
    assert "took" in outcome.message
    assert outcome.summary["status"] == "failed"
    assert any("promises no energy balance" in one for one in outcome.summary["warnings"])
    lost = 0.5 * 100.0 * 0.1**2 * (1.0 - 1.01**-100)  # theta = 1: each step divides energy by 1 + (w h)^2
    assert outcome.summary["energy"]["algorithmic_dissipation"] == pytest.approx(lost, rel=1e-9)


def test_a_motion_that_is_not_finite_keeps_the_records_before(tmp_path: Path) -> None:
    """A motion whose energy overflows ends with status 4, and its records end before."""
    body = gb.mass(1.0, name="a")
    push = gb.Force(body["at"], lambda t: np.where(np.asarray(t) < 0.05, 1.0, 1e308))
    outcome = gb.run(gb.Scene(body, loads=[push]), step=1e-3, end=1e3, output=tmp_path / "a")
    assert outcome.exit_status == 4
    assert outcome.summary["reason"] == "not finite"
    history = gb.open_results(outcome).history
    assert np.isfinite(history["displacement"].values).all()
    assert float(history["time"][-1]) == pytest.approx(0.05)


def test_observers_see_every_record_and_set_loads(tmp_path: Path) -> None:
    """A controller in an observer moves as the same controller between the steps of a march."""
    seen = []

    def made() -> tuple[gb.Scene, gb.Force]:
        body = gb.mass(1.0, stiffness=100.0, name="a")
        brake = gb.Force(body["at"], 0.0, name="brake")
        push = gb.Force(body["at"], lambda t: np.sin(9.0 * t), name="push")
        return gb.Scene(body, loads=[brake, push]), brake

    scene, brake = made()

    def control(step: Any) -> None:
        seen.append(step.t)
        brake.value = -3.0 * step["at"].velocity

    outcome = gb.run(scene, step=1e-3, end=0.5, observers=[control], output=tmp_path / "a")
    scene, brake = made()
    for step in gb.march(scene, step=1e-3, end=0.5):
        brake.value = -3.0 * step["at"].velocity
    assert len(seen) == 500
    last = gb.open_results(outcome).history["displacement"].values[-1, 0, 0]
    assert last == step["at"].displacement


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"step": 1e-3}, "needs `end=`"),
        ({"step": 1e-3, "end": 1.0, "stop": 2.0}, "found `stop=`"),
        ({"step": 1e-3, "end": 1.0, "every": 0}, "every = 0"),
        ({"step": 1e-3, "end": 1.0, "of": "probe.tip.rms"}, "found `of=`"),
        ({"step": 1e-3, "end": 1.0, "period": -1.0}, "period -1.0"),
        ({"step": 1e-3, "end": 1.0, "gates": {"total": 1.0}}, "gates: total"),
        ({"step": 1e-3, "end": 1.0, "observers": [3]}, "the observer 3"),
        ({"step": 1e-3, "end": -1.0}, "end -1.0"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_by_name(tmp_path: Path, arguments: dict[str, Any], words: str) -> None:
    """Before anything is written."""
    with pytest.raises(gb.UserError, match=words):
        gb.run(ball(), output=tmp_path / "a", **arguments)
    assert not (tmp_path / "a").exists()


def test_step_and_end_are_no_arguments_of_cases() -> None:
    """A case has them as keys."""
    with pytest.raises(gb.UserError, match="found `step=`"):
        gb.run("cases/stability.toml", step=1e-4)


def test_results_are_not_replaced_by_accident(tmp_path: Path) -> None:
    """As those of cases."""
    gb.run(ball(), step=1e-3, end=0.01, output=tmp_path / "a")
    with pytest.raises(gb.UserError, match="already holds results"):
        gb.run(ball(), step=1e-3, end=0.01, output=tmp_path / "a")
    assert gb.run(ball(), step=1e-3, end=0.01, output=tmp_path / "a", overwrite=True).exit_status == 0
