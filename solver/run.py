"""One run of a case: set-up, seat, march, outputs, verdict."""

from __future__ import annotations

import logging
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from meshes.rank_zero import all_there, on_rank_zero
from solver.analyses.start import start_of_case
from solver.analyses.static import Seat, find_seat
from solver.case import Case
from solver.case_file.record_fits import with_checksums
from solver.case_file.warnings import warnings
from solver.case_file.writer import case_to_toml
from solver.case_tables.analysis import Periodic
from solver.checkpoint.checkpoints import Checkpoints, Left
from solver.checkpoint.resuming import find_left, refuse_to_resume
from solver.compiled.reasons import why_not_compiled
from solver.course import Course, steps_between
from solver.energy_creators import accepted_energy_creators, refuse_energy_creators
from solver.errors import Interrupted, NotWritten, RunError
from solver.integrators.schemes import Integrator, make_integrator
from solver.interruption import SetUp, Wish
from solver.march_of_model import march_of_model
from solver.model import Model, build_model
from solver.never_begun import left_behind, stopped_words
from solver.out_of_memory import out_of_memory_told
from solver.output import summary as summaries
from solver.output.folder import AS_RUN, check_folder, clear, prepare_folder, write_beside
from solver.output.lock import locked
from solver.output.log_file import log_file
from solver.output.records import CASE_FILE, CHECKPOINT_FOLDER, SUMMARY_FILE
from solver.output.space import check_space, size_of_results
from solver.output.storage import written
from solver.periodic.probe_figures import ProbeFigures
from solver.periodic.searching import search
from solver.threads import crowded, threads_a_rank
from solver.time_step import forcing_frequencies
from solver.verdict import (
    balance_words,
    contact_words,
    figures,
    friction_words,
    judge,
    remarks,
    remarks_on_model,
    resolution_remarks,
)

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


def run_case(case: Case, folder: Path, comm: MPI.Comm, overwrite: bool = False, resume: bool = False) -> Outcome:
    """Run a case into a results folder, or go on with a run that was left there.

    Args:
        case: What to run.
        folder: Where results go.
        comm: The ranks that share the work.
        overwrite: Replace the results of an earlier run.
        resume: Go on from its last checkpoint; from the start where it has none yet.

    Returns:
        The outcome; its exit status is not zero when the run created energy, did not converge or was
        interrupted, and what was computed up to then is on disk.

    Raises:
        UserError: The folder holds results, cannot be written or has no room for them, a point lies outside the mesh,
            or scheme and contact are known to create energy and the case does not accept that.
        CaseError: The computed time step does not go with the rest of the case.
        RecordError: The record of a load cannot be used, or is another one than its checksum tells.
        MeshError: The mesh file does not fit the case.

    Collective.
    """
    ends, case = comm.Dup(), with_checksums(case)
    with SetUp(case.output.wall_time) as set_up:
        try:
            outcome = _run_case(case, folder, comm, ends, overwrite, resume, set_up)
        except Interrupted as stopped:
            set_up.over()
            if comm.size > 1 and not all_there(ends):  # the others wait for this rank
                raise
            summary = left_behind(case, folder, comm, stopped, resume, set_up.started)
            outcome = Outcome(folder, stopped.exit_status, summary["message"], summary)
    ends.Free()
    return outcome


