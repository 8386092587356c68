"""The trade-off: estimates against closed forms, choices among made-up levels, and the command on a small case."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import inf
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gapbeam
from gapbeam.commands.tradeoff import level_within
from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.tradeoff.level_errors import (
    WHOLE,
    Grounds,
    Judged,
    choice,
    differences,
    doubts,
    front,
    judged,
    predictable_periods,
    richardson,
    uncertainty,
)
from gapbeam.studies.tradeoff.level_measurement import Level, LevelJob, MeasuredLevel, plan_levels
from gapbeam.studies.tradeoff.run_tradeoff import stored_choice, study_key, tradeoff_folder, write_study
from gapbeam.studies.tradeoff.tradeoff_study import overrides_as_mapping, run_study
from tests.shared.command import PROJECT, alone, called, called_in_turn, settings
from tests.shared.history_labels import LABELS

CASE = PROJECT / "cases" / "stability.toml"
FREQUENCY = 20.0
SMOOTHING = 5e-4  # s


def moving(amplitude: float = 1e-3, growth: float = 0.0, seconds: float = 0.5) -> MeasuredLevel:
    """Return a measurement of x = amplitude sin(2 pi f t), plus growth exp(20 t) of a third harmonic."""
    time = np.arange(round(seconds / 1e-4) + 1) * 1e-4
    omega = 2 * np.pi * FREQUENCY
    x = amplitude * np.sin(omega * time) + growth * np.exp(20.0 * time) * np.sin(3 * omega * time)
    v = np.gradient(x, 1e-4)
    a = np.concatenate([[0.0], np.diff(v) / 1e-4])
    along = {"displacement": x, "velocity": v, "acceleration_absolute": a}
    records = {name: np.stack([0 * y, y], axis=-1)[:, None, :] for name, y in along.items()}
    force = 40.0 + 4e4 * amplitude * np.sin(omega * time)
    impulse = np.cumsum(force) * 1e-4
    records |= {"time": time, "contact_force": np.stack([force, force], 1), "impulse": np.stack([impulse, impulse], 1)}
    return MeasuredLevel(
        frequency=FREQUENCY, records=records, labels=LABELS, set_up=1.0, per_second=2.0, smoothing=SMOOTHING
    )


def test_richardson_finds_the_error_of_a_known_order() -> None:
    """Q = 1 + h^2 on h, 1.5 h, 2.25 h: the error of the finest is h^2; values that wander give their spread."""
    h = 0.1
    values = [1.0 + (h * 1.5**k) ** 2 for k in range(3)]
    assert richardson(*values, 1.5, 4.0) == pytest.approx(h**2, rel=1e-9)
    assert richardson(1.0, 1.02, 0.99, 1.5, 4.0) == pytest.approx(0.03)
    assert richardson(1.0, 1.0, 1.1, 1.5, 4.0) == 0.0
    steep = richardson(1.0, 1.01, 1.01 + 0.01 * 1.5**9, 1.5, 4.0)  # order 9 is not believed
    assert steep == pytest.approx(0.01 / (1.5**4 - 1.0))


def test_differences_are_those_put_in() -> None:
    """A motion 3 % larger: all that is proportional to it differs by 3 %, the impulse by what it is."""
    found = differences(moving(1.03e-3).figures(8), moving(1e-3).figures(8))
    for name in ("acceleration", "displacement", "harmonics"):
        assert found[name] == pytest.approx(0.03, rel=1e-3)
    assert found["largest recorded force"] == pytest.approx(0.03 * 40.0 / 80.0, rel=1e-3)
    assert found["impulse"] == pytest.approx(0.0, abs=1e-4)


def test_motions_are_followed_as_long_as_they_stay_together() -> None:
    """A difference that grows as exp(20 t), nine times as large in the acceleration: 1 % of its range within 0.2 s."""
    family = [moving(), moving(growth=1e-7)]
    assert predictable_periods([family[0], moving()], 10) == 10
    periods = predictable_periods(family, 10)
    assert 2 <= periods <= 5
    assert predictable_periods([family[0], moving(growth=1e-5)], 10) < periods


def test_long_means_decide_beyond_their_scatter() -> None:
    """A difference within two standard errors is none; a clear one is; another cycle is infinitely far."""
    windows = np.random.default_rng(0).normal(1.0, 0.05, 10)
    level = Level("reduced 2D", {})

    def with_means(shift: float, word: str = "no cycle") -> MeasuredLevel:
        measured = moving()
        measured.words, measured.long = [word], {"tip peak-to-peak displacement": WindowFigure("m", windows + shift)}
        return measured

    reference = with_means(0.0)
    assert judged(level, with_means(0.01), reference, 8, 2.0).statistics == 0.0
    assert judged(level, with_means(0.5), reference, 8, 2.0).statistics == pytest.approx(0.45, abs=0.04)
    other = judged(level, with_means(0.0, "period 3"), with_means(0.0, "period 1"), 8, 2.0)
    assert other.statistics == inf
    assert not other.inside(0.5)


def made_up(name: str, seconds: float, error: float, verdict: str = "passed") -> Judged:
    """Return a fidelity level that was never run."""
    return Judged(Level(name, {}), MeasuredLevel(verdict=verdict), {"displacement": error}, None, seconds, covered=1.0)


def test_the_cheapest_level_inside_is_chosen() -> None:
    """By time among those inside; the front leaves out what is dearer and no nearer; failures are never taken."""
    levels = [
        made_up("a", 1.0, 0.05),
        made_up("b", 2.0, 0.015),
        made_up("c", 3.0, 0.02),
        made_up("d", 9.0, 0.001),
        made_up("e", 0.1, 0.0, "energy created"),
    ]
    grounds = Grounds(end=1.0, uncertainty={"displacement": 0.0})
    best = choice(levels, 0.02, grounds)
    assert best is not None
    assert best.level.name == "b"
    assert choice(levels, 1e-4, grounds) is None
    assert [one.level.name for one in front(levels[:4])] == ["a", "b", "d"]


def test_a_level_plan_keeps_the_contact_and_refines_the_mesh() -> None:
    """The stiffness computed for the mesh of the case holds on all fidelity levels; a mesh file cannot be refined."""
    case = read_case(CASE)
    plan = plan_levels(case)
    assert plan.fixed["contact.stiffness"] > 0.0
    sizes = [level.changes["mesh.size"] for level in (plan.reference, *plan.meshes)]
    assert sizes[0] < sizes[1] < sizes[2]
    assert {level.dimension for level in plan.levels} == {2}
    for level in (*plan.family, *plan.levels):
        read_case(CASE, {**plan.fixed, **level.changes})
    with pytest.raises(UserError, match="cannot be refined"):
        plan_levels(case.model_copy(update={"mesh": case.mesh.model_copy(update={"file": "beam.msh"})}))


def test_the_uncertainty_is_that_of_mesh_step_and_basis() -> None:
    """Amplitudes 1 + h^2 on three meshes, exact in step and basis: what is left is h^2 of the finest."""
    plan = plan_levels(read_case(CASE))
    found = {level.name: moving(1e-3) for level in plan.family}
    h = 0.05
    for place, level in enumerate((plan.reference, *plan.meshes)):
        found[level.name] = moving(1e-3 * (1.0 + (h * 2.0 ** (0.5 * place)) ** 2))
    for level in (*plan.steps, plan.basis):
        found[level.name] = found[plan.reference.name]
    message = uncertainty(plan, found, 8)
    assert message["displacement"] == pytest.approx(h**2, rel=0.02)


QUICK = ("time.end=0.1", "time.step=5e-4", "load.shaker.frequency=50", "load.shaker.amplitude=15", "mesh.degree=1")


def in_this_process(task: Callable[[list[LevelJob]], list[MeasuredLevel]], work: list[LevelJob]) -> list[MeasuredLevel]:
    """Do what `in_fresh_process` does without a process of its own, which costs seconds of imports."""
    return task(work)


@pytest.mark.slow(minutes=0.3)
def test_a_study_of_a_small_case_is_stored_and_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The levels run, the errors of the usual one are those of the case, and a run finds the level that was named."""
    monkeypatch.setattr("gapbeam.studies.tradeoff.tradeoff_study.in_fresh_process", in_this_process)
    message: list[str] = []
    study = run_study(CASE, overrides_as_mapping(list(QUICK)), 0.10, 5.0, message.append)
    assert any(text.startswith("reference: ") for text in message[:3])
    names = {one.level.name: one for one in study.levels}
    assert {"beam, 24 elements", "reduced 2D", "full 2D"} <= set(names)
    assert study.full_check is not None
    assert max(study.full_check.values()) < 0.02
    assert study.chosen is not None
    assert study.chosen.error <= 0.10
    assert study.grounds.chaotic
    assert study.doubts == doubts(study.chosen, 0.10, study.grounds)  # which of two is taken depends on their times
    short = [one for one in study.levels if one.covered < WHOLE * study.grounds.end]
    unknown = [one for one in short if one.means is None or one.means > 0.10]
    assert unknown
    for one in study.levels:
        last = f"the motion can be predicted for {one.covered:.3g} s only"
        assert any(word.startswith(last) for word in doubts(one, 0.10, study.grounds)[-1:]) == (one in unknown)
    case = read_case(CASE, QUICK)
    write_study(tmp_path, study, study_key(case))
    with Image.open(tmp_path / "tradeoff.png") as picture:
        assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 50
    named = stored_choice(tmp_path, case, 0.10)
    assert named is not None
    assert named.name == study.chosen.level.name
    assert list(named.doubts) == study.doubts
    read_case(CASE, {**overrides_as_mapping(list(QUICK)), **named.changes})
    assert stored_choice(tmp_path, read_case(CASE), 0.10) is None
    assert stored_choice(tmp_path, read_case(CASE, [*QUICK, "time.end=0.2"]), 0.10) is None
    none_inside = stored_choice(tmp_path, case, 1e-9)
    assert none_inside is not None
    assert "off the reference" in none_inside.doubts[0]
    monkeypatch.chdir(tmp_path)  # where `run --tolerance` looks for it
    write_study(tradeoff_folder(CASE), study, study_key(case))
    taken = level_within(CASE, list(QUICK), "10%")
    assert taken.changes == {**overrides_as_mapping(list(QUICK)), **named.changes}
    outcome = gapbeam.run(CASE, taken.changes, output=tmp_path / "run")
    assert outcome.exit_status == 0
    assert outcome.summary["model"]["dofs"] == study.chosen.measured.dofs


