"""Sweeps: axes, carried states, kicks, the census, going on after a kill, and the command from end to end."""

from __future__ import annotations

import csv
import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.steady_figures import figures_of_record
from gapbeam.postprocess.study_figures.sweep_branches import census, census_words, draw_branches
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.march.stepwise_march import march
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.models.model import Model, model_of
from gapbeam.solver.system.semi_discrete import MASS, VALUE
from gapbeam.studies.sweep.sweep_plan import Chain, Sweep, Task, chains_of, finished, point_file
from gapbeam.studies.sweep.sweep_point import lost_chain, run_chain
from gapbeam.studies.trials.axes import Axis, points_of, read_axis
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import carried, kicked, seated, span
from tests.shared.command import GAPBEAM, PROJECT, alone, called, called_in_turn, process_environment, settings
from tests.shared.models import COARSE, beam_model
from tests.shared.processes import until

CASE = PROJECT / "cases" / "stability.toml"
QUICK = (
    'model={type="beam",elements=24}',
    "time.end=0.1",
    "time.step=5e-4",
    "load.shaker.frequency=50",
    "load.shaker.amplitude=60",
    "damping.ratios=[0.05,0.05]",
)
SHAKER = {"type": "harmonic_force", "name": "shaker", "point": 0.15, "amplitude": 60.0, "frequency": 50.0, "ramp": 0.02}


DAMPED = {"damping": {"frequencies": [40.0, 300.0], "ratios": [0.05, 0.05]}}  # round-off does not grow at impacts


def shaken(clearance: float = 0.107e-3, frequency: float = 50.0, **tables: dict[str, object]) -> Model:
    """Return a beam of few elements under a harmonic force, with more tables in its case."""
    loads = ({"type": "gravity"}, SHAKER | {"frequency": frequency})
    changes = {
        "model": {"type": "beam", "elements": 24},
        "mesh": COARSE,
        "support": {"clearance": clearance},
        "time": {"end": 0.2, "step": 2e-4},
        **tables,
    }
    return beam_model(changes, loads, {"test": 0.37})


def test_axes_are_even_as_asked() -> None:
    """Ranges of a sweep are linear, also through zero, unless they say :log; lists keep what was typed."""
    assert read_axis("support.clearance=0:2e-4:3", "linear").values == ("0", "0.0001", "0.0002")
    assert read_axis("contact.stiffness=1e8:1e12:3:log", "linear").values == ("1e+08", "1e+10", "1e+12")
    assert read_axis("contact.stiffness=1e8:1e12:3:linear").values == ("1e+08", "5.0005e+11", "1e+12")
    with pytest.raises(UserError, match="log or first:last:count:linear"):
        read_axis("time.step=1:2:3:cubic")


@pytest.mark.parametrize("spacing", ["linear", "log"])
@pytest.mark.parametrize("power", [-9, 0, 6])
@pytest.mark.parametrize("width", [1e-2, 1e-5, 1e-8])
def test_values_of_a_narrow_range_stay_apart(spacing: Any, power: int, width: float) -> None:
    """As across the resonance of a resonator: each value is in its place, by less than a hundredth of the spacing."""
    first, last = 3.18309886 * 10.0**power, 3.18309886 * 10.0**power * (1.0 + width)
    values = np.array(read_axis(f"load.drive.frequency={first!r}:{last!r}:21:{spacing}").values, dtype=float)
    exact = np.linspace(first, last, 21) if spacing == "linear" else np.geomspace(first, last, 21)
    assert np.abs(values - exact).max() < 0.01 * (exact[1] - exact[0])


@pytest.mark.parametrize("given", ["1e-4:2e-4", "-1:1", "20:25"])
def test_a_range_without_a_count_is_refused(given: str) -> None:
    """It was taken for a text, and refused as no number."""
    with pytest.raises(UserError, match="without a count; expected first:last:count"):
        read_axis(f"support.clearance={given}")


