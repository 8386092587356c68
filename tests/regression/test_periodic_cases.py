"""Periodic responses of beams by case files: three methods agree, what a run leaves behind, and what it refuses."""

from __future__ import annotations

import csv
import json
import signal
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from PIL import Image

import gapbeam
from gapbeam.postprocess.figures.curve_figures import draw_response_curve
from gapbeam.postprocess.plot import plot
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.checks.periodic_checks import value_of
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.periodic.periodic_response import PeriodicResponse, find_response
from gapbeam.solver.run import periodic_search
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.run_case import run_case
from gapbeam.solver.schema.record_table import CURVE_FILE, CURVE_TABLE_FILE, HISTORY
from tests.shared.case_texts import GOOD, assert_says, faults_of, written

CASE = Path(__file__).parents[2] / "cases" / "periodic.toml"
EXCITER = CASE.with_name("exciter.toml")
COARSE = ["model.elements=12", "mesh.support_size=0.0125", "mesh.size=0.06"]
"""Overrides for a beam of 26 DOFs."""


def run(folder: Path, *overrides: str) -> Outcome:
    """Run the ready case, coarser, with overrides."""
    return run_case(read_case(CASE, [*COARSE, *overrides]), folder, MPI.COMM_SELF, overwrite=True)


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    return run(tmp_path_factory.mktemp("shot"))


def amplitudes(outcome: Outcome) -> np.ndarray:
    """Harmonics 1-5 of both probes, (2, 5)."""
    probes = outcome.summary["periodic"]["probes"]
    return np.array([probes[name]["harmonics"] for name in ("test", "tip")])


def peaks(outcome: Outcome) -> np.ndarray:
    """Peak to peak of both probes."""
    return np.array([outcome.summary["periodic"]["probes"][name]["peak_to_peak"] for name in ("test", "tip")])


@pytest.mark.slow(minutes=0.2)
def test_shooting_agrees_with_a_march(shot: Outcome, tmp_path: Path) -> None:
    """The last period of a march of 4 s has the peaks and harmonics 1-5 of the orbit within 0.1 %."""
    marched = run(tmp_path, "analysis={type = 'transient'}", "time.end=4.0", "output.fields_interval=1.0")
    assert shot.exit_status == marched.exit_status == 0
    history = open_results(tmp_path).history
    last = history["displacement"].values[-500:, :, 1].T
    spectrum = 2.0 * np.abs(np.fft.rfft(last, axis=1))[:, 1:6] / 500
    assert np.ptp(last, axis=1) == pytest.approx(peaks(shot), rel=1e-3)
    assert spectrum == pytest.approx(amplitudes(shot), rel=1e-3)
    assert shot.summary["periodic"]["residual"] <= 1e-8
    assert shot.summary["periodic"]["stable"]
    assert shot.summary["peak_contact_force"]["gland"] > 100.0


