"""One run of a case: set-up, seat, march, outputs, verdict."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gapbeam.meshes.rank_zero import all_there, on_rank_zero
from gapbeam.meshes.versions.installed_versions import versions
from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case, Output, case_to_toml, with_checksums
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.solver.diagnostics.energy_ledger import balance_words
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, why_not_compiled
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.memory.memory_check import offer_simpler, out_of_memory_reported
from gapbeam.solver.messages.errors import Interrupted, NotConverged, NotWritten, RunError, UserError
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.models.energy_creation import accepted_energy_creators, refuse_energy_creators
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.run.checkpoint.checkpoints import Checkpoints, Left, remove_unasked, steps_between
from gapbeam.solver.run.checkpoint.resume import find_left, left_state, refuse_to_resume
from gapbeam.solver.run.interruption import Interruption, Signals, Wish
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output import run_summary as summaries
from gapbeam.solver.run.output.atomic_files import disk_reported, written
from gapbeam.solver.run.output.disk_space import check_space, size_of_results
from gapbeam.solver.run.output.progress import kept_lines, log_file
from gapbeam.solver.run.output.results_folder import (
    check_folder,
    locked,
    prepare_folder,
    write_case,
    write_summary,
)
from gapbeam.solver.run.rank_threads import crowded, threads_a_rank
from gapbeam.solver.run.run_consumers import RunConsumers
from gapbeam.solver.run.stop_rule import StopRule, refuse_not_met, statistics_words
from gapbeam.solver.run.verdict import describe_march, judge_curve, judge_run, remarks_on_model
from gapbeam.solver.schema.record_table import CASE_FILE, SUMMARY_FILE
from gapbeam.solver.seat.static_seat import Seat
from gapbeam.solver.system.semi_discrete import State

if TYPE_CHECKING:
    from mpi4py import MPI


def stopped_words(case: Case, stopped: Interrupted, going_on: bool) -> str:
    """Return the time at which a run was stopped and the next command, in one line.

    Args:
        case: The case.
        stopped: Reason for the stop.
        going_on: Whether it was about to continue from a checkpoint.
    """
    if going_on:
        return f"{stopped}; the checkpoints are as they were, `resume=True` continues from the last one"
    again = "start it again with `overwrite=True`" if isinstance(case.analysis, Periodic) else "`resume=True` starts it"
    return f"{stopped}; there is nothing to keep, {again}"


def left_behind(
    case: Case, folder: Path, comm: MPI.Comm, stopped: Interrupted, resume: bool, started: float
) -> dict[str, Any]:
    """Return the summary of a run that was stopped during its set-up, and write it where no earlier results are.

    Args:
        case: The case.
        folder: Results folder.
        comm: The ranks.
        stopped: Reason for the stop.
        resume: Whether it was to go on with earlier results.
        started: Reading of `time.perf_counter` at its start, s.

    Collective.
    """
    summary: dict[str, Any] = {
        "title": case.title,
        "status": "interrupted",
        "exit_status": stopped.exit_status,
        "message": stopped_words(case, stopped, False),
        "warnings": [],
        "versions": versions(),
        "wall_time": {"total": time.perf_counter() - started},
        "resumed": [],
    }
    try:
        on_rank_zero(comm, lambda: check_folder(folder, overwrite=False))
        with locked(folder, comm):
            on_rank_zero(comm, lambda: _write(folder, summary))
    except (UserError, NotWritten):  # earlier results, or no place: as they were
        summary["message"] = f"{stopped}; {folder} is as it was" + (", `resume=True` continues it" if resume else "")
    LOG.error("%s", summary["message"])
    return summary


def _write(folder: Path, summary: dict[str, Any]) -> None:
    prepare_folder(folder)
    with written(folder / SUMMARY_FILE):
        write_summary(folder, summary)


MARCHED = "the model was marched"


def run_case(
    case: Case,
    folder: Path,
    comm: MPI.Comm,
    overwrite: bool = False,
    resume: bool = False,
    rule: StopRule | None = None,
) -> Outcome:
    """Run a case into a results folder, or resume a run in it.

    Args:
        case: The case to run.
        folder: Folder for the results.
        comm: The ranks that share the work.
        overwrite: Replace the results of an earlier run.
        resume: Continue from its last checkpoint; from the start where it has none yet.
        rule: Rule by which the run may end before `time.end`; None: it does not.

    Returns:
        The outcome; its exit status is not zero when the run created energy, did not converge or was
        interrupted, and what was computed up to then is on disk.

    Raises:
        UserError: The folder holds results, cannot be written or has no room for them, a point lies outside the mesh,
            or scheme and contact are known to create energy and the case does not accept that.
        CaseError: The computed time step does not go with the rest of the case.
        RecordError: The record of a load cannot be used, or is another one than its checksum says.
        MeshError: The mesh file does not fit the case.

    Collective.
    """
    ends, case = comm if comm.size == 1 else comm.Dup(), with_checksums(case)
    with Signals(case.output.wall_time, comm.size == 1) as signals:
        try:
            with signals.turned():
                outcome = _run_case(case, folder, comm, ends, overwrite, resume, rule, signals)
        except Interrupted as stopped:
            signals.over()
            if comm.size > 1 and not all_there(ends):  # the others wait for this rank
                raise
            summary = left_behind(case, folder, comm, stopped, resume, signals.started)
            outcome = Outcome(folder, stopped.exit_status, summary["message"], summary)
    if comm.size > 1:
        ends.Free()
    return outcome


def _run_case(
    case: Case, folder: Path, comm: MPI.Comm, ends: MPI.Comm, overwrite: bool, resume: bool, rule: StopRule | None,
    signals: Signals,
) -> Outcome:  # fmt: skip
    """Run a case; where it is interrupted before anything is in the folder, that is raised."""
    on_rank_zero(comm, lambda: check_folder(folder, overwrite or resume, overwrite))
    if rule is not None:
        rule.refuse_misfit(case)
    if resume:
        refuse_to_resume(case)
    with out_of_memory_reported("the model was made"), kept_lines() as earlier:
        offer_simpler(case)
        model = build_model(case, comm)
    signals.check()
    refuse_energy_creators(case, model)
    if not isinstance(case.analysis, Periodic):
        sizes = size_of_results(case, model)
        on_rank_zero(comm, lambda: check_space(folder, *sizes))
    with locked(folder, comm):
        left = find_left(folder, case, model, comm) if resume else None
        if isinstance(left, dict):
            return Outcome(folder, 0, f"was done before: {left['message']}", left)
        consumers, begin = None, left_state(case, model, folder, comm) if left is None else None
        if left is None:
            on_rank_zero(comm, lambda: prepare_folder(folder))
        else:
            model = left.model
        case = model.case  # its step is a number
        if left is not None:  # or a refusal, before anything in the folder changes
            consumers = RunConsumers(case, model, folder, left, rule)
        with log_file(folder, comm, earlier):
            summary = _opening(case, model)
            together = cache(lambda: comm.size == 1 or all_there(ends))
            try:
                _write_opening(case, folder, comm, summary)
                with signals.turned(), disk_reported(folder), out_of_memory_reported(MARCHED):
                    _run(case, model, folder, comm, summary, left, begin, consumers, rule, signals, together)
            except RunError as error:
                if not together():  # the others wait for this rank
                    raise
                summary["status"] = error.run_status
                summary["exit_status"], summary["message"] = error.exit_status, str(error)
                summary["reason"] = error.reason
                if isinstance(error, Interrupted) and signals.heard != Wish.NONE and not signals.marching:
                    summary["message"] = stopped_words(case, error, left is not None)
                LOG.error("%s", summary["message"])
            except BaseException as error:
                summary["status"], summary["exit_status"] = "crashed", 1
                summary["message"] = f"{type(error).__name__}: {error}"
                if comm.rank == 0:
                    with suppress(OSError):
                        write_summary(folder, summary)
                raise
            summary["wall_time"]["total"] = time.perf_counter() - signals.started
            summary["memory"] = {"peak_per_rank": summaries.peak_memory(comm)}
            _close(folder, comm, summary, case.output, model.step)
    small = comm.size == 1 and not isinstance(case.model, FullModel)
    return Outcome(folder, summary["exit_status"], summary["message"], summary, model.body if small else None)


def _write_opening(case: Case, folder: Path, comm: MPI.Comm, summary: dict[str, Any]) -> None:
    def write() -> None:
        with written(folder / CASE_FILE):
            write_case(folder, case_to_toml(case), summary)

    on_rank_zero(comm, write)


def _close(folder: Path, comm: MPI.Comm, summary: dict[str, Any], output: Output, step: float) -> None:
    """Write the summary; of a run that is done, the checkpoints go, unless they are kept. Collective."""

    def write() -> None:
        with written(folder / SUMMARY_FILE):
            write_summary(folder, summary)
            if summary["status"] == "completed":
                remove_unasked(folder, output, step)

    try:
        on_rank_zero(comm, write)
    except NotWritten as error:
        LOG.error("%s", error)
        if summary["exit_status"] == 0:
            summary["status"], summary["exit_status"], summary["message"] = "failed", error.exit_status, str(error)


def _opening(case: Case, model: Model) -> dict[str, Any]:
    """Return the summary of a run that has only been set up, and log it."""
    contact = model.system.contact
    crowding = filter(None, [crowded(model.space.mesh.comm)])
    summary: dict[str, Any] = {
        "title": case.title,
        "status": "running",
        "exit_status": None,
        "reason": None,
        "message": "",
        "warnings": [*warnings(case), *accepted_energy_creators(model), *remarks_on_model(case, model), *crowding],
        "versions": versions() | model.body.made_by,
        "forcing": _forcing(case),
        "smoothing": dict(zip(("window", "reason"), smoothing_window(case), strict=True)),
        "model": summaries.describe_model(case, model),
        "defaults": [vars(default) for default in model.defaults],
        "wall_time": dict(model.body.seconds),
        "resumed": [],
    }
    for warning in summary["warnings"]:
        LOG.warning("%s", warning)
    LOG.debug(
        "%d DOFs, %d contact points on %d interface DOFs, ranks: %d, threads a rank: %d",
        model.dofs,
        contact.size,
        contact.interface.size,
        summary["model"]["ranks"],
        threads_a_rank(),
    )
    return summary


def _run(
    case: Case,
    model: Model,
    folder: Path,
    comm: MPI.Comm,
    summary: dict[str, Any],
    left: Left | None,
    begin: State | None,
    consumers: RunConsumers | None,
    rule: StopRule | None,
    signals: Signals,
    together: Callable[[], bool],
) -> None:
    """Seat and march; fill the summary, also where the march ends with an error that all ranks have."""
    simulation = Simulation(model)
    plan = simulation.plan
    summary["wall_time"] |= simulation.factor()
    reason = why_not_compiled(plan)
    summary["loop"] = "compiled" if reason is None else f"step by step: {reason}"
    interruption = Interruption(comm, signals)
    checkpoints, steps, response = None, None, None
    if left is not None:
        _log_resumed(left, summary)
    else:
        seat = _seated(simulation, summary)
        start = simulation.start(seat, begin)
        signals.check()
    if reason is None:  # marches of a search use the loop, too
        clock = time.perf_counter()
        CompiledLoop.compile_ahead(plan, start if left is None else left.paused, signals.check)
        summary["wall_time"]["compilation"] = time.perf_counter() - clock
    if left is None and isinstance(case.analysis, Periodic):
        from gapbeam.solver.periodic.periodic_response import ProbeFigures
        from gapbeam.solver.run.periodic_search import search

        signals.march_begins()
        assert isinstance(seat, Seat)
        response = search(model, seat.state, case.analysis, folder, comm, summary, interruption)
        steady, start = response.steady, response.start
        case, model, plan = steady.case, steady.model, steady.plan
        probes = ProbeFigures(model)
        steps = probes.listening(response.steps)
    if response is None:
        kept = {"seat": summary["seat"], "resumed": summary["resumed"], "every": steps_between(case, model.step)}
        checkpoints = Checkpoints(folder, case, model, comm, kept)
    consumers = consumers or RunConsumers(case, model, folder, start, rule)
    signals.march_begins()
    try:
        with out_of_memory_reported(MARCHED), consumers:
            consumers.follow(plan, steps, summary["forcing"]["period"], interruption, checkpoints)
    except RunError:
        if together():
            describe_march(summary, consumers)
        raise
    finally:
        if response is not None:
            summary["periodic"]["probes"] = probes.figures(response.steady.periods)
    findings = describe_march(summary, consumers)
    accounts = consumers.accounts
    judge_run(case, accounts, findings)
    judge_curve(summary.get("periodic", {}).get("curve"))
    refuse_not_met(summary.get("statistics", {}).get("until"))
    summary["status"], summary["exit_status"] = "completed", 0
    summary["message"] = (
        f"{counted(accounts.tally.steps, 'step')}, {balance_words(accounts.ledger)}{statistics_words(summary)}"
    )


def _seated(simulation: Simulation, summary: dict[str, Any]) -> Seat | NotConverged:
    clock, start = time.perf_counter(), simulation.case.analysis.start_words
    seat = simulation.seat_or_failure()
    if isinstance(seat, NotConverged):
        summary["seat"] = {}
        summary["warnings"].append(f"no static seat was found, and none is needed: the run starts {start}")
        LOG.warning("%s", summary["warnings"][-1])
        return seat
    summary["seat"] = summaries.describe_seat(seat, simulation.model)
    summary["wall_time"]["seat"] = time.perf_counter() - clock
    forces = {name: summary["seat"][f"{name}_force"] for name in simulation.model.system.contact.face_names}
    rests = ", ".join(f"{name} ({force:.3g} N)" for name, force in forces.items() if force > 0.0)
    LOG.info("at rest the beam %s", f"presses on {rests}" if rests else "touches no support")
    LOG.debug("seated in %d iterations, deepest %.3g m", seat.iterations, summary["seat"]["largest_penetration"])
    return seat


def _log_resumed(left: Left, summary: dict[str, Any]) -> None:
    state = left.paused.state
    summary["seat"], summary["resumed"] = left.header["seat"], [*left.header["resumed"], state.time]
    bits = "to the same bits" if left.exact else "to round-off: other ranks, or another machine, than before"
    LOG.info("continues from t = %.6g s, step %d, %s", state.time, left.paused.done, bits)


def _forcing(case: Case) -> dict[str, float | None]:
    frequencies = forcing_frequencies(case.load)
    frequency = frequencies[0] if len(frequencies) == 1 else None
    return {"frequency": frequency, "period": 1.0 / frequency if frequency else None}