def test_points_are_a_grid_or_side_by_side() -> None:
    """The last key varies fastest; lists side by side must be of one length, and a key is given once."""
    axes = [Axis("a", ("1", "2")), Axis("b", ("3", "4"))]
    assert points_of(axes) == [("1", "3"), ("1", "4"), ("2", "3"), ("2", "4")]
    assert points_of(axes, zipped=True) == [("1", "3"), ("2", "4")]
    with pytest.raises(UserError, match="a has 2, c has 1"):
        points_of([axes[0], Axis("c", ("5",))], zipped=True)
    with pytest.raises(UserError, match="given twice"):
        points_of([axes[0], axes[0]])


def test_a_response_from_a_carried_start_is_the_march_going_on() -> None:
    """The same model, carried at a whole number of periods: the same motion as without stopping, but for round-off.

    With little damping the round-off of the gaps, which are formed anew, grows by ten orders in the five periods.
    """
    model = shaken(**DAMPED)
    first = respond(model, seated(model).state, 500, model.step)
    assert first.end is not None
    begin = carried(model, model.case.load, first.end, model.case.load)
    second = respond(model, begin.state, 500, model.step)
    whole = respond(model, seated(model).state, 1000, model.step)
    assert begin.state.time == pytest.approx(0.1)
    assert begin.notes == ()
    for name in ("displacement", "acceleration_absolute"):
        later = whole.history[name][501:]
        np.testing.assert_allclose(second.history[name][1:], later, rtol=0.0, atol=1e-8 * np.ptp(later))
    pressed = whole.history["active_points"][501:] > 0
    assert (np.abs(np.diff(pressed.astype(int), axis=0)).sum(axis=0) >= 2).all()  # both faces open and close


def test_a_carried_start_keeps_the_phase_of_another_frequency() -> None:
    """50 Hz for 5 periods and a quarter, then 25 Hz: the force continues from a quarter, after the ramp."""
    before, after = shaken(), shaken(frequency=25.0)
    end = respond(before, seated(before).state, 525).end
    assert end is not None
    begin = carried(after, after.case.load, end, before.case.load)
    assert (begin.state.time * 25.0) % 1.0 == pytest.approx(0.25, abs=1e-9)
    assert begin.notes == ()
    assert begin.state.time >= SHAKER["ramp"]
    force = next(load for load in after.system.loads if load.name == "shaker")
    assert force.factor(begin.state.time) == pytest.approx(60.0, rel=1e-4)
    slow = shaken(frequency=40.0)
    uneven = carried(slow, slow.case.load, end, before.case.load)  # a quarter of 25 ms is no whole number of steps
    assert "jumps by 0.002 of a period" in uneven.notes[0]


def test_a_smaller_clearance_moves_the_beam_clear_of_the_gland() -> None:
    """No point is deeper than it was, and the energy of the contact does not grow; the velocity is kept."""
    before = shaken(clearance=0.2e-3)
    plan = replace(march_of_model(before, before.case.time.scheme), steps=600)
    deepest, end = 0.0, None
    for step in march(plan, seated(before).state):  # the moment at which the beam is highest in the support
        contact = before.system.contact
        here = float(step.new.depth[contact.faces == 1].max() + 0.2e-3)
        if here > deepest:
            deepest, end = here, step.new
    assert end is not None
    case = before.case.model_copy(update={"support": before.case.support.model_copy(update={"clearance": 0.05e-3})})
    model = model_of(case, before.body)
    naive = model.system.contact.depth(model.system.contact.interface.trace(end.u[VALUE], model.system.operators))
    assert naive.max() > 1e-5  # without being moved it would be deep in the gland
    begin = carried(model, model.case.load, end, before.case.load)
    assert begin.state.depth.max() <= max(float(end.depth.max()), 0.0) + 1e-9
    assert "rigid body" in begin.notes[0]
    np.testing.assert_array_equal(begin.state.v[VALUE], end.v[VALUE])
    elastic = [float(x.u[VALUE] @ model.system.operators.apply_stiffness(x.u[VALUE])) for x in (end, begin.state)]
    assert elastic[1] == pytest.approx(elastic[0], rel=0.05, abs=1e-6)


