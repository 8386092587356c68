"""One run of a case: set-up, seat, march, outputs, verdict."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from meshes.rank_zero import all_there, on_rank_zero
from solver.accounts import Accounts
from solver.analyses.start import start_of_case
from solver.analyses.static import find_seat
from solver.analyses.transient import March
from solver.case import Case, Ramped
from solver.case_file.warnings import warnings
from solver.case_file.writer import case_to_toml
from solver.case_tables.analysis import Periodic
from solver.compiled.reasons import why_not_compiled
from solver.energy_creators import accepted_energy_creators, refuse_energy_creators
from solver.errors import Interrupted, RunError
from solver.integrators.schemes import make_integrator
from solver.interruption import Interruption
from solver.march_of_model import march_of_model
from solver.model import Model, build_model
from solver.operators import Array
from solver.output import summary as summaries
from solver.output.fields import FieldWriter
from solver.output.folder import check_folder, prepare_folder, write_beside
from solver.output.history import HistoryWriter
from solver.output.log_file import log_file
from solver.output.progress import ProgressLine
from solver.output.records import CASE_FILE, HISTORY_FILE
from solver.output.rows import Recorder, Rows
from solver.output.space import check_space, size_of_results
from solver.periodic.probe_figures import ProbeFigures
from solver.periodic.searching import search
from solver.stretches import Wanted, marched, stretches_of
from solver.system import State, Step
from solver.verdict import (
    balance_words,
    contact_words,
    figures,
    friction_words,
    judge,
    remarks,
    remarks_on_basis,
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


def run_case(case: Case, folder: Path, comm: MPI.Comm, overwrite: bool = False) -> Outcome:
    """Run a case into a results folder.

    Args:
        case: What to run.
        folder: Where results go.
        comm: The ranks that share the work.
        overwrite: Replace the results of an earlier run.

    Returns:
        The outcome; its exit status is not zero when the run created energy, did not converge or was
        interrupted, and what was computed up to then is on disk.

    Raises:
        UserError: The folder holds results, cannot be written or has no room for them, a point lies outside the mesh,
            or scheme and contact are known to create energy and the case does not accept that.
        CaseError: The computed time step does not go with the rest of the case.
        MeshError: The mesh file does not fit the case.

    Collective.
    """
    started, ends = time.perf_counter(), comm.Dup()
    on_rank_zero(comm, lambda: check_folder(folder, overwrite))
    model = build_model(case, comm)
    refuse_energy_creators(model)
    if not isinstance(model.case.analysis, Periodic):
        sizes = size_of_results(model)
        on_rank_zero(comm, lambda: check_space(folder, *sizes))
    on_rank_zero(comm, lambda: prepare_folder(folder))
    with log_file(folder, comm):
        summary = _opening(model)
        if comm.rank == 0:
            write_beside(folder / CASE_FILE, _case_text(model.case, summary["versions"]))
            summaries.write_summary(folder, summary)
        try:
            _run(model, folder, comm, summary)
        except RunError as error:
            if comm.size > 1 and not all_there(ends):  # the others wait for this rank
                raise
            summary["status"] = "interrupted" if isinstance(error, Interrupted) else "failed"
            summary["exit_status"], summary["message"] = error.exit_status, str(error)
            LOG.error("%s", error)
        except BaseException as error:
            summary["status"], summary["exit_status"] = "crashed", 1
            summary["message"] = f"{type(error).__name__}: {error}"
            if comm.rank == 0:
                summaries.write_summary(folder, summary)
            raise
        summary["wall_time"]["total"] = time.perf_counter() - started
        summary["memory"] = {"peak_per_rank": summaries.peak_memory(comm)}
        if comm.rank == 0:
            summaries.write_summary(folder, summary)
    ends.Free()
    return Outcome(folder, summary["exit_status"], summary["message"], summary)


def _opening(model: Model) -> dict[str, Any]:
    """Return the summary of a run that has only been set up, and log it."""
    case, contact = model.case, model.system.contact
    summary: dict[str, Any] = {
        "title": case.title,
        "status": "running",
        "exit_status": None,
        "message": "",
        "warnings": [*warnings(case), *accepted_energy_creators(model), *remarks_on_basis(model)],
        "versions": summaries.versions(),
        "forcing": _forcing(case),
        "model": summaries.describe_model(model),
        "defaults": [vars(default) for default in model.defaults],
        "wall_time": dict(model.seconds),
    }
    for warning in summary["warnings"]:
        LOG.warning("%s", warning)
    LOG.info(
        "%d DOFs, %d contact points on %d interface DOFs, ranks: %d",
        model.dofs,
        contact.size,
        contact.interface.size,
        summary["model"]["ranks"],
    )
    for default in model.defaults:
        LOG.info("%s = %.4g %s: %s", default.key, default.value, default.unit, default.reason)
    return summary


def _run(model: Model, folder: Path, comm: MPI.Comm, summary: dict[str, Any]) -> None:
    scheme = make_integrator(model.case.time.scheme)
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
    plan = march_of_model(model, scheme)
    summary["wall_time"] |= plan.operators.at(plan.dt).seconds
    reason = why_not_compiled(plan)
    summary["loop"] = "compiled" if reason is None else f"step by step: {reason}"
    start, steps, response = start_of_case(model.case, model.system, seat.state), None, None
    if isinstance(model.case.analysis, Periodic):
        response = search(model, seat.state, model.case.analysis, folder, comm, summary)
        model, plan, start = response.steady.model, response.steady.plan, response.start
    probes = ProbeFigures(model)
    if response is not None:
        steps = probes.listening(response.steps)
    course = Course(model, folder, comm, start)
    try:
        course.follow(plan, steps, summary["forcing"]["period"])
    finally:
        course.close()
        if response is not None:
            summary["periodic"]["probes"] = probes.told(response.steady.periods)
        accounts = course.accounts
        summary |= figures(model, course.recorder, accounts)
        summary["contact_episodes"] = accounts.episodes.figures()
        summary["convergence"] = accounts.tally.convergence()
        summary["wall_time"] |= accounts.tally.seconds()
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


class Course:
    """A march and everything that consumes it: accounts, history, fields, progress.

    Collective to make and to use.

    Attributes:
        fields: Where fields go.
        accounts: Ledger, gates, episodes, peaks and counts.
    """

    def __init__(self, model: Model, folder: Path, comm: MPI.Comm, start: State) -> None:
        self.model, self.comm, self.start = model, comm, start
        self.recorder = Recorder(model)
        self.accounts = Accounts.opened(model.system, model.law, start, model.step, model.case.gates)
        self.fields = FieldWriter(folder, model)
        self.history = HistoryWriter(folder / HISTORY_FILE, self.recorder.labels) if comm.rank == 0 else None

    def follow(self, plan: March, steps: Iterator[Step] | None, period: float | None) -> None:
        """Follow given steps, or march the plan.

        Args:
            plan: The march.
            steps: Its steps; None: march it, compiled where that is possible.
            period: That of the forcing, s, for the progress shown.

        Raises:
            RunError: The march failed, created energy or was interrupted; what was computed up to then is on disk.
        """
        case, count = self.model.case, plan.steps
        every = round((case.output.history_interval or plan.dt) / plan.dt)
        fields_every = max(1, round((case.output.fields_interval or case.time.end / 100.0) / plan.dt))
        self._write(self.recorder.row(self.start, self.accounts))
        self.fields.write(self.start, self.model)
        wanted = Wanted(every, fields_every, ends=True)
        if steps is None:
            stretches = marched(plan, self.start, self.accounts, self.recorder, wanted, self.comm)
        else:
            stretches = stretches_of(steps, count, self.accounts, self.recorder, wanted)
        clock = time.perf_counter()
        progress = ProgressLine(case.time.end, period, quiet=self.comm.rank != 0)
        try:
            with progress, Interruption(self.comm) as interruption:
                for stretch in stretches:
                    self._write(stretch.rows)
                    if stretch.done % fields_every == 0 or stretch.done == count:
                        self.fields.write(stretch.end, self.model)
                    progress.advance(stretch.time, stretch.steps, self._contact_words(stretch.pressure))
                    if stretch.done < count and interruption.asked:
                        raise Interrupted(
                            f"interrupted at t = {stretch.time:.6g} s of {case.time.end:g} s; "
                            "the results up to then are on disk"
                        )
        finally:
            self.accounts.tally.march = time.perf_counter() - clock

    def close(self) -> None:
        """Close the files."""
        if self.history is not None:
            self.history.close()
        self.fields.close()

    def _write(self, rows: Rows | None) -> None:
        if self.history is not None and rows is not None:
            self.history.append(rows)

    def _contact_words(self, pressure: Array) -> str:
        contact = self.model.system.contact
        pressed = pressure > 0.0
        closed = [name for face, name in enumerate(contact.face_names) if np.any(pressed[contact.faces == face])]
        return "contact: " + (" and ".join(closed) or "none")


def _forcing(case: Case) -> dict[str, float | None]:
    frequencies = {load.frequency for load in case.load if isinstance(load, Ramped)}
    frequency = frequencies.pop() if len(frequencies) == 1 else None
    return {"frequency": frequency, "period": 1.0 / frequency if frequency else None}


def _case_text(case: Case, used: dict[str, str]) -> str:
    made = ", ".join(f"{name} {version}" for name, version in used.items())
    return f"# As it was run, with every default, by {made}.\n{case_to_toml(case)}"
