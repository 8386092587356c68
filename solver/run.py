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

from meshes.rank_zero import on_rank_zero
from solver.analyses.static import find_seat
from solver.analyses.transient import March, march
from solver.case import BaseMotion, Case, HarmonicForce
from solver.case_file.warnings import warnings
from solver.case_file.writer import case_to_toml
from solver.case_tables.analysis import Periodic
from solver.energy import Ledger, enter_step, open_ledger, restate
from solver.energy_creators import accepted_energy_creators, refuse_energy_creators
from solver.episodes import Episodes
from solver.errors import Interrupted, RunError
from solver.gates import EnergyGates
from solver.integrators.schemes import make_integrator
from solver.interruption import Interruption
from solver.march_of_model import march_of_model
from solver.model import Model, build_model
from solver.output import summary as summaries
from solver.output.fields import FieldWriter
from solver.output.folder import check_folder, prepare_folder, write_beside
from solver.output.history import HistoryWriter
from solver.output.log_file import log_file
from solver.output.progress import ProgressLine
from solver.output.records import CASE_FILE, HISTORY_FILE
from solver.output.rows import Recorder
from solver.periodic.probe_figures import ProbeFigures
from solver.periodic.searching import search
from solver.system import State, Step
from solver.tally import Tally
from solver.verdict import balance_words, contact_words, figures, friction_words, judge, remarks, resolution_remarks

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
        UserError: The folder holds results or cannot be written, a point lies outside the mesh, or scheme and contact
            are known to create energy and the case does not accept that.
        CaseError: The computed time step does not go with the rest of the case.
        MeshError: The mesh file does not fit the case.

    Collective.
    """
    started = time.perf_counter()
    on_rank_zero(comm, lambda: check_folder(folder, overwrite))
    model = build_model(case, comm)
    refuse_energy_creators(model)
    on_rank_zero(comm, lambda: prepare_folder(folder))
    with log_file(folder, comm):
        summary = _opening(model)
        if comm.rank == 0:
            write_beside(folder / CASE_FILE, _case_text(model.case, summary["versions"]))
            summaries.write_summary(folder, summary)
        try:
            _run(model, folder, comm, summary)
        except RunError as error:
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
    return Outcome(folder, summary["exit_status"], summary["message"], summary)


def _opening(model: Model) -> dict[str, Any]:
    """Return the summary of a run that has only been set up, and log it."""
    case, contact = model.case, model.system.contact
    summary: dict[str, Any] = {
        "title": case.title,
        "status": "running",
        "exit_status": None,
        "message": "",
        "warnings": [*warnings(case), *accepted_energy_creators(model)],
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
    start, steps, response = seat.state, march(plan, seat.state), None
    if isinstance(model.case.analysis, Periodic):
        response = search(model, seat.state, model.case.analysis, folder, comm, summary)
        model, plan, start, steps = response.steady.model, response.steady.plan, response.start, response.steps
    probes = ProbeFigures(model)
    course = Course(model, folder, comm, start)
    try:
        course.follow(plan, probes.listening(steps) if response else steps, summary["forcing"]["period"])
    finally:
        course.close()
        if response is not None:
            summary["periodic"]["probes"] = probes.told(response.steady.periods)
        summary |= figures(model, course.recorder, course.ledger, course.gates)
        summary["contact_episodes"] = course.episodes.figures()
        summary["convergence"] = course.tally.convergence()
        summary["wall_time"] |= course.tally.seconds()
        noted = remarks(model, course.recorder, course.episodes, course.ledger, course.gates)
        noted += resolution_remarks(model, course.tally)
        summary["warnings"] += noted
        LOG.info("%s", contact_words(model, course.recorder))
        if model.law.friction is not None:
            LOG.info("%s", friction_words(course.recorder, course.ledger))
        for remark in noted:
            LOG.warning("%s", remark)
    judge(model, course.ledger, course.gates)
    summary["status"], summary["exit_status"] = "completed", 0
    summary["message"] = f"{course.tally.steps} steps, {balance_words(course.ledger)}"


class Course:
    """A march and everything that consumes its steps: ledger, gates, history, fields, progress.

    Collective to make and to use.

    Attributes:
        fields: Where fields go.
        tally: What the march cost.
    """

    def __init__(self, model: Model, folder: Path, comm: MPI.Comm, start: State) -> None:
        self.model, self.comm, self.start = model, comm, start
        self.recorder, self.episodes = Recorder(model), Episodes(model.system.contact)
        self.gates = EnergyGates(model.case.gates, model.system.contact)
        self.ledger: Ledger = open_ledger(model.system, model.law, start)
        self.tally = Tally(model.step)
        self.fields = FieldWriter(folder, model)
        self.history = HistoryWriter(folder / HISTORY_FILE, self.recorder.labels) if comm.rank == 0 else None

    def follow(self, plan: March, steps: Iterator[Step], period: float | None) -> None:
        """Take in every step of a march.

        Args:
            plan: The march.
            steps: Its steps.
            period: That of the forcing, s, for the progress shown.

        Raises:
            RunError: The march failed, created energy or was interrupted; what was computed up to then is on disk.
        """
        case = self.model.case
        every = round((case.output.history_interval or plan.dt) / plan.dt)
        fields_every = max(1, round((case.output.fields_interval or case.time.end / 100.0) / plan.dt))
        self._record(self.start)
        self.fields.write(self.start, self.model)
        clock, done = time.perf_counter(), 0
        progress = ProgressLine(case.time.end, period, quiet=self.comm.rank != 0)
        try:
            with progress, Interruption(self.comm) as interruption:
                mark = clock
                for step in steps:
                    self._take(step, time.perf_counter() - mark)
                    if step.completes:
                        done += 1
                        state = step.refreshed or step.new
                        if done % every == 0 or done == plan.steps:
                            self._record(state)
                        if done % fields_every == 0 or done == plan.steps:
                            self.fields.write(state, self.model)
                        progress.advance(state.time, self._contact_words(step))
                        if done < plan.steps and interruption.asked:
                            raise Interrupted(
                                f"interrupted at t = {state.time:.6g} s of {case.time.end:g} s; "
                                "the results up to then are on disk"
                            )
                    mark = time.perf_counter()
        finally:
            self.tally.march = time.perf_counter() - clock

    def close(self) -> None:
        """Close the files."""
        if self.history is not None:
            self.history.close()
        self.fields.close()

    def _take(self, step: Step, seconds: float) -> None:
        system, law = self.model.system, self.model.law
        self.ledger = enter_step(system, law, self.ledger, step)
        if step.refreshed is not None:
            self.ledger = restate(system, law, self.ledger, step.refreshed)
        self.recorder.see(step)
        self.episodes.watch(step)
        self.tally.see(step, seconds)
        self.gates.check(step, self.ledger)

    def _record(self, state: State) -> None:
        row = self.recorder.row(state, self.ledger)
        if self.history is not None:
            self.history.append(row)

    def _contact_words(self, step: Step) -> str:
        contact = self.model.system.contact
        pressed = step.new.pressure > 0.0
        closed = [name for face, name in enumerate(contact.face_names) if np.any(pressed[contact.faces == face])]
        return "contact: " + (" and ".join(closed) or "none")


def _forcing(case: Case) -> dict[str, float | None]:
    frequencies = {load.frequency for load in case.load if isinstance(load, HarmonicForce | BaseMotion)}
    frequency = frequencies.pop() if len(frequencies) == 1 else None
    return {"frequency": frequency, "period": 1.0 / frequency if frequency else None}


def _case_text(case: Case, used: dict[str, str]) -> str:
    made = ", ".join(f"{name} {version}" for name, version in used.items())
    return f"# As it was run, with every default, by {made}.\n{case_to_toml(case)}"
