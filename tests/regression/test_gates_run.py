"""Runs that cannot be trusted or cannot go on: exit status, what is reported, and what is left on disk."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.integrators.midpoint import Midpoint
from gapbeam.solver.system.semi_discrete import Step
from tests.shared.command import DEMO, RATTLE, alone, called, called_in_turn, settings

pytestmark = alone

# Newmark on a contact of 2.4 E/h, known before the run to create energy: some impacts create it and others take it,
# by chance, and in 0.06 s more is created than taken.
KNOWN = ("time.scheme=newmark", "contact.stiffness=1e14", *RATTLE, "time.end=0.06")
# On one of 0.7 E/h it is not known before the run, and creates energy all the same.
GROWING = ("time.scheme=newmark", "contact.stiffness=3e13", *RATTLE, "time.end=0.06")
# One iteration of the contact solve, no halving: the first time a face opens is one too many.
STUCK = (
    "time.max_iterations=1",
    "time.max_halvings=0",
    "load.shaker.amplitude=100.0",
    "load.shaker.ramp=0.0",
    "time.end=0.02",
)


def summary_of(folder: Path) -> dict[str, Any]:
    """Return summary.json, read as strict JSON: no NaN in it."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} in summary.json")

    return json.loads((folder / "summary.json").read_text(encoding="utf-8"), parse_constant=refuse)


def test_created_energy_fails_the_run(tmp_path: Path) -> None:
    """Exit status 3, with when, how much and what to try; the records up to then can be read and show it."""
    done = called("run", DEMO, *settings(*GROWING), "--output", tmp_path)
    assert done.returncode == 3, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    for words in ("created", "at t = ", "scheme discrete-gradient", "time.step", "contact.stiffness", str(tmp_path)):
        assert words in done.stderr
    summary = summary_of(tmp_path)
    assert (summary["status"], summary["exit_status"]) == ("failed", 3)
    assert summary["message"] in done.stderr
    assert summary["energy"]["relative_growth"] > summary["gates"]["limits"]["total_growth"]
    history = gapbeam.open_results(tmp_path).history
    assert 1 < history.sizes["time"] < 601
    assert history["time"].values[-1] == pytest.approx(float(summary["message"].split()[3]), abs=1.5e-4)
    assert history["algorithmic_dissipation"].values[-1] < 0.0


def test_known_creation_of_energy_is_refused(tmp_path: Path) -> None:
    """Exit status 2 from run and check before anything is written: what was found, expected, and all ways out."""
    folder = tmp_path / "out"
    run = ["run", DEMO, *settings(*KNOWN), "--output", folder]
    for done in called_in_turn(run, ["check", DEMO, *settings(*KNOWN)]):
        assert done.returncode == 2, done.stderr
        assert (done.stdout, "Traceback" in done.stderr) == ("", False)
        for words in (
            "time.scheme",
            "found:    newmark on a contact of 1e+14 Pa/m, 2.38 E/h (E = 2.1e+11 Pa, h = 0.005 m)",
            "expected: for this scheme a penalty of at most 4.2e+13 Pa/m, 1 E/h",
            'time.scheme = "discrete-gradient"',
            "contact.stiffness = 4.2e+13",
            "gates.accept_energy_growth = true",
        ):
            assert words in done.stderr
    assert not folder.exists()


def test_check_reports_of_an_accepted_creator() -> None:
    """`gapbeam check` of a combination that was accepted by name: exit status 0, and a warning."""
    done = called("check", DEMO, *settings(*KNOWN, "gates.accept_energy_growth=true"))
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert "warning: newmark on a contact of 1e+14 Pa/m, 2.38 E/h" in words
    assert "accepted by name" in words


def test_created_energy_can_be_accepted(tmp_path: Path) -> None:
    """With gates.accept_energy_growth even what is known to: to the end, exit status 0, and the summary warns of it."""
    done = called("run", DEMO, *settings(*KNOWN, "gates.accept_energy_growth=true"), "--output", tmp_path)
    assert done.returncode == 0, done.stderr
    summary = summary_of(tmp_path)
    assert summary["status"] == "completed"
    assert summary["energy"]["relative_growth"] > 0.05
    assert [text for text in summary["warnings"] if "accepted by gates.accept_energy_growth" in text]
    (known,) = [text for text in summary["warnings"] if "known to create energy" in text]
    assert "newmark on a contact of 1e+14 Pa/m, 2.38 E/h" in known
    assert "accepted by name" in known
    assert known in done.stderr
    assert gapbeam.open_results(tmp_path).history.sizes["time"] == 601