def test_a_curve_stops_where_it_is_asked_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a signal nor the wall-time limit ended a run that followed a curve."""

    def found(*arguments: Any) -> PeriodicResponse:
        response = find_response(*arguments)
        signal.raise_signal(signal.SIGTERM)
        return response

    monkeypatch.setattr(periodic_search, "find_response", found)
    curve = "analysis.continuation={key = 'support.clearance', low = 1e-4, high = 1.2e-4, max_points = 2}"
    outcome = run(tmp_path, curve)
    assert outcome.exit_status == 143
    assert "interrupted on the curve, at support.clearance = " in outcome.message
    assert outcome.summary["periodic"]["residual"] <= 1e-8


@pytest.mark.slow(minutes=0.1)
def test_harmonic_balance_agrees_with_shooting(tmp_path: Path) -> None:
    """160 harmonics give harmonics 1-5 of 1000 steps within 1 %, the peaks within 0.2 %, and an energy balance."""
    shot = run(tmp_path / "shot", "time.step=5e-5")
    balanced = run(tmp_path / "balanced", "analysis.method=harmonic-balance", "analysis.harmonics=160", "time.end=3.0")
    assert balanced.exit_status == 0
    assert amplitudes(balanced) == pytest.approx(amplitudes(shot), rel=1e-2)
    assert peaks(balanced) == pytest.approx(peaks(shot), rel=2e-3)
    found = balanced.summary["periodic"]
    assert found["residual"] <= 1e-8
    assert found["largest_multiplier"] == pytest.approx(shot.summary["periodic"]["largest_multiplier"], abs=0.03)
    assert found["change_when_marched"] < 0.05
    assert abs(balanced.summary["energy"]["relative_residual"]) < 1e-3


@pytest.mark.slow(minutes=0.1)
def test_multipliers_of_too_few_harmonics_are_not_known(tmp_path: Path) -> None:
    """40 harmonics of the case of an exciter say "period doubling, 1.24" where shooting finds it stable, 0.762."""
    overrides = ["analysis.method=harmonic-balance", "time.end=0.5"]
    outcome = run_case(read_case(EXCITER, overrides), tmp_path, MPI.COMM_SELF, overwrite=True)
    found = outcome.summary["periodic"]
    assert outcome.exit_status == 0
    assert [found["stability"], found["stable"], found["largest_multiplier"]] == ["not known", None, None]
    assert found["multiplier_error"] > 0.3
    (warning,) = (warning for warning in outcome.summary["warnings"] if "not known" in warning)
    assert "analysis.method = shooting" in warning
    assert not any("unstable" in warning for warning in outcome.summary["warnings"])


@pytest.mark.slow(minutes=0.3)
def test_full_model_agrees_with_a_reduced_one(tmp_path: Path) -> None:
    """Newton-Krylov on the finite elements and Newton on their reduced model find the same orbit within 0.2 %."""
    both = [
        run(tmp_path / name, f"model={{type = '{name}'}}", "time.end=0.4", "time.step=5e-4")
        for name in ("full", "reduced")
    ]
    assert [outcome.exit_status for outcome in both] == [0, 0]
    assert peaks(both[0]) == pytest.approx(peaks(both[1]), rel=2e-3)
    assert amplitudes(both[0])[:, :3] == pytest.approx(amplitudes(both[1])[:, :3], rel=5e-3)
    assert both[0].summary["periodic"]["marches_of_disturbances"] > 0
    assert both[0].summary["periodic"]["residual"] <= 1e-8


def test_results_of_one_period(shot: Outcome) -> None:
    """The folder holds the records of a run over one period: first and last state are the same, the load does work."""
    results = open_results(shot.folder)
    history = results.history
    seldom = {"tangent", "gauge", "across", "moving", "joint", "support_body", "worn_face", "slip_mode", "moved_probe"}
    seldom |= {"turned_probe"}
    always = {one.name for one in HISTORY if one.name != "friction_dissipation" and not seldom & set(one.dims)}
    assert always <= set(history.variables)
    time = history["time"].values
    assert time[-1] == pytest.approx(0.05)
    assert len(time) == 501
    for name in ("displacement", "velocity"):
        values = history[name].values
        assert values[-1] == pytest.approx(values[0], abs=1e-6 * np.max(np.abs(values)))
    work = history["load_work"].values[-1].sum()
    lost = sum(history[f"{name}_dissipation"].values[-1] for name in ("structural", "contact"))
    assert work == pytest.approx(lost, rel=1e-6)
    assert work > 0.0
    assert shot.summary["periodic"]["ramps"] == "passed before the search"


def test_unstable_response_is_found_and_reported(tmp_path: Path) -> None:
    """With stiffer, less damped pads the response of one period has a multiplier below -1, and the run says so."""
    outcome = run(tmp_path, "contact.stiffness=1e11", "contact.damping=1e6")
    found = outcome.summary["periodic"]
    assert outcome.exit_status == 0
    assert found["stability"] == "period doubling"
    assert found["multipliers"][0]["real"] < -1.0
    assert any("unstable (period doubling" in warning for warning in outcome.summary["warnings"])


def test_failure_has_status_4(tmp_path: Path) -> None:
    """A search that finds nothing says so, with its residual, and leaves no orbit behind."""
    outcome = run(tmp_path, "analysis.start=seat", "analysis.max_iterations=1")
    assert outcome.exit_status == 4
    assert outcome.summary["status"] == "failed"
    assert "found no periodic response in 1 iterations" in outcome.message
    assert "periodic" not in outcome.summary


@pytest.mark.slow(minutes=0.3)
def test_curve_of_a_beam(tmp_path: Path) -> None:
    """A curve in the damping of the contact changes its stability at period doublings and grazings only.

    Table, summary and picture report it; unstable parts are dashed.
    """
    curve = ["key='contact.damping'", "low=1e6", "high=6e6"]
    outcome = run(tmp_path, "contact.stiffness=1e11", f"analysis.continuation={{{', '.join(curve)}}}")
    assert outcome.exit_status == 0
    shown = outcome.summary["periodic"]["curve"]
    table = json.loads((tmp_path / CURVE_FILE).read_text(encoding="utf-8"))
    points = table["points"]
    assert [table["key"], table["unit"]] == ["contact.damping", "Pa s/m"]
    assert {point["stable"] for point in points} == {True, False}
    between = [point for point in points if not point["event"]]
    changes = sum(one["stable"] != other["stable"] for one, other in pairwise(between))
    named = [event["event"] for event in shown["events"] if event["event"] in ("period doubling", "grazing")]
    assert changes == len(named)
    assert "period doubling" in named
    for point in points:
        assert point["stable"] == (point["largest_multiplier"] < 1.0)
        if point["event"] == "period doubling":
            assert point["multiplier_real"] == pytest.approx(-1.0, abs=0.1)
    with (tmp_path / CURVE_TABLE_FILE).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["value"]) for row in rows] == [point["value"] for point in points]
    names = {path.stem for path in plot(tmp_path)}
    assert "response_curve" in names
    with Image.open(tmp_path / "figures" / "response_curve.png") as picture:
        assert np.asarray(picture.convert("L"), dtype=float).std() > 2.0
    lines = draw_response_curve(table).axes[0].get_lines()
    assert {line.get_linestyle() for line in lines if len(line.get_xdata()) > 1} == {"-", "--"}


@pytest.mark.slow(minutes=0.1)
def test_a_curve_that_does_not_cover_its_range_has_status_5(tmp_path: Path) -> None:
    """Few points do not reach the ends: the gap is named, with what helps; the response itself stands."""
    curve = ["key='load.shaker.amplitude'", "low=1.0", "high=40.0", "max_points=2"]
    outcome = run(tmp_path, "contact.stiffness=1e10", f"analysis.continuation={{{', '.join(curve)}}}")
    assert (outcome.exit_status, outcome.summary["reason"]) == (5, "range not covered")
    assert outcome.summary["status"] == "completed"
    found = outcome.summary["periodic"]["curve"]
    assert found["branches"] > 1
    assert found["missing"]
    assert f"from {found['missing'][0]['low']:.6g} to {found['missing'][0]['high']:.6g} N" in outcome.message
    assert "try more analysis.continuation.max_points" in outcome.message
    table = json.loads((tmp_path / CURVE_FILE).read_text(encoding="utf-8"))
    assert table["missing"] == found["missing"]
    assert {point["branch"] for point in table["points"]} == set(range(1, found["branches"] + 1))
    lines = [line.get_xdata() for line in draw_response_curve(table).axes[0].get_lines()]
    for gap in found["missing"]:
        assert not any(min(x) <= gap["low"] and max(x) >= gap["high"] for x in lines if len(x) > 1)
    page = next(path for path in gapbeam.report(tmp_path) if path.suffix == ".html").read_text(encoding="utf-8")
    assert "No response was followed from" in page


PERIODIC = GOOD + '\n[analysis]\ntype = "periodic"\n'
CURVE = '[analysis.continuation]\nkey = "{}"\nlow = {}\nhigh = {}\n'

REFUSED: dict[str, tuple[str, dict[str, Any], list[str]]] = {
    "two frequencies": (
        PERIODIC.replace("[[probe]]", '[[load]]\ntype = "base_motion"\namplitude = 1.0\nfrequency = 21.0\n\n[[probe]]'),
        {},
        ["[analysis] type", "20 Hz, 21 Hz", "harmonic loads of one frequency"],
    ),
    "friction": (PERIODIC, {"contact.friction.coefficient": 0.2}, ["`overrides=` contact.friction", "no friction"]),
    "restitution": (
        PERIODIC,
        {"contact.law": {"type": "hunt-crossley", "restitution": 0.8}},
        ["contact.law", "speed at touch", "kelvin-voigt"],
    ),
    "multipliers": (
        PERIODIC,
        {"contact.formulation": "augmented-lagrangian", "time.scheme": "implicit-midpoint"},
        ["contact.formulation", "derivative of multipliers"],
    ),
    "scheme": (PERIODIC, {"time.scheme": "newmark"}, ["time.scheme", "newmark", "discrete-gradient"]),
    "adaptive": (PERIODIC, {"time.adaptive": True}, ["time.adaptive", "same steps in every iteration"]),
    "harmonics of a full model": (
        PERIODIC,
        {"analysis.method": "harmonic-balance"},
        ["[model] type", "full, with harmonic balance", "reduced"],
    ),
    "ramp": (PERIODIC, {"load.shaker.ramp": 2.0}, ["[time] end", "within the ramp of 2 s", "end = 4"]),
    "unknown key of a curve": (
        PERIODIC + CURVE.format("load.shake.frequency", 10.0, 30.0),
        {"model.type": "reduced"},
        ["[analysis.continuation] key", "load.shake.frequency", "load.shaker.frequency"],
    ),
    "range without the value": (
        PERIODIC + CURVE.format("load.shaker.frequency", 25.0, 30.0),
        {"model.type": "reduced"},
        ["[analysis.continuation] low", "load.shaker.frequency = 20", "low = 20"],
    ),
    "range that is turned": (
        PERIODIC + CURVE.format("support.clearance", 1e-3, 1e-4),
        {"model.type": "reduced"},
        ["[analysis.continuation] high", "more than low", "swap"],
    ),
    "curve by harmonic balance": (
        PERIODIC + CURVE.format("support.clearance", 1e-4, 1e-3),
        {"model.type": "reduced", "analysis.method": "harmonic-balance"},
        ["analysis.method", "shooting"],
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_contradictions_are_reported(name: str, tmp_path: Path) -> None:
    """Where, found, expected and what to try, before anything is run."""
    text, overrides, words = REFUSED[name]
    (fault,) = faults_of(written(tmp_path, text), overrides)
    assert_says(fault, words)


@cache
def good_loads() -> dict[int, Any]:
    return dict(enumerate(read_case(CASE).load))


def test_keys_of_a_curve() -> None:
    """Every key that a curve may vary is read from its table; others are not known."""
    case = read_case(CASE)
    tables = {"support": case.support, "contact": case.contact}
    known = {
        "support.clearance": 0.107e-3,
        "contact.stiffness": 5e10,
        "contact.damping": 5e6,
        "load.shaker.frequency": 20.0,
        "load.shaker.amplitude": 20.0,
    }
    assert {key: value_of(key, tables, good_loads()) for key in known} == known
    assert value_of("beam.length", tables, good_loads()) is None
    assert value_of("load.gravity.frequency", tables, good_loads()) is None


@pytest.mark.parametrize("method", ["shooting", "harmonic-balance"])
def test_a_search_stops_where_it_is_asked_to(method: str) -> None:
    """A signal or the limit of the wall time ends a search between two iterations, as it ends a march."""
    case = read_case(CASE, [*COARSE, f"analysis.method={method}", "analysis.start=seat"])
    simulation, looks = gapbeam.model(case), list[int]()

    def asked() -> bool:
        looks.append(1)
        return len(looks) > 1

    assert isinstance(case.analysis, Periodic)
    with pytest.raises(Interrupted, match="in the search for a periodic response"):
        find_response(simulation.model, simulation.seat().state, case.analysis, asked, lambda *_: None)
    assert len(looks) == 2