@pytest.mark.slow(minutes=0.1)
@alone
def test_what_cannot_be_studied_is_explained(tmp_path: Path) -> None:
    """No forcing period, a formulation without stiffness, a tolerance that is none: status 2, and what is expected."""
    unforced, fault, tolerance = called_in_turn(
        ["tradeoff", CASE, "--set", "probe=[]", "--output", tmp_path / "a"],
        ["tradeoff", CASE, "--set", 'contact.formulation="nitsche"', "--output", tmp_path / "b"],
        ["tradeoff", CASE, "--tolerance", "200%", "--output", tmp_path / "c"],
    )
    assert unforced.returncode == fault.returncode == tolerance.returncode == 2
    assert "at least one [[probe]]" in unforced.stderr
    assert "expected penalty" in fault.stderr
    assert not list(tmp_path.iterdir())


@alone
@pytest.mark.slow
def test_the_command_from_end_to_end(tmp_path: Path) -> None:
    """A study by the command, in processes of its own: table, data, picture, and the memory of each fidelity level."""
    words = ["tradeoff", CASE, *settings(*QUICK), "--tolerance", "10%", "--output", tmp_path / "study"]
    done = called(*words)
    assert done.returncode == 5, done.stderr
    assert "the cheapest fidelity level within 10 % of the reference over the first " in done.stdout
    assert "The tolerance is not promised: " in done.stdout
    data = json.loads((tmp_path / "study" / "tradeoff.json").read_text(encoding="utf-8"))
    assert not data["promised"]
    assert data["covered"] < data["end"] == 0.1
    assert {"beam, 24 elements", "reduced 2D", "full 2D"} <= {level["name"] for level in data["rungs"]}
    assert all(value >= 0.0 for value in data["uncertainty"].values())
    assert all(level["memory"] > 5e7 for level in data["rungs"] if level["verdict"] == "passed")