def test_conserving_scheme_passes_the_same_gates(tmp_path: Path) -> None:
    """The remedy that the message names works: discrete-gradient on the same contact creates nothing."""
    assert gapbeam.run(DEMO, [*KNOWN, "time.scheme=discrete-gradient"], tmp_path).exit_status == 0
    summary = summary_of(tmp_path)
    assert abs(summary["energy"]["relative_growth"]) < 1e-6
    assert summary["gates"]["violations"] == 0


def test_step_that_does_not_converge_fails_the_run(tmp_path: Path) -> None:
    """Exit status 4, with when, on which face and where, and what to try; the steps before it are on disk."""
    done = called("run", DEMO, *settings(*STUCK), "--output", tmp_path)
    assert done.returncode == 4, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    summary = summary_of(tmp_path)
    assert (summary["status"], summary["exit_status"]) == ("failed", 4)
    message = summary["message"]
    assert message in done.stderr
    for words in ("with a step of 0.0001 s", ", point (", "did not converge in 1 iterations", "max_iterations"):
        assert words in message
    assert "at the base" in message or "at the gland" in message
    history = gapbeam.open_results(tmp_path).history
    assert history.sizes["time"] == summary["convergence"]["steps"] + 1 > 1
    assert history["time"].values[-1] == pytest.approx(float(message.split()[3]), rel=1e-6)
    assert np.isfinite(history["displacement"]).all()


@pytest.mark.slow(minutes=0.1)
def test_halving_gets_over_the_step_that_did_not_converge(tmp_path: Path) -> None:
    """The same with few iterations and halvings allowed: parts of steps are counted, and records stay whole steps."""
    overrides = [*RATTLE, "time.end=0.01", "time.max_iterations=4", "time.max_halvings=12"]
    outcome = gapbeam.run(DEMO, overrides, tmp_path)
    assert outcome.exit_status == 0, outcome.message
    convergence = outcome.summary["convergence"]
    assert convergence["parts_of_halved_steps"] > 0
    history = gapbeam.open_results(tmp_path).history
    np.testing.assert_allclose(history["time"], 1e-4 * np.arange(101), rtol=1e-12)
    assert history["time"].values[-1] == 0.01


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(
    ("part", "factor"),
    [("u", np.nan), ("v", np.nan), ("u", np.inf), ("v", 1e300), ("depth", np.nan)],
)
def test_what_is_not_finite_is_never_a_success(
    part: str, factor: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A NaN or an infinity in the state after 1 ms: not status 0, and what is on disk up to then is finite."""
    poison(monkeypatch, part, factor, 1e-3)
    with np.errstate(all="ignore"):
        outcome = gapbeam.run(DEMO, ["time.end=5e-3"], tmp_path)
    assert outcome.exit_status in (3, 4), outcome.message
    summary = summary_of(tmp_path)
    assert (summary["status"], summary["exit_status"]) == ("failed", outcome.exit_status)
    history = gapbeam.open_results(tmp_path).history
    assert np.isfinite(history["displacement"]).all()
    assert np.isfinite(history["contact_force"]).all()
    assert 5e-4 < history["time"].values[-1] < 1.5e-3


def test_pressure_of_the_last_step_is_finite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A NaN in the contact pressure of the very last step, after which nothing can trip over it: not status 0."""
    poison(monkeypatch, "pressure", np.nan, 5e-3)
    with np.errstate(all="ignore"):
        outcome = gapbeam.run(DEMO, ["time.end=5e-3"], tmp_path)
    assert outcome.exit_status == 4


def poison(monkeypatch: pytest.MonkeyPatch, part: str, factor: float, after: float) -> None:
    """Multiply a part of every state from a time on."""
    honest = Midpoint.advance

    def poisoned(self: Midpoint, *arguments: Any) -> Step:
        step = honest(self, *arguments)
        if step.new.time < after - 1e-9:
            return step
        return replace(step, new=replace(step.new, **{part: getattr(step.new, part) * factor}))

    monkeypatch.setattr(Midpoint, "advance", poisoned)