def test_kicks_are_reproducible_and_differ() -> None:
    """The same seed and number give the same start; another one gives another velocity and phase."""
    model = shaken()
    one, again, other = (
        kicked(model, model.case.load, 1, 7),
        kicked(model, model.case.load, 1, 7),
        kicked(model, model.case.load, 2, 7),
    )
    np.testing.assert_array_equal(one.state.v, again.state.v)
    assert one.state.time == again.state.time
    assert not np.allclose(one.state.v[VALUE], other.state.v[VALUE])
    for start in (one, other):
        assert SHAKER["ramp"] - 1e-12 <= start.state.time < SHAKER["ramp"] + 1.0 / 50.0
        assert start.state.v[VALUE] @ start.state.v[MASS] > 0.0


def record(word: str, amplitude: float, scatter: float = 0.0, verdict: str = "passed", start: str = "seat") -> dict:
    """Return a record of a sweep."""
    figure = {"unit": "m", "mean": amplitude, "scatter": scatter}
    return {
        "values": {"support.clearance": "1e-4"},
        "direction": "up",
        "start": start,
        "verdict": verdict,
        "message": "",
        "response": word,
        "figures": {"tip peak-to-peak displacement": figure} if verdict == "passed" else None,
        "notes": [],
    }


def test_the_census_reports_responses_apart(tmp_path: Path) -> None:
    """By cycle and amplitude, a scatter allowed for, what creeps counted with what it creeps to, failures apart."""
    records = [
        record("period 1", 1.00e-3),
        record("not settled", 1.01e-3, start="kick 1"),
        record("period 3", 1.00e-3),
        record("period 1", 2.00e-3),
        record("no cycle", 3.0e-3, 0.2e-3),
        record("no cycle", 3.3e-3, 0.2e-3),
        record("", 0.0, verdict="energy created"),
    ]
    (point,) = census(records, 0.02)
    assert [(branch.word, branch.count) for branch in point.branches] == [
        ("period 1", 2),
        ("no cycle", 2),
        ("period 3", 1),
        ("period 1", 1),
    ]
    assert point.branches[0].reached_from == ["seat up", "kick 1 up"]
    mean, scatter, unit = point.branches[1].figures["tip peak-to-peak displacement"]
    assert (mean, unit) == (pytest.approx(3.15e-3), "m")
    assert scatter == pytest.approx(np.hypot(0.2e-3, 0.15e-3))
    assert len(point.failures) == 1
    clean = draw_branches(census(records[:-1], 0.02), tmp_path / "clean.png").read_bytes()
    assert draw_branches([point], tmp_path / "failed.png").read_bytes() != clean


def test_what_has_not_settled_is_no_further_response() -> None:
    """Responses coexist where two that have settled differ: not by ringing, one window, or the rest of a transient."""
    ringing = [record("not settled", 1.0e-3), record("not settled", 3.0e-3, start="kick 1")]
    wild = [record("no cycle", 1.0e-3) | {"windows": 1}, record("no cycle", 3.0e-3) | {"windows": 1}]
    fading = [record("period 1", 1.0e-3), record("period 1", 1.1e-3, start="kick 1")]
    fading[1]["figures"]["tip peak-to-peak displacement"]["unsettled"] = 0.1e-3
    for records in (ringing, wild, fading):
        points = census(records, 0.02)
        assert points[0].coexisting <= 1
        assert census_words(points)[0] == "several responses at 0 of 1 point"
    assert "no steady state yet in 2 responses" in census_words(census(ringing, 0.02))[1]
    nearly = [record("period 1", 1.0e-3), record("no cycle", 1.0e-3) | {"windows": 4, "repeats_within": 0.012}]
    assert census(nearly, 0.02)[0].coexisting == 1
    points = census([record("period 1", 1.0e-3), record("period 3", 1.0e-3), *ringing[1:]], 0.02)
    assert (points[0].coexisting, points[0].unsettled) == (2, 1)


