"""What `gapbeam check` predicts of a run: wall time and memory within a factor of 2 of the run itself."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi4py import MPI

import gapbeam
from benchmarks.predictions import both
from gapbeam.solver.case.case import Case
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.memory.memory_check import memory_of
from gapbeam.solver.models.model import build_model
from gapbeam.studies import case_description, trial_prediction
from gapbeam.studies.case_description import describe_case
from gapbeam.studies.trial_prediction import TriedSteps, predict, tried
from tests.shared.command import DEMO, alone, called, settings
from tests.shared.models import beam_case

FACTOR = 2.0
ATTEMPTS = 3  # other work on the machine can disturb the one or the other

COARSE_SOLID = ("mesh.cells_through_thickness=2", "mesh.cells_across_width=2", "mesh.support_size=8.4e-3")


@pytest.mark.timing
@alone
@pytest.mark.parametrize(
    ("case", "overrides"),
    [
        ("demo.toml", ("time.end=0.3",)),
        ("li2013.toml", (*COARSE_SOLID, "time.end=0.05", "load.shaker.ramp=0.01")),
        ("li2013.toml", (*COARSE_SOLID, "model.type=reduced", "time.end=0.1")),
    ],
    ids=["slice", "solid", "reduced"],
)
def test_prediction_is_within_a_factor_of_two(case: str, overrides: Sequence[str]) -> None:
    """Check and run in processes of their own: total wall time and peak of memory."""
    ratios = []
    for _ in range(ATTEMPTS):
        check, run = both(case, *overrides)
        assert 1.0 / FACTOR <= check["predicted_memory"] / run["run_memory"] <= FACTOR
        ratios.append(check["time"] / run["time"])
        if 1.0 / FACTOR <= ratios[-1] <= FACTOR:
            return
    raise AssertionError(f"predicted over measured: {ratios}")


@alone
@pytest.mark.parametrize("model", [{"type": "beam"}, {"type": "beam", "elements": 60, "spacing": "graded"}, "rigid"])
def test_check_says_what_it_does_and_stops_where_steps_are_slow(
    model: object, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Words before the seat and before the trial; the first steps have to do; beams are tried out on any mesh."""
    monkeypatch.setattr(trial_prediction, "LONGEST", 0.0)
    monkeypatch.setattr(trial_prediction, "ENOUGH", 0.0)
    monkeypatch.setattr(case_description, "LARGEST", 10**9 if model == "rigid" else 10)
    caplog.set_level("INFO", logger="gapbeam")
    found = describe_case(gapbeam.read_case(DEMO, {"model": model, "time.end": 1.0}), MPI.COMM_SELF)
    assert "seats the beam" in caplog.text
    assert "marches some steps" in caplog.text
    assert f"{trial_prediction.WARM_UP} steps from the seat" in found.cost.basis
    assert not found.cost.scaled


@alone
def test_the_time_that_makes_machine_code_is_not_that_of_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first trial of an hour is a warm-up: later ones say what a step costs."""
    march, tried = trial_prediction._Trials.march, list[int]()

    def slow_at_first(trials: trial_prediction._Trials, steps: int) -> trial_prediction._Trial:
        tried.append(steps)
        found = march(trials, steps)
        return found if len(tried) > 1 else replace(found, spent=3600.0, per_step=3600.0 / steps)

    monkeypatch.setattr(trial_prediction._Trials, "march", slow_at_first)
    found = describe_case(gapbeam.read_case(DEMO, {"model": "rigid", "time.end": 1.0}), MPI.COMM_SELF)
    assert found.cost.per_step < 1.0
    assert len(tried) > 2


@alone
def test_check_reports_the_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command: time of the run, of its parts, of the error estimate, and memory, with what they stand on."""
    monkeypatch.delenv("GAPBEAM_ERRORS")
    done = called("check", DEMO, *settings("time.end=0.05"))
    assert done.returncode == 0, done.stderr
    rows = {line.split("  ")[0]: line for line in done.stdout.splitlines()}
    assert re.search(r"measured now: \d+ steps from the seat", rows["step"])
    assert rows["field"].rstrip().endswith("21 of them")
    assert rows["errors"].rstrip().endswith("4 comparison runs")
    assert "GB" in rows["memory"]
    for part in ("model", "seat", "factorization", "delassus"):
        assert f"{part} " in rows["set-up"]


@alone
def test_trial_that_fails_is_reported() -> None:
    """A scheme that creates energy under the trial's sudden loads: a prediction all the same, with the reason."""
    creating = ("time.scheme=newmark", "gates.total_growth=0.0025", "contact.stiffness=1e13")
    done = called("check", DEMO, *settings(*creating, "load.shaker.amplitude=500"))
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert "ended early: at t = " in words
    assert "the others may take far less or more" in words