def _run_case(
    case: Case, folder: Path, comm: MPI.Comm, ends: MPI.Comm, overwrite: bool, resume: bool, set_up: SetUp
) -> Outcome:
    """Run a case; where it is interrupted before anything is in the folder, that is raised."""
    on_rank_zero(comm, lambda: check_folder(folder, overwrite or resume, overwrite))
    if resume:
        refuse_to_resume(case)
    with out_of_memory_told("the model was made"):
        model = build_model(case, comm)
    set_up.check()
    refuse_energy_creators(model)
    if not isinstance(model.case.analysis, Periodic):
        sizes = size_of_results(model)
        on_rank_zero(comm, lambda: check_space(folder, *sizes))
    with locked(folder, comm):
        left = find_left(folder, case, model, comm) if resume else None
        if isinstance(left, dict):
            return Outcome(folder, 0, f"was done before: {left['message']}", left)
        course = None
        if left is None:
            on_rank_zero(comm, lambda: prepare_folder(folder))
        else:
            model = left.model
            course = Course(model, folder, comm, left)  # or a refusal, before anything in the folder changes
        with log_file(folder, comm):
            summary = _opening(model)
            try:
                _write_opening(model, folder, comm, summary)
                with out_of_memory_told("the model was marched"):
                    _run(model, folder, comm, summary, left, course, set_up)
            except RunError as error:
                if comm.size > 1 and not all_there(ends):  # the others wait for this rank
                    raise
                summary["status"] = "interrupted" if isinstance(error, Interrupted) else "failed"
                summary["exit_status"], summary["message"] = error.exit_status, str(error)
                if isinstance(error, Interrupted) and set_up.heard != Wish.NONE:
                    summary["message"] = stopped_words(case, error, left is not None)
                LOG.error("%s", summary["message"])
            except BaseException as error:
                summary["status"], summary["exit_status"] = "crashed", 1
                summary["message"] = f"{type(error).__name__}: {error}"
                if comm.rank == 0:
                    with suppress(OSError):
                        summaries.write_summary(folder, summary)
                raise
            summary["wall_time"]["total"] = time.perf_counter() - set_up.started
            summary["memory"] = {"peak_per_rank": summaries.peak_memory(comm)}
            _close(folder, comm, summary)
    return Outcome(folder, summary["exit_status"], summary["message"], summary)


def _write_opening(model: Model, folder: Path, comm: MPI.Comm, summary: dict[str, Any]) -> None:
    def write() -> None:
        with written(folder / CASE_FILE):
            write_beside(folder / CASE_FILE, _case_text(model.case, summary["versions"]))
            summaries.write_summary(folder, summary)

    on_rank_zero(comm, write)


def _close(folder: Path, comm: MPI.Comm, summary: dict[str, Any]) -> None:
    """Write the summary; of a run that is done, the checkpoints go. Collective."""

    def write() -> None:
        with written(folder / SUMMARY_FILE):
            summaries.write_summary(folder, summary)
            if summary["status"] == "completed":
                clear(folder, CHECKPOINT_FOLDER)

    try:
        on_rank_zero(comm, write)
    except NotWritten as error:
        LOG.error("%s", error)
        if summary["exit_status"] == 0:
            summary["status"], summary["exit_status"], summary["message"] = "failed", error.exit_status, str(error)


def _opening(model: Model) -> dict[str, Any]:
    """Return the summary of a run that has only been set up, and log it."""
    case, contact = model.case, model.system.contact
    crowding = filter(None, [crowded(model.space.mesh.comm)])
    summary: dict[str, Any] = {
        "title": case.title,
        "status": "running",
        "exit_status": None,
        "message": "",
        "warnings": [*warnings(case), *accepted_energy_creators(model), *remarks_on_model(model), *crowding],
        "versions": summaries.versions(),
        "forcing": _forcing(case),
        "model": summaries.describe_model(model),
        "defaults": [vars(default) for default in model.defaults],
        "wall_time": dict(model.seconds),
        "resumed": [],
    }
    for warning in summary["warnings"]:
        LOG.warning("%s", warning)
    LOG.info(
        "%d DOFs, %d contact points on %d interface DOFs, ranks: %d, threads a rank: %d",
        model.dofs,
        contact.size,
        contact.interface.size,
        summary["model"]["ranks"],
        threads_a_rank(),
    )
    for default in model.defaults:
        LOG.info("%s = %.4g %s: %s", default.key, default.value, default.unit, default.reason)
    return summary