@pytest.mark.parametrize("ratio", [3e-4, 0.0])
def test_a_linear_beam_has_one_response(ratio: float, tmp_path: Path) -> None:
    """A beam pressed into its seat stays in contact and is linear: kicked or not, with damping or without.

    What still rings after 42 periods has not settled; it is no response of its own.
    """
    changes = (
        *QUICK[:1],
        "support.clearance=-6e-6",
        "load.shaker.amplitude=0.05",
        f"damping.ratios=[{ratio},{ratio}]",
        "time.end=0.84",
        "time.step=2e-4",
        "load.shaker.frequency=50",
    )
    sweep = Sweep(CASE, changes, (Axis("support.clearance", ("-6e-6",)),), starts=3)
    (tmp_path / "points").mkdir()
    tasks = [task for chain in chains_of(sweep, tmp_path) for task in chain.tasks]
    assert len(tasks) == 3
    assert run_chain(Chain(sweep, tmp_path, tuple(tasks))) == 3
    records = [json.loads(point_file(tmp_path, task).read_text(encoding="utf-8")) for task in tasks]
    assert {one["verdict"] for one in records} == {"passed"}
    assert {one["response"] for one in records} <= {"period 1", "not settled"}
    points = census(records, sweep.tolerance)
    assert points[0].coexisting <= 1
    assert points[0].unsettled >= 2


def test_spans_are_whole_periods() -> None:
    """0.2 s at 40 Hz are 8 periods; at 47 Hz 9, to the nearest step."""
    assert span(shaken(frequency=40.0))[0] == 1000
    model = shaken(frequency=47.0)
    assert span(model)[0] == round(9 / 47.0 / 2e-4)


POINTS = 8  # of a chain: far more than a process computes between two looks at the first one


@pytest.mark.slow(minutes=0.3)
@alone
def test_a_killed_sweep_goes_on_to_the_same_figures(tmp_path: Path) -> None:
    """Killed between two points of a carried chain, and called again: as if it had never been killed."""
    words = [
        "sweep",
        CASE,
        f"support.clearance=0.05e-3:0.2e-3:{POINTS}",
        "--carry",
        *settings(*QUICK),
        "--workers",
        "1",
    ]
    gently = ["nice", "-n", "19"]  # so that it waits for whoever looks, not the other way round
    command = [*gently, *GAPBEAM, *map(str, words), "--output", str(tmp_path / "killed")]
    process = subprocess.Popen(
        command, cwd=PROJECT, env=process_environment(), start_new_session=True, stdout=subprocess.DEVNULL
    )
    first = tmp_path / "killed" / "points" / "000000.json"
    until(lambda: first.exists() or process.poll() is not None, "the first point is there")
    workers = _children(process.pid)
    process.kill()
    process.wait()
    until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers), "no worker outlives its sweep")
    assert first.exists()
    on_disk = len(list(first.parent.glob("*.json")))
    again, whole = called_in_turn([*words, "--output", tmp_path / "killed"], [*words, "--output", tmp_path / "whole"])
    assert (again.returncode, whole.returncode) == (0, 0), again.stderr + whole.stderr
    assert on_disk < POINTS, "killed too late to test anything"
    one, other = (json.loads((tmp_path / name / "sweep.json").read_text()) for name in ("killed", "whole"))
    assert [entry["start"] for entry in one] == ["seat", *["carried"] * (POINTS - 1)]
    for mine, theirs in zip(one, other, strict=True):
        for name, figure in mine["figures"].items():
            assert figure["mean"] == pytest.approx(theirs["figures"][name]["mean"], rel=1e-9, abs=1e-12), name


def _children(parent: int) -> list[int]:
    """Return the processes that a process has started."""
    listed = Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="ascii")
    return [int(word) for word in listed.split()]


