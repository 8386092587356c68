"""Runs of dense models, compiled and step by step: the same files, figures, warnings and exit statuses."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
import gapbeam.solver.march.simulation
from gapbeam.solver.case.case import Case
from gapbeam.solver.run import run_consumers
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.run.output.output_thread import OutputThread
from gapbeam.solver.run.run_case import run_case
from tests.shared.command import CASE_FOLDER
from tests.shared.models import COARSE, GRAVITY, beam_case
from tests.shared.processes import until

HOLES = CASE_FOLDER / "tube-holes.toml"
PUSH = {"type": "harmonic_force", "name": "push", "point": 0.4, "amplitude": 300.0, "frequency": 80.0}
SHAKE = {"type": "base_motion", "name": "base", "amplitude": 20.0, "frequency": 60.0, "ramp": 2.0e-3}
MODEL = {"type": "reduced", "modes": 8, "shapes": 4}
LENGTH = 0.51


def case_of(**changes: Any) -> Case:
    """Return a rattling reduced slice."""
    tables = {"mesh": COARSE, "model": MODEL, "time": {"end": 0.02, "step": 5.0e-5}}
    for name, table in changes.items():
        tables[name] = table if name == "model" else {**tables.get(name, {}), **table}
    return beam_case(tables, (GRAVITY, PUSH, SHAKE), {"tip": LENGTH, "end": 0.0})


def run_both(case: Case, folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Outcome, Outcome]:
    """Return the outcomes of the compiled loop and of the march step by step."""
    compiled = run_case(case, folder / "compiled", MPI.COMM_SELF)
    monkeypatch.setattr(gapbeam.solver.march.simulation, "why_not_compiled", lambda _plan: "asked for by a test")
    return compiled, run_case(case, folder / "steps", MPI.COMM_SELF)


def same_history(one: Path, other: Path, relative: float) -> None:
    """Check that two histories hold the same records to a share of their largest entries; energies share a scale."""
    with h5py.File(one / "history.h5") as first, h5py.File(other / "history.h5") as second:
        assert set(first) == set(second)
        largest = max(float(np.abs(first[name][:]).max()) for name in ("kinetic_energy", "strain_energy"))
        for name, data in second.items():
            if data.dtype.kind != "f":
                continue
            expected, found = data[:], first[name][:]
            scale = largest if data.attrs.get("units") == "J" else float(np.abs(expected).max(initial=1e-300))
            assert found.shape == expected.shape, name
            assert np.abs(found - expected).max(initial=0.0) <= relative * scale, name


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {
            "time": {"scheme": {"type": "generalized-alpha", "rho_inf": 0.3}},
            "gates": {"accept_energy_growth": True},
            "output": {"history_interval": 3.0e-4, "fields_interval": 7.0e-4},
        },
        {"contact": {"law": {"type": "hunt-crossley", "restitution": 0.6}}, "model": {"type": "beam"}},
    ],
)
def test_a_compiled_run_leaves_the_same_results(
    changes: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled, steps = run_both(case_of(**changes), tmp_path, monkeypatch)
    assert compiled.exit_status == steps.exit_status == 0
    same_history(compiled.folder, steps.folder, 1.0e-5)
    for name in ("gates", "contact_episodes"):
        found, expected = ({**outcome.summary[name], "limits": None} for outcome in (compiled, steps))
        assert found == pytest.approx(expected, rel=1e-4, abs=1e-7), name
    assert compiled.summary["peak_contact_force"] == pytest.approx(steps.summary["peak_contact_force"], rel=1e-5)
    assert compiled.summary["peak_contact_force"]["base"] > 200.0
    assert compiled.summary["penetration"] == pytest.approx(steps.summary["penetration"], rel=1e-5)
    for name in ("steps", "parts_of_halved_steps", "iterations_max"):
        assert compiled.summary["convergence"][name] == steps.summary["convergence"][name]
    assert compiled.summary["warnings"] == steps.summary["warnings"]
    fields = [sorted(h5py.File(outcome.folder / "fields.h5")["displacement"]) for outcome in (compiled, steps)]
    assert fields[0] == fields[1]
    last = [
        h5py.File(outcome.folder / "fields.h5")["contact_pressure"][fields[0][-1]][:] for outcome in (compiled, steps)
    ]
    assert last[0] == pytest.approx(last[1], rel=1e-4, abs=1e-4 * np.abs(last[1]).max())


@pytest.mark.slow(minutes=0.1)
def test_a_tube_in_holes_leaves_the_same_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Motion in space, with stress at a probe and resultants of the holes."""
    keys = {
        "model.type": "beam", "mesh.cells_through_thickness": 2, "mesh.cells_across_width": 2, "mesh.size": 0.1,
        "mesh.support_size": 0.01, "contact.stiffness": 1e11, "time.end": 0.01,
        "probe": [{"name": "tip", "point": 1.0}, {"name": "top", "point": [0.4, 0.0, 0.0125], "stress": True}],
    }  # fmt: skip
    compiled, steps = run_both(gapbeam.read_case(HOLES, keys), tmp_path, monkeypatch)
    same_history(compiled.folder, steps.folder, 1.0e-5)
    with h5py.File(compiled.folder / "history.h5") as history:
        assert np.abs(history["contact_resultant"][:, :, 0]).max() > 1.0
        assert np.abs(history["axial_stress"][:]).max() > 1.0e6


