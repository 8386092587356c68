"""Trials: runs of a case that leave no files but figures and a verdict, one or at every point of a grid."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.errors import CaseError, RunError
from gapbeam.solver.march.simulation import Simulation
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.study_journal import StudyJournal
from gapbeam.studies.engine.worker_memory import worker_memory
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.trials.axes import Axis, overrides_of, points_of
from gapbeam.studies.trials.response import TrialResponse, respond


@dataclass
class Trial:
    """Result of a run.

    Attributes:
        verdict: "passed", "energy created", "not converged", "not finite", "refused", "failed" or "lost".
        message: The error, where there was one.
        reached: Time up to which it went, s.
        created: Energy created relative to the energy exchanged; round-off counts as none.
        residual: Residual of the energy balance relative to the energy exchanged.
        lost: Energy that the scheme dissipated relative to the energy exchanged.
        penetration: Largest penetration, m.
        relative_penetration: The same relative to the clearance, or None.
        peak_force: Largest contact force on a face, N.
        iterations: Mean number of contact iterations of a step.
        most_iterations: The most in a step.
        seconds: Wall time, s.
    """

    verdict: str = "passed"
    message: str = ""
    reached: float = 0.0
    created: float = 0.0
    residual: float = 0.0
    lost: float = 0.0
    penetration: float = 0.0
    relative_penetration: float | None = None
    peak_force: float = 0.0
    iterations: float = 0.0
    most_iterations: int = 0
    seconds: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the figures by name."""
        return asdict(self)


def try_case(case: Case) -> Trial:
    """Run a case on this process alone and judge it; a run that fails is a result, not an error."""
    started = time.perf_counter()
    response = TrialResponse()
    try:
        simulation = Simulation.of_case(case, MPI.COMM_SELF)
        response = respond(simulation.model, simulation.start(simulation.seat()), simulation.steps)
    except RunError as error:
        response.failed(error)
    clearance = abs(case.layout.clearance)
    marched = clearance > 0.0 and response.steps > 0
    return Trial(
        response.verdict,
        response.message,
        response.reached,
        response.created,
        response.residual,
        response.lost,
        response.penetration,
        response.penetration / clearance if marched else None,
        response.peak_force,
        response.iterations,
        response.most_iterations,
        time.perf_counter() - started,
    )


LOST = "lost"


class GridRow(NamedTuple):
    """One point of the grid: its values in the order of the axes, and its result."""

    values: tuple[str, ...]
    trial: Trial


def run_grid(
    case: Path,
    fixed: Sequence[str],
    axes: Sequence[Axis],
    workers: Workers | None = None,
    progress: Callable[[int, int], None] | None = None,
    journal: Path | None = None,
) -> list[GridRow]:
    """Try a case at every point of a grid.

    Args:
        case: Path of the case file.
        fixed: Overrides of every point, KEY=VALUE.
        axes: Axes of the study.
        workers: Where; by default one a core of this machine.
        progress: Called with the number of points done and all.
        journal: File of the trials that are done, with which a killed grid goes on; it goes when all are. None: none.

    Returns:
        One row a point, in the order of the product of the axes; a point whose case has faults has the verdict
        "refused".

    Raises:
        CaseError: The case has faults at every point; those of the first are reported.
        UserError: The grid is too large.
        NotWritten: The journal cannot be written.
    """
    points = points_of(axes)
    works = [(case.absolute(), overrides_of(axes, point, fixed)) for point in points]
    cases = [_read(work) for work in works]
    if all(isinstance(one, CaseError) for one in cases):
        read_case(*works[0])
    sound = [one for one in cases if isinstance(one, Case)]
    kept = None if journal is None else StudyJournal(journal, _plan(axes, sound))
    done = {} if kept is None else {place: Trial(**record) for place, record in kept.kept.items()}
    missing = [place for place in range(len(works)) if place not in done]

    def tick() -> None:
        if progress is not None:
            progress(len(done), len(points))

    tick()
    folder = None if journal is None else journal.parent
    with Engine(workers, len(missing), worker_memory(sound), folder) as engine:
        for number, trial in engine.done(_try_point, [works[place] for place in missing], tick, _lost):
            done[missing[number]] = trial
            if kept is not None and trial.verdict != LOST:
                kept.write(missing[number], trial.as_dict())
            tick()
    if kept is not None and all(trial.verdict != LOST for trial in done.values()):
        kept.close()
    return [GridRow(point, done[place]) for place, point in enumerate(points)]


def _read(work: tuple[Path, list[str]]) -> Case | CaseError:
    try:
        return read_case(*work)
    except CaseError as error:
        return error


def _plan(axes: Sequence[Axis], cases: Sequence[Case]) -> dict[str, Any]:
    """Return the inputs of trials."""
    tables = [case.model_dump(mode="json") for case in cases]
    return {
        "gapbeam": version("gapbeam"),
        "axes": [[axis.key, *axis.values] for axis in axes],
        "cases": hashlib.sha256(json.dumps(tables, sort_keys=True).encode()).hexdigest(),
    }


def _lost(_work: tuple[Path, list[str]], words: str) -> Trial:
    return Trial(verdict=LOST, message=f"its worker was lost: {words}")


def _try_point(work: tuple[Path, list[str]]) -> Trial:
    try:
        read = read_case(*work)
    except CaseError as error:
        return Trial(verdict="refused", message=str(error))
    return try_case(read)


def table(rows: Sequence[GridRow], axes: Sequence[Axis]) -> list[dict[str, Any]]:
    """Return the grid as one flat record a point."""
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, row.values, strict=True)) | row.trial.as_dict() for row in rows]
