"""Response of a model to its loads from some start, or at every point of a grid: figures and verdict, no files."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.meshes.rank_zero import ONE_RANK
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.assumption import Finding, content_of_history
from gapbeam.solver.diagnostics.energy_gates import remedy_for
from gapbeam.solver.diagnostics.history_rows import Recorder, Rows
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts
from gapbeam.solver.march.simulation import Simulation, Wanted, marched
from gapbeam.solver.messages.errors import (
    AssumptionBroken,
    CaseError,
    EnergyCreated,
    EnergyLost,
    Interrupted,
    NotConverged,
    NotFinite,
    RunError,
    UserError,
)
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.frequency_findings import RESONANT
from gapbeam.solver.run.assumptions.pose_rows import gauges_of, watch_of
from gapbeam.solver.run.verdict import assumptions, doubts_of, judge_run
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State
from gapbeam.studies.trials.axes import Axis, overrides_of, points_of

if TYPE_CHECKING:
    from gapbeam.studies.engine.workers import Workers

VERDICTS: dict[type[Exception], str] = {
    CaseError: "refused",
    AssumptionBroken: "assumption broken",
    EnergyCreated: "energy created",
    EnergyLost: "energy lost",
    NotConverged: "not converged",
    NotFinite: "not finite",
    UserError: "refused",
}


@dataclass
class TrialResponse:
    """Response of a model from a start.

    Attributes:
        verdict: "passed", one of VERDICTS, or "failed".
        message: The error, where there was one.
        exit_status: 0, or the error's own.
        reached: Time up to which it went, s.
        history: Records by name, (records, ...), as in `record_table.HISTORY`, and "time"; empty where none
            were asked for.
        labels: Names along the labeled dimensions of the records.
        end: The state at the end of the last whole step, of the model or the scene.
        created: Energy created relative to the energy exchanged; round-off counts as none.
        residual: Residual of the energy balance relative to the energy exchanged.
        lost: Energy that the scheme dissipated relative to the energy exchanged.
        penetration: Largest penetration, m.
        relative_penetration: The same relative to the clearance of the case, of `try_case`.
        peak_force: Largest contact force on a face, N.
        iterations: Mean number of contact iterations of a step.
        most_iterations: The most in a step.
        steps: Accepted steps.
        seconds: Wall time of the march, s.
        findings: Findings on the assumptions, where they were watched.
        statistics: Statistics of the motion, where they were asked for.
    """

    verdict: str = "passed"
    message: str = ""
    exit_status: int = 0
    reached: float = 0.0
    history: dict[str, Array] = field(default_factory=dict)
    labels: dict[str, tuple[str, ...]] = field(default_factory=dict)
    end: Any = None
    created: float = 0.0
    residual: float = 0.0
    lost: float = 0.0
    penetration: float = 0.0
    relative_penetration: float | None = None
    peak_force: float = 0.0
    iterations: float = 0.0
    most_iterations: int = 0
    steps: int = 0
    seconds: float = 0.0
    findings: Sequence[Finding] = ()
    statistics: RunStatistics | None = None
    doubts: Doubts | None = None

    def failed(self, error: RunError) -> None:
        """Take in the error that ended the march."""
        self.verdict, self.message = VERDICTS.get(type(error), "failed"), str(error)
        self.exit_status = error.exit_status


def respond(
    model: Model,
    start: State,
    steps: int,
    interval: float | None = None,
    longest: float | None = None,
    watched: bool = False,
    rings: bool = False,
    statistics: RunStatistics | None = None,
) -> TrialResponse:
    """March a model from a start.

    Args:
        model: The model.
        start: Its state at the start, at any time.
        steps: Number of whole steps.
        interval: Time between records, s, a whole number of steps; None records nothing.
        longest: Wall time after which the march stops, in its place, with what it has up to then, s; on one rank.
        watched: Judge it as a run is judged: by its assumptions, and by the energy that the scheme took, too. The
            pose is looked at where there are records.
        rings: Whether free vibration from the start is part of it: the amplitude of a resonance is then no figure.
        statistics: Statistics of the records, which have their own interval; None: none are gathered.

    Returns:
        The response; where it cannot be trusted, or did not converge, it has the reason and the part computed so far.

    Collective.
    """
    response, clock = TrialResponse(statistics=statistics), time.perf_counter()
    try:
        deadline = None if longest is None else clock + longest
        _march(model, start, steps, interval, response, deadline, watched, rings)
    except Interrupted:
        raise
    except RunError as error:
        response.failed(error)
    response.seconds = time.perf_counter() - clock
    return response


def _march(
    model: Model,
    start: State,
    steps: int,
    interval: float | None,
    response: TrialResponse,
    deadline: float | None,
    watched: bool,
    rings: bool,
) -> None:
    simulation = Simulation(model)
    case, plan = simulation.case, replace(simulation.plan, steps=steps)
    accounts = Accounts.opened(model.system, model.law, start, plan.dt, case.gates, remedy_for(case))
    watch = watch_of(case, model) if watched else None
    recorder = Recorder(case, model, watch, gauges_of(case, model), response.statistics)
    every = None if interval is None else max(1, round(interval / plan.dt))
    rows = [] if every is None else [recorder.row(start, accounts)]
    try:
        for step_block in marched(plan, start, accounts, recorder, Wanted(every), model.space.mesh.comm):
            response.end = step_block.end
            if step_block.rows is not None:
                rows.append(step_block.rows)
            if deadline is not None and time.perf_counter() > deadline:
                break
    finally:
        response.labels = recorder.labels
        response.history = stacked(rows)
        response.steps = accounts.tally.steps
        if response.steps:
            _figures(response, accounts)
        if response.statistics is not None:
            response.doubts = doubts_of(case, accounts)
    if not watched:
        accounts.gates.judge(case.time.scheme.type, accounts.ledger)
        return
    content = content_of_history(response.history, [load.static for load in model.system.loads])
    findings = assumptions(recorder, accounts, content)
    response.findings = [one for one in findings if not (rings and one.assumption.name == RESONANT.name)]
    judge_run(case, accounts, response.findings)


def _figures(response: TrialResponse, accounts: Accounts) -> None:
    ledger, tally = accounts.ledger, accounts.tally
    scale = ledger.exchanged if ledger.exchanged > 0.0 else np.nan
    response.reached = accounts.time
    response.created, response.residual = accounts.gates.growth(ledger), ledger.residual / scale
    response.lost = ledger.algorithmic / scale
    response.penetration = float(accounts.peaks.deepest.max())
    response.peak_force = float(accounts.peaks.force.max())
    response.iterations, response.most_iterations = tally.iterations / tally.steps, tally.most_iterations


def stacked(rows: list[Rows]) -> dict[str, Array]:
    """Return the records of many times by name, (times, ...)."""
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]} if rows else {}


FIGURES = (
    "verdict", "message", "reached", "created", "residual", "lost", "penetration", "relative_penetration", "peak_force",
    "iterations", "most_iterations", "seconds",
)  # fmt: skip
"""Figures of a response that the record of a trial holds."""


def try_case(case: Case) -> TrialResponse:
    """Run a case on this process alone and judge it; a run that fails is a result, not an error."""
    started = time.perf_counter()
    response = TrialResponse()
    try:
        simulation = Simulation.of_case(case, ONE_RANK)
        response = respond(simulation.model, simulation.start(simulation.seat()), simulation.steps)
    except RunError as error:
        response.failed(error)
    clearance = abs(case.layout.clearance)
    if clearance > 0.0 and response.steps > 0:
        response.relative_penetration = response.penetration / clearance
    response.seconds = time.perf_counter() - started
    return response


LOST = "lost"


def run_grid(
    case: Path,
    fixed: Sequence[str],
    axes: Sequence[Axis],
    workers: Workers | None = None,
    progress: Callable[[int, int], None] | None = None,
    journal: Path | None = None,
    sound: Sequence[Case] = (),
) -> list[dict[str, Any]]:
    """Try a case at every point of a grid.

    Args:
        case: Path of the case file.
        fixed: Overrides of every point, KEY=VALUE.
        axes: Axes of the study.
        workers: Workers that compute; by default one a core of this machine.
        progress: Called with the number of points done and all.
        journal: File of the trials that are done, with which a killed grid goes on; it goes when all are. None: none.
        sound: Cases without faults, of `sound_cases`, where they were read before.

    Returns:
        One flat record a point, keys and then `FIGURES`, in the order of the product of the axes; a point whose case
        has faults has the verdict "refused".

    Raises:
        CaseError: The case has faults at every point; those of the first are reported.
        UserError: The grid is too large.
        NotWritten: The journal cannot be written.
    """
    from gapbeam.studies.engine.study_engine import Engine
    from gapbeam.studies.engine.study_journal import StudyJournal
    from gapbeam.studies.engine.worker_memory import worker_memory

    points = points_of(axes)
    works = [(case.absolute(), overrides_of(axes, point, fixed)) for point in points]
    sound = sound or sound_cases(case, fixed, axes)
    kept = None if journal is None else StudyJournal(journal)
    done = {} if kept is None else dict(kept.kept)
    missing = [place for place in range(len(works)) if place not in done]

    def tick() -> None:
        if progress is not None:
            progress(len(done), len(points))

    tick()
    folder = None if journal is None else journal.parent
    with Engine(workers, len(missing), worker_memory(sound), folder) as engine:
        for number, trial in engine.done(_try_point, [works[place] for place in missing], tick, _lost):
            done[missing[number]] = trial
            if kept is not None and trial["verdict"] != LOST:
                kept.write(missing[number], trial)
            tick()
    if kept is not None and all(trial["verdict"] != LOST for trial in done.values()):
        kept.close()
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, point, strict=True)) | done[place] for place, point in enumerate(points)]


def sound_cases(case: Path, fixed: Sequence[str], axes: Sequence[Axis]) -> list[Case]:
    """Read a case at every point of a grid, and return those without faults.

    Raises:
        CaseError: The case has faults at every point; those of the first are reported.
    """
    points, found = points_of(axes), list[Case]()
    for point in points:
        with suppress(CaseError):
            found.append(read_case(case.absolute(), overrides_of(axes, point, fixed)))
    return found or [read_case(case.absolute(), overrides_of(axes, points[0], fixed))]


def _recorded(response: TrialResponse) -> dict[str, Any]:
    return {name: getattr(response, name) for name in FIGURES}


def _lost(_work: tuple[Path, list[str]], words: str) -> dict[str, Any]:
    return _recorded(TrialResponse(LOST, f"its worker was lost: {words}"))


def _try_point(work: tuple[Path, list[str]]) -> dict[str, Any]:
    try:
        read = read_case(*work)
    except CaseError as error:
        return _recorded(TrialResponse("refused", str(error)))
    return _recorded(try_case(read))
