"""One run of a case: set-up, seat, march, outputs, verdict."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from meshes.rank_zero import on_rank_zero
from solver.analyses.static import Seat, find_seat
from solver.analyses.transient import EffectiveOperators, March, image_drift, march
from solver.case import BaseMotion, Case, HarmonicForce
from solver.case_warnings import warnings
from solver.case_writer import case_to_toml
from solver.energy import Ledger, enter_step, open_ledger, restate
from solver.errors import RunError
from solver.gates import EnergyGates
from solver.integrators.schemes import make_integrator
from solver.model import Model, build_model
from solver.output import summary as summaries
from solver.output.fields import FieldWriter
from solver.output.folder import prepare_folder, write_beside
from solver.output.history import HistoryWriter
from solver.output.progress import ProgressLine
from solver.output.records import CASE_FILE, HISTORY_FILE, LOG_FILE
from solver.output.rows import Recorder
from solver.system import Step

LOG = logging.getLogger("gapbeam")


@dataclass(frozen=True)
class Outcome:
    """What became of a run.

    Attributes:
        folder: Where its results are.
        exit_status: 0, or the status of what went wrong.
        message: One line for the user.
        summary: The contents of summary.json.
    """

    folder: Path
    exit_status: int
    message: str
    summary: dict[str, Any]


@dataclass
class _Tally:
    steps: int = 0
    halved: int = 0
    iterations: int = 0
    most_iterations: int = 0
    back_substitution: float = 0.0
    advance: float = 0.0
    drift: float = 0.0
    elastic_force: float = 0.0


@dataclass
class _Run:
    model: Model
    folder: Path
    comm: MPI.Comm
    summary: dict[str, Any]
    recorder: Recorder
    gates: EnergyGates
    ledger: Ledger
    history: HistoryWriter | None
    fields: FieldWriter
    tally: _Tally = field(default_factory=_Tally)
    march_seconds: float = 0.0


def run_case(case: Case, folder: Path, comm: MPI.Comm, overwrite: bool = False) -> Outcome:
    """Run a case into a results folder.

    Args:
        case: What to run.
        folder: Where results go.
        comm: The ranks that share the work.
        overwrite: Replace the results of an earlier run.

    Returns:
        The outcome; its exit status is not zero when the run created energy or did not converge, and what was
        computed up to then is on disk.

    Raises:
        UserError: The folder holds results or cannot be written, or the mesh does not fit the case.

    Collective.
    """
    on_rank_zero(comm, lambda: prepare_folder(folder, overwrite))
    started = time.perf_counter()
    with _log_file(folder, comm):
        summary: dict[str, Any] = {
            "title": case.title,
            "status": "running",
            "exit_status": None,
            "message": "",
            "warnings": warnings(case),
            "versions": summaries.versions(),
            "forcing": _forcing(case),
        }
        for warning in summary["warnings"]:
            LOG.warning("%s", warning)
        if comm.rank == 0:
            write_beside(folder / CASE_FILE, _case_text(case, summary["versions"]))
        try:
            run = _set_up(case, folder, comm, summary)
            _march(run)
        except RunError as error:
            summary["status"], summary["exit_status"] = "failed", error.exit_status
            summary["message"] = str(error)
            LOG.error("%s", error)
        summary.setdefault("wall_time", {})["total"] = time.perf_counter() - started
        summary["memory"] = {"peak_per_rank": summaries.peak_memory(comm)}
        if comm.rank == 0:
            summaries.write_summary(folder, summary)
    return Outcome(folder, summary["exit_status"], summary["message"], summary)


def _set_up(case: Case, folder: Path, comm: MPI.Comm, summary: dict[str, Any]) -> _Run:
    model = build_model(case, comm)
    summary["model"] = summaries.describe_model(model)
    summary["defaults"] = [vars(default) for default in model.defaults]
    summary["wall_time"] = dict(model.seconds)
    LOG.info(
        "%d DOFs, %d contact points on %d interface DOFs, %d rank%s",
        model.dofs,
        model.system.contact.size,
        model.system.contact.interface.size,
        comm.size,
        "" if comm.size == 1 else "s",
    )
    for default in model.defaults:
        LOG.info("%s = %.4g %s: %s", default.key, default.value, default.unit, default.reason)
    clock = time.perf_counter()
    scheme = make_integrator(case.time.scheme)
    seat = find_seat(model.system, model.law, model.seat_shift, scheme.carries_acceleration)
    summary["seat"] = summaries.describe_seat(seat, model)
    summary["wall_time"]["seat"] = time.perf_counter() - clock
    LOG.info(
        "seated in %d iterations: base %.4g N, gland %.4g N, largest penetration %.3g m",
        seat.iterations,
        summary["seat"]["base_force"],
        summary["seat"]["gland_force"],
        summary["seat"]["largest_penetration"],
    )
    recorder = Recorder(model)
    summary["seat"]["probes"] = {
        name: [float(x) for x in probe.evaluate(seat.state.u[0], model.system.operators)]
        for name, probe in model.probes.items()
    }
    run = _Run(
        model,
        folder,
        comm,
        summary,
        recorder,
        EnergyGates(case.gates, model.system.contact),
        open_ledger(model.system, model.law, seat.state),
        HistoryWriter(folder / HISTORY_FILE, recorder.labels) if comm.rank == 0 else None,
        FieldWriter(folder, model),
    )
    run.summary["_seat"] = seat
    return run


def _march(run: _Run) -> None:
    model, case, summary = run.model, run.model.case, run.summary
    seat: Seat = summary.pop("_seat")
    scheme = make_integrator(case.time.scheme)
    operators = EffectiveOperators(model.system, scheme)
    clock = time.perf_counter()
    condensed = operators.at(case.time.step)
    summary["wall_time"]["factorization"] = condensed.seconds["factorization"]
    summary["wall_time"]["delassus"] = condensed.seconds["delassus"]
    steps = round(case.time.end / case.time.step)
    plan = March(
        model.system,
        model.law,
        scheme,
        operators,
        case.time.step,
        steps,
        case.time.max_halvings,
        case.time.max_iterations,
    )
    every = round((case.output.history_interval or case.time.step) / case.time.step)
    fields_every = max(1, round((case.output.fields_interval or case.time.end / 100.0) / case.time.step))
    period = summary["forcing"]["period"]
    failure: RunError | None = None
    try:
        _record(run, seat.state)
        run.fields.write(seat.state, model)
        clock = time.perf_counter()
        with ProgressLine(case.time.end, period, quiet=run.comm.rank != 0) as progress:
            done = 0
            mark = time.perf_counter()
            for step in march(plan, seat.state):
                run.tally.advance += time.perf_counter() - mark
                _take(run, step)
                if step.completes:
                    done += 1
                    state = step.refreshed or step.new
                    if done % every == 0 or done == steps:
                        _record(run, state)
                    if done % fields_every == 0 or done == steps:
                        run.fields.write(state, model)
                    progress.advance(state.time, _contact_words(run, step))
                mark = time.perf_counter()
    except RunError as error:
        failure = error
    finally:
        run.march_seconds = time.perf_counter() - clock
        _close(run)
    _conclude(run)
    if failure is not None:
        raise failure


def _take(run: _Run, step: Step) -> None:
    model, tally = run.model, run.tally
    run.ledger = enter_step(model.system, model.law, run.ledger, step)
    if step.refreshed is not None:
        run.ledger = restate(model.system, model.law, run.ledger, step.refreshed)
        drift, force = image_drift(step)
        tally.drift, tally.elastic_force = max(tally.drift, drift), max(tally.elastic_force, force)
    run.recorder.see(step)
    tally.steps += 1
    tally.halved += 0 if step.completes and step.size > 0.75 * model.case.time.step else 1
    tally.iterations += step.iterations
    tally.most_iterations = max(tally.most_iterations, step.iterations)
    tally.back_substitution += step.timings["back_substitution"]
    run.gates.check(step, run.ledger)


def _record(run: _Run, state: Any) -> None:
    row = run.recorder.row(state, run.ledger)
    if run.history is not None:
        run.history.append(row)


def _contact_words(run: _Run, step: Step) -> str:
    contact = run.model.system.contact
    closed = [
        name for face, name in enumerate(contact.face_names) if np.any(step.new.pressure[contact.faces == face] > 0.0)
    ]
    return "contact: " + (" and ".join(closed) or "none")


def _close(run: _Run) -> None:
    if run.history is not None:
        run.history.close()
    run.fields.close()


def _conclude(run: _Run) -> None:
    """Fill the summary with figures and the verdict."""
    summary, tally, case = run.summary, run.tally, run.model.case
    count = max(tally.steps, 1)
    back = tally.back_substitution / count
    per_step = run.march_seconds / count
    summary["wall_time"] |= {
        "march": run.march_seconds,
        "per_step": per_step,
        "advance": tally.advance / count,
        "back_substitution": back,
        "step_over_back_substitution": per_step / back if back > 0.0 else None,
    }
    summary["energy"] = summaries.describe_energy(run.ledger, run.gates)
    summary["gates"] = summaries.describe_gates(run.gates)
    summary["convergence"] = {
        "steps": tally.steps,
        "parts_of_halved_steps": tally.halved,
        "iterations_mean": tally.iterations / count,
        "iterations_max": tally.most_iterations,
        "image_drift": tally.drift / tally.elastic_force if tally.elastic_force > 0.0 else 0.0,
    }
    faces = run.model.system.contact.face_names
    deepest = float(np.max(run.recorder.deepest))
    clearance = abs(case.support.clearance)
    summary["penetration"] = {
        "largest": deepest,
        "relative_to_clearance": deepest / clearance if clearance > 0.0 else None,
    }
    summary["peak_contact_force"] = dict(zip(faces, (float(x) for x in run.recorder.peak_force), strict=True))
    if clearance > 0.0:
        LOG.info("largest penetration %.3g m, %.2g %% of the clearance", deepest, 100.0 * deepest / clearance)
    failed = run.gates.failed(run.ledger)
    if run.gates.violations:
        summary["warnings"].append(
            f"{run.gates.violations} of {run.gates.impacts} impacts changed the energy by more than the gates allow "
            f"(largest growth {run.gates.largest_growth:.2%}, largest loss {run.gates.largest_loss:.2%}): "
            "try a smaller time.step"
        )
        LOG.warning("%s", summary["warnings"][-1])
    if failed and not case.gates.accept_energy_growth:
        summary["status"], summary["exit_status"] = "failed", 3
        summary["message"] = (
            f"the scheme {case.time.scheme.type} created {run.ledger.created:.3g} J, {run.gates.growth(run.ledger):.2%} "
            "of the energy exchanged: the results are not to be trusted. Use the scheme discrete-gradient, a smaller "
            "time.step or a softer contact.stiffness; gates.accept_energy_growth = true accepts it"
        )
        LOG.error("%s", summary["message"])
        return
    if failed:
        summary["warnings"].append(
            f"energy growth of {run.gates.growth(run.ledger):.2%} accepted by gates.accept_energy_growth"
        )
        LOG.warning("%s", summary["warnings"][-1])
    summary["status"], summary["exit_status"] = "completed", 0
    summary["message"] = f"{tally.steps} steps, energy residual {summary['energy']['relative_residual']:.1e} of the energy exchanged"


def _forcing(case: Case) -> dict[str, float | None]:
    frequencies = {load.frequency for load in case.load if isinstance(load, HarmonicForce | BaseMotion)}
    frequency = frequencies.pop() if len(frequencies) == 1 else None
    return {"frequency": frequency, "period": 1.0 / frequency if frequency else None}


def _case_text(case: Case, used: dict[str, str]) -> str:
    made = ", ".join(f"{name} {version}" for name, version in used.items())
    return f"# As it was run, with every default, by {made}.\n{case_to_toml(case)}"


class _log_file:  # noqa: N801 - reads as a statement
    """Sends the log of rank 0 to run.log as well."""

    def __init__(self, folder: Path, comm: MPI.Comm) -> None:
        self._handler = logging.FileHandler(folder / LOG_FILE, delay=True) if comm.rank == 0 else None

    def __enter__(self) -> None:
        if self._handler is not None:
            self._handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
            LOG.addHandler(self._handler)

    def __exit__(self, *_: object) -> None:
        if self._handler is not None:
            LOG.removeHandler(self._handler)
            self._handler.close()