@given(st.integers(1, 1_000_000), st.floats(0.0, 1.0), st.booleans())
def test_few_steps_promise_no_factor(steps: int, share: float, scaled: bool) -> None:
    """Eight steps from the seat predicted ten times the time of a shaft, thirteen times that of a rail that flies."""
    tried = round(share * steps)
    cost = trial_prediction.Prediction({}, 0.0, steps, 1.0, 0.0, 0, 0.0, 0.0, "", scaled=scaled, tried=tried)
    assert ("factor of 2" in cost.certainty) == (not scaled and tried >= 0.1 * steps)
    assert (f"from {tried} of {steps} steps" in cost.certainty) == (not scaled and tried < 0.1 * steps)


def slice_of(size: float) -> Case:
    """Return a slice with cells of this size, m."""
    mesh = {"size": size, "support_size": size, "cells_through_thickness": round(0.012 / size)}
    return beam_case({"mesh": mesh, "time": {"end": 0.1, "step": 1.0e-4}})


@pytest.mark.timing
@alone
def test_large_models_are_scaled_from_coarser_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """A slice of 21 000 DOFs from those of about 2000 and 6000: within a factor of 2 of trying it out itself."""
    case = slice_of(0.0015)
    monkeypatch.setattr(trial_prediction, "TRIED", (2000, 6000))
    model = build_model(case, MPI.COMM_SELF)
    assert model.mesh_dofs > 15_000
    ratios = []
    for _ in range(ATTEMPTS):
        scaled = trial_prediction.predict_large(case, model.mesh_dofs, MPI.COMM_SELF)
        tried = predict(Simulation(model), sum(model.body.seconds.values()), MPI.COMM_SELF)
        assert scaled.steps == tried.steps
        assert 1.0 / FACTOR <= scaled.memory / tried.memory <= FACTOR
        assert "scaled from coarser meshes of" in scaled.basis
        ratios.append(scaled.total / tried.total)
        if 1.0 / FACTOR <= ratios[-1] <= FACTOR:
            return
    raise AssertionError(f"scaled over tried out: {ratios}")


@given(st.floats(1.1, 4.0), st.floats(0.5, 5.0), st.floats(0.5, 5.0), st.floats(5.0, 8.0), st.sampled_from([2, 3]))
def test_memory_is_scaled_as_it_is_checked(
    apart: float, first: float, second: float, size: float, dimension: int
) -> None:
    """Peaks of two trials of nearly one size, in GB, gave 26 GB for 7, beside a check that had found enough."""
    case = beam_case(
        {"mesh": {"dimension": dimension, "size": 0.02, "support_size": 0.0125}, "model": {"type": "full"}}
    )
    dofs = round(10.0**size)
    tries = iter(((20_000, first * 1e9), (round(20_000 * apart), second * 1e9)))

    def predicted(*_: object) -> trial_prediction.Prediction:
        return trial_prediction.Prediction({"model": 1.0}, 0.0, 10, 1e-3, 0.0, 1, 1e-3, held[1], "")

    held = (0, 0.0)

    def made(*_: object) -> SimpleNamespace:
        nonlocal held
        held = next(tries)
        return SimpleNamespace(mesh_dofs=held[0])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trial_prediction, "build_model", made)
        patch.setattr(trial_prediction, "refuse_energy_creators", lambda *_: None)
        patch.setattr(trial_prediction, "Simulation", lambda model: model)
        patch.setattr(trial_prediction, "predict", predicted)
        patch.setattr(trial_prediction, "peak_memory", lambda _: [0.0])
        patch.setattr(trial_prediction, "gc", SimpleNamespace(collect=int))  # seconds, beside the rest of a suite
        found = trial_prediction.predict_large(case, dofs, MPI.COMM_SELF)
    share = found.memory / (second * 1e9)
    asked, tried_out = (sum(memory_of(case, float(one)).values()) for one in (dofs, held[0]))
    assert share == pytest.approx(asked / tried_out)
    assert found.per_step >= 1e-3


def test_coarser_meshes_have_about_the_unknowns_asked_for() -> None:
    """In 2D and in 3D; a mesh file makes place for a mesh of gmsh."""
    model = build_model(slice_of(0.003), MPI.COMM_SELF)
    coarse = build_model(trial_prediction.coarser(slice_of(0.0015), 4.0), MPI.COMM_SELF)
    assert coarse.mesh_dofs == pytest.approx(model.mesh_dofs, rel=0.2)
    solid = beam_case({"mesh": {"dimension": 3, "file": "somewhere.msh", "size": 0.01}})
    found = trial_prediction.coarser(solid, 8.0).mesh
    assert found.file is None
    assert (found.size, found.cells_through_thickness, found.cells_across_width) == (0.02, 1, 2)