def _run(
    model: Model,
    folder: Path,
    comm: MPI.Comm,
    summary: dict[str, Any],
    left: Left | None,
    course: Course | None,
    set_up: SetUp,
) -> None:
    scheme = make_integrator(model.case.time.scheme)
    plan = march_of_model(model, scheme)
    summary["wall_time"] |= plan.operators.at(plan.dt).seconds
    reason = why_not_compiled(plan)
    summary["loop"] = "compiled" if reason is None else f"step by step: {reason}"
    deadline = set_up.deadline
    checkpoints, steps, response = None, None, None
    if left is not None:
        _tell_resumed(left, summary)
    else:
        seat = _seated(model, scheme, summary)
        start = start_of_case(model.case, model.system, seat.state)
        set_up.check()
        if isinstance(model.case.analysis, Periodic):
            set_up.over()
            response = search(model, seat.state, model.case.analysis, folder, comm, summary, deadline)
            model, plan, start = response.steady.model, response.steady.plan, response.start
    if response is None:
        kept = {"seat": summary["seat"], "resumed": summary["resumed"], "every": steps_between(model)}
        checkpoints = Checkpoints(folder, model, comm, kept, model.case.output.checkpoint_interval)
    probes = ProbeFigures(model)
    if response is not None:
        steps = probes.listening(response.steps)
    course = course or Course(model, folder, comm, start)
    set_up.over()
    set_up.check()
    try:
        with course:
            course.follow(plan, steps, summary["forcing"]["period"], deadline, checkpoints)
    finally:
        if response is not None:
            summary["periodic"]["probes"] = probes.told(response.steady.periods)
        accounts = course.accounts
        summary |= figures(model, course.recorder, accounts)
        summary["contact_episodes"] = accounts.episodes.figures()
        summary["convergence"] = accounts.tally.convergence()
        summary["wall_time"] |= accounts.tally.seconds()
        summary["checkpoints"] = course.costs()
        noted = remarks(model, course.recorder, accounts)
        noted += resolution_remarks(model, accounts.tally)
        summary["warnings"] += noted
        LOG.info("%s", contact_words(model, accounts.peaks))
        if model.law.friction is not None:
            LOG.info("%s", friction_words(accounts))
        for remark in noted:
            LOG.warning("%s", remark)
    judge(model, accounts.ledger, accounts.gates)
    summary["status"], summary["exit_status"] = "completed", 0
    summary["message"] = f"{accounts.tally.steps} steps, {balance_words(accounts.ledger)}"


def _seated(model: Model, scheme: Integrator, summary: dict[str, Any]) -> Seat:
    clock = time.perf_counter()
    seat = find_seat(model.system, model.law, model.seat_springs, scheme.carries_acceleration)
    summary["seat"] = summaries.describe_seat(seat, model)
    summary["wall_time"]["seat"] = time.perf_counter() - clock
    LOG.info(
        "seated in %d iterations: base %.4g N, gland %.4g N, largest penetration %.3g m",
        seat.iterations,
        summary["seat"]["base_force"],
        summary["seat"]["gland_force"],
        summary["seat"]["largest_penetration"],
    )
    return seat


def _tell_resumed(left: Left, summary: dict[str, Any]) -> None:
    state = left.paused.state
    summary["seat"], summary["resumed"] = left.header["seat"], [*left.header["resumed"], state.time]
    bits = "to the same bits" if left.exact else "to round-off: other ranks, or another machine, than before"
    LOG.info("goes on from t = %.6g s, step %d, %s", state.time, left.paused.done, bits)


def _forcing(case: Case) -> dict[str, float | None]:
    frequencies = forcing_frequencies(case)
    frequency = frequencies[0] if len(frequencies) == 1 else None
    return {"frequency": frequency, "period": 1.0 / frequency if frequency else None}


def _case_text(case: Case, used: dict[str, str]) -> str:
    made = ", ".join(f"{name} {version}" for name, version in used.items())
    return f"{AS_RUN}, with every default, by {made}.\n{case_to_toml(case)}"
