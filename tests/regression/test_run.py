"""A run from the command line: what it leaves behind, what it reports, and how it is stopped."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from meshio.xdmf import TimeSeriesReader

import gapbeam
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.schema.record_table import FIELDS, HISTORY
from tests.shared.command import (
    DEMO,
    GAPBEAM,
    PROJECT,
    RATTLE,
    alone,
    called,
    called_in_turn,
    process_environment,
    programmed,
    ranks,
    settings,
)
from tests.shared.processes import LONGEST, until

pytestmark = alone

FILES = {"case.toml", "fields.h5", "fields.xdmf", "history.h5", "impacts.csv", "run.log", "summary.json"}
STEP, END, FIELDS_INTERVAL = 1e-4, 0.02, 2.5e-3
CORNER = [0.51, 0.006, 0.0]  # of the tip: fields have its displacement, but not the mean of the section
SHORT = (
    *RATTLE,
    f"time.end={END}",
    f"output.fields_interval={FIELDS_INTERVAL}",
    f"probe.tip.point={CORNER[:2]}",
)
BRIEF = (*RATTLE, "time.end=1e-3", "output.fields_interval=5e-4")
LONG = ("time.end=600.0", "output.fields_interval=1e-2")


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> subprocess.CompletedProcess[str]:
    """A short run in which the beam leaves and strikes both faces."""
    folder = tmp_path_factory.mktemp("run") / "missing" / "parent" / "out"
    return called("run", DEMO, *settings(*SHORT), "--output", folder)


@pytest.fixture(scope="module")
def folder(done: subprocess.CompletedProcess[str]) -> Path:
    assert done.returncode == 0, done.stderr
    return Path(done.stdout.splitlines()[-1].removeprefix("results: "))


@pytest.fixture(scope="module")
def summary(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def history(folder: Path) -> xr.Dataset:
    with xr.open_dataset(folder / "history.h5", engine="h5netcdf") as stored:
        return stored.load()


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file of a folder."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def lookup(summary: dict[str, Any], key: str) -> Any:
    """Return a value of the summary by its dotted key."""
    for part in key.split("."):
        summary = summary[part]
    return summary


def test_folder_holds_the_documented_files(folder: Path) -> None:
    """A folder below missing parents is made, with the six files and nothing left of writing them."""
    assert {path.name for path in folder.iterdir()} == FILES
    assert all(path.stat().st_size > 0 for path in folder.iterdir())


def test_terminal_gets_two_lines_and_a_log(done: subprocess.CompletedProcess[str], folder: Path) -> None:
    """Standard output reports only the outcome and the folder; the rest is on standard error, details in run.log."""
    outcome, place = done.stdout.splitlines()
    assert outcome.startswith("done: 200 steps, energy ")
    assert place == f"results: {folder}"
    log = (folder / "run.log").read_text(encoding="utf-8")
    for shown in ("chosen: contact.stiffness", "at rest the beam presses on base"):
        assert shown in done.stderr
        assert shown in log
    for detail in ("770 DOFs", "5 E/h", "meshed: ", "seated in", "assumptions hold", "largest contact force"):
        assert detail not in done.stderr, "for analysts"
        assert detail in log


def test_progress_is_reported_on_standard_error(tmp_path: Path) -> None:
    """Plain lines where there is no terminal: time or period, speed, faces in contact; none on standard output."""
    done = programmed("tests.programs.talkative_progress", "run", DEMO, *settings(*BRIEF), "--output", tmp_path / "out")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 2
    lines = [line for line in done.stderr.splitlines() if "steps/s" in line]
    assert len(lines) == 9  # ten steps; speed and time left count from the first on
    assert all("contact: base" in line and "s left" in line for line in lines[:2])
    assert "\x1b" not in done.stderr + done.stdout


SUMMARY_KEYS = {
    "title": str,
    "status": str,
    "message": str,
    "warnings": list,
    "versions.gapbeam": str,
    "versions.dolfinx": str,
    "versions.petsc4py": str,
    "versions.numpy": str,
    "versions.mpi": str,
    "forcing.frequency": float,
    "forcing.period": float,
    "model.cells": int,
    "model.dofs": int,
    "model.contact_points": int,
    "model.ranks": int,
    "seat.base_force": float,
    "seat.gland_force": float,
    "seat.iterations": int,
    "seat.largest_penetration": float,
    "seat.probes.tip": list,
    "energy.kinetic": float,
    "energy.strain": float,
    "energy.contact": float,
    "energy.load_work": list,
    "energy.structural_dissipation": float,
    "energy.contact_dissipation": float,
    "energy.algorithmic_dissipation": float,
    "energy.residual": float,
    "energy.relative_residual": float,
    "gates.impacts": int,
    "gates.violations": int,
    "gates.largest_growth": float,
    "gates.largest_loss": float,
    "gates.limits.total_growth": float,
    "convergence.steps": int,
    "convergence.parts_of_halved_steps": int,
    "convergence.halvings_not_converged": int,
    "convergence.halvings_adaptive": int,
    "convergence.unresolved_steps": int,
    "convergence.shortest_step": float,
    "convergence.iterations_mean": float,
    "convergence.iterations_max": int,
    "wall_time.mesh": float,
    "wall_time.seat": float,
    "wall_time.march": float,
    "wall_time.per_step": float,
    "wall_time.back_substitution": float,
    "wall_time.total": float,
    "memory.peak_per_rank": list,
    "penetration.largest": float,
    "penetration.relative_to_clearance": float,
    "peak_contact_force.base": float,
    "peak_contact_force.gland": float,
    "restraint.share_of_energy": float,
    "format": int,
}


@pytest.mark.parametrize(("key", "kind"), SUMMARY_KEYS.items())
def test_summary_reports(summary: dict[str, Any], key: str, kind: type) -> None:
    """summary.json holds the figure, as a number where it is one."""
    assert isinstance(lookup(summary, key), kind)


def test_summary_is_consistent(summary: dict[str, Any], history: xr.Dataset) -> None:
    """Figures of the summary against one another, against the case and against the history."""
    assert (summary["status"], summary["exit_status"]) == ("completed", 0)
    assert summary["forcing"] == {"frequency": 100.0, "period": 0.01}
    assert summary["convergence"]["steps"] == 200
    assert summary["model"]["dofs"] == 770
    assert summary["memory"]["peak_per_rank"][0] > 5e7
    assert abs(summary["energy"]["relative_residual"]) < 1e-6
    wall = summary["wall_time"]
    assert 0.0 < wall["back_substitution"] < wall["per_step"]
    assert wall["per_step"] == pytest.approx(wall["march"] / 200)
    assert wall["mesh"] + wall["seat"] + wall["march"] < wall["total"]
    penetration = summary["penetration"]
    assert penetration["relative_to_clearance"] == pytest.approx(penetration["largest"] / 0.107e-3)
    assert penetration["largest"] == pytest.approx(history["penetration"].values[1:].max(), rel=1e-12)
    assert summary["energy"]["kinetic"] == history["kinetic_energy"].values[-1]
    assert summary["energy"]["load_work"] == history["load_work"].values[-1].tolist()
    for default in summary["defaults"]:
        assert default["reason"]
        assert default["value"] > 0.0
    assert "contact.stiffness" in [default["key"] for default in summary["defaults"]]


def test_history_is_labeled(history: xr.Dataset) -> None:
    """Opened by xarray, every variable has its unit, meaning and dimensions, and names along its axes.

    Without friction there is nothing along the faces.
    """
    assert "friction_force" not in history
    for record in HISTORY:
        seldom = {
            "tangent",
            "gauge",
            "across",
            "moving",
            "joint",
            "support_body",
            "worn_face",
            "slip_mode",
            "moved_probe",
            "turned_probe",
        }
        if seldom & set(record.dims):
            continue
        assert history[record.name].attrs["units"] == record.unit
        assert history[record.name].attrs["long_name"] == record.meaning
        assert history[record.name].dims == record.dims
        assert np.isfinite(history[record.name]).all(), record.name
    assert history["time"].attrs["units"] == "s"
    assert {name: history[name].values.tolist() for name in ("probe", "component", "face", "load")} == {
        "probe": ["test", "tip"],
        "component": ["x", "y"],
        "face": ["base", "gland"],
        "load": ["gravity", "shaker"],
    }


def test_history_has_every_step(history: xr.Dataset) -> None:
    """Without another interval, a record at the start and after every step, on the whole multiples of the step."""
    np.testing.assert_array_equal(history["time"].values, STEP * np.arange(201))


def test_motion_is_its_own_derivative(history: xr.Dataset) -> None:
    """Midpoint rule: mean velocities give the displacement, and velocities the mean accelerations."""
    place, speed = history["displacement"].values, history["velocity"].values
    np.testing.assert_allclose(np.diff(place, axis=0), 0.5 * STEP * (speed[1:] + speed[:-1]), rtol=0.0, atol=1e-13)
    mean = history["acceleration_relative"].values[1:]
    np.testing.assert_allclose(np.diff(speed, axis=0) / STEP, mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(history["acceleration_absolute"], history["acceleration_relative"])


def test_contact_resultants_are_consistent(history: xr.Dataset) -> None:
    """Impulse is the integral of the force; the force acts within the support; the area is part of the face."""
    force, area = history["contact_force"].values, history["contact_area"].values
    impulse, moment = history["impulse"].values, history["contact_moment"].values
    assert (force >= 0.0).all()
    assert (force.max(axis=0) > 100.0).all()
    assert (impulse[0] == 0.0).all()
    assert (np.diff(impulse, axis=0) >= 0.0).all()
    np.testing.assert_allclose(np.diff(impulse, axis=0), STEP * force[1:], rtol=1e-9, atol=1e-9)
    closed = force > 0.0
    assert (closed.any(axis=0) & ~closed.all(axis=0)).all()
    center = moment[closed] / force[closed]
    assert (center >= 0.0).all()
    assert (center <= 0.05).all()
    assert (area[closed] > 0.0).all()
    assert (area <= 0.05 * 0.02 * (1.0 + 1e-12)).all()
    assert ((history["active_points"].values > 0.0) == closed).all()


def test_fields_are_a_time_series(folder: Path, history: xr.Dataset) -> None:
    """Read by meshio, fields.xdmf has the asked cadence and the displacement of a probe in a corner of the tip."""
    with TimeSeriesReader(folder / "fields.xdmf") as reader:
        points, cells = reader.read_points_cells()
        frames = [reader.read_data(number) for number in range(reader.num_steps)]
    np.testing.assert_allclose([frame[0] for frame in frames], FIELDS_INTERVAL * np.arange(9), rtol=0.0, atol=1e-12)
    assert [block.type for block in cells] == ["quad"]
    tip = int(np.argmin(np.linalg.norm(points - CORNER, axis=1)))
    np.testing.assert_allclose(points[tip], CORNER, atol=1e-12)
    recorded = history["displacement"].sel(probe="tip")
    for moment, data, _ in frames:
        assert set(data) == set(FIELDS)
        assert (data["contact_pressure"] >= 0.0).all()
        row = recorded.sel(time=moment, method="nearest").values
        np.testing.assert_allclose(data["displacement"][tip, :2], row, rtol=1e-9, atol=1e-15)
    off_the_support = points[:, 0] > 0.06
    assert all((data["contact_pressure"][off_the_support] == 0.0).all() for _, data, _ in frames)


def test_case_as_run_runs_again_to_the_same_bits(folder: Path, tmp_path: Path) -> None:
    """case.toml reads as the case that was run, and gives bitwise the same history and fields."""
    again = folder / "case.toml"
    assert read_case(again) == read_case(DEMO, SHORT)
    assert read_case(again) != read_case(DEMO)
    gapbeam.run(again, output=tmp_path / "again")
    first, second = (gapbeam.open_results(place).history for place in (folder, tmp_path / "again"))
    xr.testing.assert_identical(first, second)
    with gapbeam.open_results(folder).fields() as one, gapbeam.open_results(tmp_path / "again").fields() as other:
        for frame, other_frame in zip(one, other, strict=True):
            np.testing.assert_array_equal(frame.displacement, other_frame.displacement)
            np.testing.assert_array_equal(frame.contact_pressure, other_frame.contact_pressure)


def test_intervals_of_history_and_fields(tmp_path: Path) -> None:
    """Records every third step and fields every seventh, and both at the end that is no multiple of either."""
    changed = {"time.end": 2e-3, "output.history_interval": 3e-4, "output.fields_interval": 7e-4}
    gapbeam.run(DEMO, changed, tmp_path / "out")
    results = gapbeam.open_results(tmp_path / "out")
    np.testing.assert_allclose(results.history["time"], STEP * np.array([0, 3, 6, 9, 12, 15, 18, 20]), atol=1e-15)
    with results.fields() as fields:
        np.testing.assert_allclose([frame.time for frame in fields], STEP * np.array([0, 7, 14, 20]), atol=1e-15)


def test_python_call_equals_the_command(tmp_path: Path) -> None:
    """gapbeam.run with a mapping of overrides and --set give the same outcome and the same bits."""
    outcome = gapbeam.run(DEMO, {"load.shaker.amplitude": 500.0, "time.end": 2.5e-3}, tmp_path / "python")
    assert (outcome.exit_status, outcome.folder) == (0, tmp_path / "python")
    assert outcome.summary["convergence"]["steps"] == 25
    words = settings("load.shaker.amplitude=500.0", "time.end=2.5e-3")
    assert called("run", DEMO, *words, "--output", tmp_path / "command").returncode == 0
    first, second = (gapbeam.open_results(tmp_path / name).history for name in ("python", "command"))
    xr.testing.assert_identical(first, second)
    assert gapbeam.open_results(tmp_path / "python").status == "completed"


def test_override_changes_the_result(tmp_path: Path) -> None:
    """A larger clearance from an override: the beam hangs deeper at the tip, and case.toml says why."""
    tips = []
    for number, clearance in enumerate((0.107e-3, 0.214e-3)):
        gapbeam.run(DEMO, {"time.end": 2.5e-3, "support.clearance": clearance}, tmp_path / str(number))
        results = gapbeam.open_results(tmp_path / str(number))
        assert results.case["support"]["clearance"] == clearance
        tips.append(results.history["displacement"].sel(probe="tip", component="y").values[0])
    # The beam turns through the gap over the support: by lever over length more at the tip.
    assert tips[1] - tips[0] == pytest.approx(-0.107e-3 * 0.51 / 0.05, rel=0.1)


def test_second_run_is_refused(folder: Path) -> None:
    """Exit status 2, the way out is named, and every byte of the first run is as it was."""
    before = contents(folder)
    done = called("run", DEMO, *settings(*BRIEF), "--output", folder)
    assert done.returncode == 2
    assert "already holds results" in done.stderr
    assert "--overwrite" in done.stderr
    assert "Traceback" not in done.stderr
    assert contents(folder) == before


def test_overwrite_replaces_only_what_a_run_writes(tmp_path: Path) -> None:
    """--overwrite gives the new results, and a note and figures that lie beside them stay."""
    gapbeam.run(DEMO, BRIEF, tmp_path)
    (tmp_path / "note.txt").write_text("mine", encoding="utf-8")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "old.png").write_bytes(b"png")
    done = called("run", DEMO, *settings(*BRIEF, "time.end=2e-3"), "--output", tmp_path, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in tmp_path.iterdir()} == FILES | {"note.txt", "figures"}
    assert (tmp_path / "note.txt").read_text(encoding="utf-8") == "mine"
    assert (tmp_path / "figures" / "old.png").read_bytes() == b"png"
    assert gapbeam.open_results(tmp_path).history.sizes["time"] == 21


def test_faulty_case_leaves_the_results_before_it(tmp_path: Path) -> None:
    """--overwrite with a probe outside the beam: exit status 2 and the earlier results are as they were."""
    gapbeam.run(DEMO, BRIEF, tmp_path)
    before = contents(tmp_path)
    done = called("run", DEMO, *settings(*BRIEF, "probe.tip.point=0.6"), "--output", tmp_path, "--overwrite")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert contents(tmp_path) == before


def test_output_that_is_a_file_is_refused(tmp_path: Path) -> None:
    """A file as the results folder, or above it: exit status 2, named, and the file is as it was."""
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="utf-8")
    calls = (("run", DEMO, *settings(*BRIEF), "--output", output) for output in (taken, taken / "out"))
    for done in called_in_turn(*calls):
        assert done.returncode == 2
        assert f"{taken} is a file, not a folder" in done.stderr
        assert "Traceback" not in done.stderr
    assert taken.read_text(encoding="utf-8") == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_output_that_is_read_only_is_refused(tmp_path: Path) -> None:
    """A read-only folder: exit status 2 and the permission named, before anything is computed."""
    tmp_path.chmod(0o500)
    done = called("run", DEMO, *settings(*BRIEF), "--output", tmp_path / "out")
    tmp_path.chmod(0o700)
    assert done.returncode == 2
    assert "cannot be written" in done.stderr


def test_check_reports_what_a_run_will_be(tmp_path: Path) -> None:
    """What gapbeam check prints: the stiffness and its reason, DOFs, steps and the cost; no results folder is made."""
    done = subprocess.run(
        [*GAPBEAM, "check", DEMO],
        cwd=tmp_path,
        env={**process_environment(), "PYTHONPATH": f"{PROJECT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    rows = {line.split("  ")[0]: line for line in done.stdout.splitlines()}
    assert "2.1e+14 Pa/m" in rows["contact.stiffness"]  # 5 E/h, h = 5 mm
    assert "5 E/h: much stiffer than the beam" in rows["contact.stiffness"]
    assert "770" in rows["degrees of freedom"]
    assert "6000" in rows["steps"]
    assert "ms" in rows["back-substitution"]
    assert " s " in rows["march"]
    assert "predicted" in rows["march"]
    assert "GB" in rows["memory"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow(minutes=0.3)
def test_check_warns_of_a_restraint_that_is_not_weak() -> None:
    """A restraint of 1e8 N/m puts the rigid beam at 1.6 kHz, above the 20 Hz of the shaker; the default does not."""
    stiff, weak = called_in_turn(["check", DEMO, *settings("restraint.axial=1e8")], ["check", DEMO])
    assert "warning: restraint.axial" in stiff.stdout
    assert "restraint.axial gives" not in weak.stdout


def test_schema_accepts_the_cases() -> None:
    """The JSON schema that is printed: every shipped case fulfills it, one with an unknown key does not."""
    validation = pytest.importorskip("jsonschema")
    printed = json.loads(called("schema").stdout)
    validation.Draft202012Validator.check_schema(printed)
    validator = validation.Draft202012Validator(printed)
    cases = sorted((PROJECT / "cases").glob("*.toml"))
    assert cases
    for case in cases:
        data = tomllib.loads(case.read_text(encoding="utf-8"))
        assert [fault.message for fault in validator.iter_errors(data)] == [], case
        data["beam"]["lenght"] = data["beam"].pop("length")
        assert list(validator.iter_errors(data))


def test_base_motion_in_three_quantities(tmp_path: Path) -> None:
    """The same support motion as acceleration, velocity and displacement: the same relative and absolute motion."""
    omega = 2.0 * np.pi * 50.0
    text = DEMO.read_text(encoding="utf-8")
    start, end = text.index('[[load]]\ntype = "harmonic_force"'), text.index("[[probe]]")
    histories = {}
    for quantity, amplitude, phase in (
        ("acceleration", 100.0, 0.0),
        ("velocity", 100.0 / omega, -90.0),
        ("displacement", 100.0 / omega**2, 180.0),
    ):
        load = f'[[load]]\ntype = "base_motion"\nquantity = "{quantity}"\nfrequency = 50.0\n'
        case = tmp_path / f"{quantity}.toml"
        case.write_text(f"{text[:start]}{load}amplitude = {amplitude!r}\nphase = {phase}\n\n{text[end:]}", "utf-8")
        outcome = gapbeam.run(case, {"time.end": 0.01}, tmp_path / quantity)
        assert outcome.exit_status == 0
        histories[quantity] = gapbeam.open_results(outcome.folder).history
    first = histories.pop("acceleration")
    times = first["time"].values
    mean = -100.0 / omega * np.diff(np.cos(omega * times)) / STEP
    frame = (first["acceleration_absolute"] - first["acceleration_relative"]).sel(component="y").values[1:]
    np.testing.assert_allclose(frame, np.repeat(mean[:, None], 2, axis=1), rtol=0.0, atol=1e-8)
    assert np.ptp(first["displacement"].sel(component="y").values) > 1e-4
    for history in histories.values():
        for name in ("displacement", "velocity", "acceleration_absolute", "contact_force"):
            size = np.abs(first[name].values).max()
            np.testing.assert_allclose(history[name], first[name], rtol=0.0, atol=1e-8 * size)


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize(
    ("count", "number"),
    [(1, signal.SIGINT), (1, signal.SIGTERM), (2, signal.SIGINT)],
    ids=["SIGINT", "SIGTERM", "SIGINT to one of two ranks"],
)
def test_interrupted_run_ends_in_order(count: int, number: signal.Signals, tmp_path: Path) -> None:
    """A signal to the last rank during a march: exit status 130 or 143, a checkpoint, and all that was computed."""
    status = 143 if number == signal.SIGTERM else 130
    folder, pids = tmp_path / "out", tmp_path / "pids"
    pids.mkdir()
    command = [*(ranks(count) if count > 1 else ()), sys.executable, "-m", "tests.programs.numbered_ranks", str(pids)]
    process = subprocess.Popen(
        [*command, "run", str(DEMO), *settings(*LONG), "--output", str(folder)],
        cwd=PROJECT,
        env=process_environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for_fields(process, folder)
        os.kill(int((pids / str(count - 1)).read_text()), number)
        shown, errors = process.communicate(timeout=LONGEST)
    finally:
        process.kill()
    assert process.returncode == status, errors
    assert "Traceback" not in errors
    assert shown == ""
    assert f"results: {folder}" in errors
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert (summary["status"], summary["exit_status"]) == ("interrupted", status)
    assert summary["energy"]["kinetic"] > 0.0
    results = gapbeam.open_results(folder)
    records = results.history.sizes["time"]
    assert records == summary["convergence"]["steps"] + 1
    np.testing.assert_allclose(results.history["time"], STEP * np.arange(records), rtol=1e-12)
    with results.fields() as fields:
        assert [frame.time for frame in fields] == pytest.approx(1e-2 * np.arange(1 + (records - 1) // 100))
    assert {path.name for path in folder.iterdir()} == FILES | {"checkpoint"}
    assert len(list((folder / "checkpoint").iterdir())) == 1


def wait_for_fields(process: subprocess.Popen[str], folder: Path) -> None:
    """Wait until a run has written two fields."""

    def there() -> bool:
        assert process.poll() is None, process.communicate()
        path = folder / "fields.xdmf"
        return path.is_file() and path.read_text(encoding="utf-8").count("<Time") >= 2

    until(there, "two fields are there")