@alone
@pytest.mark.parametrize("model", ["rigid", "beam"])
@pytest.mark.parametrize("place", [0.05, 0.4])
def test_a_run_that_ends_at_its_start_is_predicted_so(
    model: str, place: float, caplog: pytest.LogCaptureFixture
) -> None:
    """A shaft that nothing holds along gravity slips out while it is seated: no step and no comparison run follow."""
    tables = {
        "beam": {"length": 0.5, "thickness": 0.01, "width": 0.01, "section": "round"},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [
            {"name": name, "from": x, "to": x + 0.02, "clearance": 1e-4, "region": "hole", "support_stiffness": 1e6}
            for name, x in (("a", 0.0), ("b", place))
        ],
        "restraint": {"axial": 1.0},
        "model": {"type": model},
        "load": [
            {"type": "gravity", "direction": [-1.0, 0.0, 0.0]},
            {"type": "harmonic_force", "name": "shaker", "point": 0.25, "amplitude": 1.0, "frequency": 20.0},
        ],
        "time": {"end": 0.1},
    }
    with caplog.at_level("INFO", logger="gapbeam"):
        found = describe_case(gapbeam.read_case(tables), MPI.COMM_WORLD)
    assert found.warnings[0].startswith("the run ends at its start: ")
    assert "load gravity drives this motion" in found.warnings[0]
    assert (found.cost.march, found.cost.companions, found.cost.certainty) == (0.0, 0, "the run ends at its start")
    assert "comparison runs" not in caplog.text


@given(
    st.floats(1e-5, 2e-3),
    st.floats(1.0, 100.0),
    st.floats(3.0, 10.0),
    st.floats(0.0, 2.0),
)
def test_slow_first_steps_do_not_stand_for_all(usual: float, times: float, lasting: float, loads: float) -> None:
    """Steps that slide off a seat cost a hundred times the usual ones: an hour was predicted for a minute."""

    def march(steps: int) -> TriedSteps:
        early = usual * times * lasting * (1.0 - np.exp(-steps / lasting))
        spent = steps * usual + early + (loads if steps == trial_prediction.WARM_UP else 0.0)
        return TriedSteps(steps, spent, spent / steps, 0.0, 0.0, "", False)

    _, done = tried(march, 100_000, MPI.COMM_SELF)
    assert usual <= done.per_step < 10.0 * usual
    assert done.spent < trial_prediction.LONGEST


@alone
@pytest.mark.parametrize("count", [1, 2, 9, 30])
def test_supports_that_are_alike_stand_once_with_their_number(count: int) -> None:
    """Whatever their number, check has no more rows: a rail on twenty sleepers filled two screens."""
    places = [0.5 * (number + 0.25) / count for number in range(count)]
    body = {"mass": 1.0, "stiffness": 1.0e5}
    tables = {
        "beam": {"length": 0.51, "thickness": 0.012, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
        "model": {"type": "beam"},
        "support": [
            {
                "name": f"s{number}",
                "from": x,
                "to": x + 0.005,
                "clearance": 1e-4,
                "support_stiffness": 1e6,
                "body": body,
            }
            for number, x in enumerate(places)
        ],
        "load": [{"type": "gravity"}],
        "time": {"end": 1e-3, "step": 1e-4},
    }
    found = describe_case(Case.model_validate(tables), MPI.COMM_SELF)
    rows = [row for section in found.sections.values() for row in section]
    assert [name for name, *_ in rows if name.startswith(("s1", "s2", "support.s1"))] == []
    said = [words for name, _, words in rows if name.startswith(("support s0", "support.s0"))]
    assert len(said) == 2
    assert all(words.endswith(f"; and {count - 1} alike") == (count > 1) for words in said)
    (faces,) = (words for name, _, words in rows if name == "contact points")
    assert ("s0_below, s0_above" in faces) if count == 1 else f"each of {2 * count} faces" in faces or count == 2


@given(st.floats(1e-11, 1e2))
def test_durations_of_contacts_keep_their_digits(seconds: float) -> None:
    """Three of them, between 1 and 1000 of a unit as far as there is one: 1650 us read 1.65e+03."""
    number, unit = case_description._brief(seconds).split()
    assert float(number) * {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit] == pytest.approx(seconds, rel=5.01e-3)
    assert "e" not in number