@pytest.mark.slow(minutes=0.3)
@alone
def test_the_command_from_end_to_end(tmp_path: Path) -> None:
    """Both directions, two starts, one value that fails: table, figure and status report; what changed is refused."""
    base = ["sweep", CASE, *settings(*QUICK), "--workers", "1"]
    wanted = [*base, "support.clearance=0.05e-3,0.1e-3", "--both", "--starts", "2", "--output", tmp_path / "a"]
    failing = [*base, "time.max_iterations=60,1", "--set", "time.max_halvings=0", "--output", tmp_path / "b"]
    done, again, changed, options, bad, along, orbit, failed = called_in_turn(
        wanted,
        wanted,
        [*wanted, "--set", "support.length=0.04"],
        [*wanted, "--seed", "3"],
        [*base, "support.clearence=1e-4", "--output", tmp_path / "c"],
        [*base, "beam.thickness=0.01,0.012", "--carry", "--output", tmp_path / "c"],
        [*base, "support.clearance=1e-4", "--set", 'analysis.type="periodic"', "--output", tmp_path / "c"],
        failing,
    )
    assert done.returncode == again.returncode == 0, done.stderr
    assert "8 of 8 responses passed" in done.stdout
    assert "8 of 8 responses are on disk already" in again.stderr
    with (tmp_path / "a" / "sweep.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["direction"], row["start"]) for row in rows[:4]] == [
        ("up", "seat"), ("up", "carried"), ("up", "kick 1"), ("up", "carried"),
    ]  # fmt: skip
    assert [row["support.clearance"] for row in rows[4:6]] == ["0.1e-3", "0.05e-3"]
    assert float(rows[0]["test peak-to-peak smoothed acceleration (g)"]) > 0.0
    text = json.loads((tmp_path / "a" / "census.json").read_text(encoding="utf-8"))
    assert sum(entry["reached"] for point in text for entry in point["responses"]) == 8
    with Image.open(tmp_path / "a" / "sweep.png") as picture:
        assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 50
    assert changed.returncode == options.returncode == bad.returncode == along.returncode == 2
    assert "support.length: 0.05 there, 0.04 now" in changed.stderr
    assert "--seed: 0 there, 3 now" in options.stderr
    assert "did you mean `clearance`" in bad.stderr
    assert "beam.thickness changes along beam.thickness" in along.stderr
    assert orbit.returncode == 2
    assert 'expected "transient"' in orbit.stderr
    assert failed.returncode == 4
    assert "time.max_iterations = 1: not converged" in failed.stdout
    assert not (tmp_path / "c").exists()


def test_chains_do_not_depend_on_what_is_done(tmp_path: Path) -> None:
    """A chain whose files are there is not computed again; without carry every response is a chain of its own."""
    sweep = Sweep(CASE, QUICK, (Axis("support.clearance", ("1e-4",)), Axis("load.shaker.amplitude", ("5", "6"))))
    chains = chains_of(sweep, tmp_path)
    assert [[task.values for task in chain.tasks] for chain in chains] == [[("1e-4", "5")], [("1e-4", "6")]]
    (tmp_path / "points").mkdir()
    assert run_chain(chains[0]) == 1
    assert run_chain(chains[0]) == 0
    carried_chain = chains_of(replace(sweep, carry=True, both=True), tmp_path)
    assert [[task.values[1] for task in chain.tasks] for chain in carried_chain] == [["5", "6"], ["6", "5"]]


def test_a_response_whose_workers_were_lost_fails_and_is_tried_again(tmp_path: Path) -> None:
    """It is among the failures with status 7, with what happened, but not on disk: the next call computes it."""
    sweep = Sweep(CASE, QUICK, (Axis("load.shaker.amplitude", ("5", "6")),))
    first, second = chains_of(sweep, tmp_path)
    (tmp_path / "points").mkdir()
    assert run_chain(first) == 1
    assert lost_chain(first, "") == {}
    lost = lost_chain(second, "3 workers were lost")
    assert (lost[1]["verdict"], lost[1]["exit_status"], lost[1]["values"]) == (
        "lost",
        7,
        {"load.shaker.amplitude": "6"},
    )
    assert "3 workers were lost" in lost[1]["message"]
    records = [*finished(tmp_path).values(), *lost.values()]
    assert [len(point.failures) for point in census(records, 0.02)] == [0, 1]
    assert run_chain(second) == 1