def test_created_energy_ends_a_compiled_run_at_the_same_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changes = {
        "time": {"scheme": "newmark", "end": 0.1},
        "contact": {"stiffness": 2.0e15},
        "gates": {"accept_energy_growth": False},
    }
    monkeypatch.setattr("gapbeam.solver.run.run_case.refuse_energy_creators", lambda *_: None)
    compiled, steps = run_both(case_of(**changes), tmp_path, monkeypatch)
    assert compiled.exit_status == steps.exit_status == 3
    assert compiled.summary["convergence"]["steps"] == steps.summary["convergence"]["steps"] < 2000
    assert compiled.message.split(" J,")[0][:40] == steps.message.split(" J,")[0][:40]
    same_history(compiled.folder, steps.folder, 1.0e-5)  # round-off grows with the energy that is created


@pytest.mark.slow(minutes=0.1)
def test_a_signal_ends_a_compiled_run(tmp_path: Path) -> None:
    run_case(case_of(), tmp_path / "warm", MPI.COMM_SELF)
    history_file, fields = tmp_path / "long" / "history.h5", tmp_path / "long" / "fields.xdmf"

    def interrupt() -> None:
        until(lambda: fields.is_file() and fields.read_text("utf-8").count("<Time") > 1, "a second field")
        signal.raise_signal(signal.SIGINT)

    other = threading.Thread(target=interrupt)
    other.start()
    outcome = run_case(case_of(time={"end": 400.0}), tmp_path / "long", MPI.COMM_SELF)
    other.join()
    assert outcome.exit_status == 130
    with h5py.File(history_file) as history:
        assert len(history["time"]) > 1
        assert f"t = {history['time'][-1]:.6g} s" in outcome.message


def test_output_in_a_second_thread_has_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Records and fields are those of a run that does one thing after the other."""
    case, seen, write = case_of(), set(), FieldWriter.write

    def noting(self: FieldWriter, *what: Any) -> None:
        seen.add(threading.current_thread() is threading.main_thread())
        write(self, *what)

    monkeypatch.setattr(FieldWriter, "write", noting)
    beside = run_case(case, tmp_path / "beside", MPI.COMM_SELF)
    assert seen == {True, False}  # the field of the start, and all others
    monkeypatch.setattr(run_consumers, "OutputThread", lambda _beside, ending: OutputThread(False, ending))
    in_turn = run_case(case, tmp_path / "in-turn", MPI.COMM_SELF)
    assert beside.exit_status == in_turn.exit_status == 0
    same_history(beside.folder, in_turn.folder, 0.0)
    with h5py.File(beside.folder / "fields.h5") as first, h5py.File(in_turn.folder / "fields.h5") as second:
        assert sorted(first["velocity"]) == sorted(second["velocity"])
        for name in ("displacement", "velocity", "contact_pressure"):
            assert all(np.array_equal(first[name][number], second[name][number]) for number in first[name]), name
    for name in ("penetration", "energy", "impacts", "assumptions"):
        assert beside.summary[name] == in_turn.summary[name], name


def test_files_and_figures_end_together_where_an_assumption_is_broken(tmp_path: Path) -> None:
    """Blocks that were computed before the error was heard are in the history, too."""
    push = {**PUSH, "amplitude": 3.0e5}
    case = beam_case({"mesh": COARSE, "model": MODEL, "time": {"end": 2.0, "step": 5.0e-5}}, (GRAVITY, push), {})
    outcome = run_case(case, tmp_path / "broken", MPI.COMM_SELF)
    assert outcome.exit_status == 4
    assert "rotation" in outcome.message
    with h5py.File(outcome.folder / "history.h5") as history:
        records = len(history["time"])
        assert records == outcome.summary["convergence"]["steps"] + 1 < 20_000
        deepest = float(history["penetration"][:].max())
    assert outcome.summary["penetration"]["largest"] == pytest.approx(deepest, rel=1e-12)