@pytest.mark.slow(minutes=0.1)
def test_a_case_with_faults_everywhere_is_reported() -> None:
    """The faults of the case file itself come first."""
    done = called("sweep", CASE, "time.step=-1,-2")
    assert done.returncode == CaseError.exit_status
    assert "time.step" in done.stderr


def test_records_of_loads_have_the_peaks_of_a_run(tmp_path: Path) -> None:
    """Without a period figures are peaks over the record: those that the history of a run of the point shows."""
    wanted = ("model.elements=12", "time.end=0.02", "load.base.start=0.3", "load.base.scale=20")
    case = PROJECT / "cases" / "recorded.toml"
    outcome = gapbeam.run(case, list(wanted), output=tmp_path / "run")
    assert outcome.exit_status == 0
    history = open_results(tmp_path / "run").history
    task = Task(0, ("20",), "", 0)
    sweep = Sweep(case, wanted[:3], (read_axis("load.base.scale=20", "linear", ""),))
    (tmp_path / "points").mkdir()
    assert run_chain(Chain(sweep, tmp_path, (task,))) == 1
    text = json.loads(point_file(tmp_path, task).read_text(encoding="utf-8"))
    assert (text["response"], text["windows"], text["verdict"]) == ("no period", 1, "passed")
    figures = {name: figure["mean"] for name, figure in text["figures"].items()}
    tip = history.sel(probe="tip")
    assert figures["tip peak-to-peak displacement"] == pytest.approx(
        float(np.ptp(tip["displacement"].values[:, -1])), rel=1e-9
    )
    accelerations = tip["acceleration_absolute"].values[1:, -1]  # means over the intervals
    assert figures["tip peak-to-peak acceleration"] == pytest.approx(float(np.ptp(accelerations)), rel=1e-9)
    for face in ("base", "gland"):
        force, impulse = (history[name].sel(face=face).values for name in ("contact_force", "impulse"))
        assert figures[f"{face} largest recorded force"] == pytest.approx(float(force.max()), rel=1e-9)
        assert figures[f"{face} whole impulse"] == pytest.approx(float(impulse[-1] - impulse[0]), rel=1e-9)
    whole, late = (figures_of_record(history, after=start)[0] for start in (0.0, 0.01))
    assert whole["tip peak-to-peak displacement"].mean == pytest.approx(
        figures["tip peak-to-peak displacement"], rel=1e-9
    )
    after = history["contact_force"].sel(face="base", time=slice(0.01, None))
    assert late["base largest recorded force"].mean == float(after.max())
    assert late["tip peak-to-peak displacement"].mean <= whole["tip peak-to-peak displacement"].mean
    with pytest.raises(SignalError, match="ends before the transient does"):
        figures_of_record(history, after=1.0)


def test_responses_are_watched_as_runs_are(tmp_path: Path) -> None:
    """A force of 2 MN turns the beam beyond all sense: status 4; a yield stress that is passed is a note."""
    changes = (*QUICK, "time.end=0.04", "material.yield_stress=1e4")
    sweep = Sweep(CASE, changes, (Axis("load.shaker.amplitude", ("60", "2e6")),))
    (tmp_path / "points").mkdir()
    tasks = [task for chain in chains_of(sweep, tmp_path) for task in chain.tasks]
    assert run_chain(Chain(sweep, tmp_path, tuple(tasks))) == 2
    usual, absurd = (json.loads(point_file(tmp_path, task).read_text(encoding="utf-8")) for task in tasks)
    assert (absurd["verdict"], absurd["exit_status"]) == ("assumption broken", 4)
    assert "small rotation: largest rotation" in absurd["message"]
    assert absurd["figures"]  # up to where it came
    assert census([absurd], 0.02)[0].failures == (absurd,)
    assert (usual["verdict"], usual["exit_status"]) == ("passed", 0)
    verdicts = {one["name"]: one["verdict"] for one in usual["assumptions"]}
    assert verdicts["small rotation"] == "holds"
    passed = {name for name, verdict in verdicts.items() if verdict == "warning"}
    assert passed, verdicts
    assert {note.partition(":")[0] for note in usual["notes"]} >= passed
