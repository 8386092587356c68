"""One experiment with one set of values, in a process of its own: march, windows, figures."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, NamedTuple

from gapbeam.postprocess.results.records_in_memory import as_history
from gapbeam.postprocess.signals.period_windows import settled_windows
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.errors import OutOfMemory, RunError
from gapbeam.solver.faults import CaseError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.output.results_folder import finite
from gapbeam.studies.identification.identification_problem import Problem, Values
from gapbeam.studies.identification.identification_tables import Figure, ForceFigure, FrequencyFigure, MotionFigure
from gapbeam.studies.identification.measured_figures import (
    natural_frequency,
    read_figure,
    record_of,
    steps_between_records,
)
from gapbeam.studies.sweep.sweep_point import span
from gapbeam.studies.trials.kept_body import KeptBody
from gapbeam.studies.trials.response import VERDICTS, TrialResponse, respond
from gapbeam.studies.trials.starts import Start, kicked, seated

BODY = KeptBody()  # of this process
CYCLE_TOLERANCE = 0.01  # of the range: a response that repeats within it is called periodic
PASSED, NO_FIGURES, LOST = "passed", "no figures", "lost"
NOT_CONVERGED = 4
KICK_SEED = 0  # a kick is identified by its number

Record = dict[str, Any]


class Piece(NamedTuple):
    """One experiment with one set of values.

    Attributes:
        values: Of the unknowns.
        experiment: Its number.
        start: 0 the seat, else the number of a random kick.
    """

    values: Values
    experiment: int
    start: int = 0


class TrialJob(NamedTuple):
    """Pieces that one process computes one after the other."""

    problem: Problem
    case: Path
    pieces: tuple[Piece, ...]


def compute(job: TrialJob) -> list[Record]:
    """Return the record of each piece: its verdict and, where it passed, its figures with their scatter."""
    return [finite(_record(job, piece)) for piece in job.pieces]


def lost_pieces(job: TrialJob, words: str) -> list[Record]:
    """Return records of pieces whose workers were lost, with what happened in words."""
    what = {"verdict": LOST, "exit_status": OutOfMemory.exit_status, "message": f"its worker was lost: {words}"}
    return [_blank(piece) | what for piece in job.pieces]


def _blank(piece: Piece) -> Record:
    """Return the record of a piece of which nothing is known yet."""
    return {
        "values": list(piece.values),
        "experiment": piece.experiment,
        "start": piece.start,
        "verdict": PASSED,
        "response": "modes",
        "exit_status": 0,
        "message": "",
    }


def _record(job: TrialJob, piece: Piece) -> Record:
    clock, problem = time.perf_counter(), job.problem
    experiment = problem.experiments[piece.experiment]
    record = _blank(piece)
    marched = tuple(figure for figure in experiment.figures if not isinstance(figure, FrequencyFigure))
    begin: Start | None = None
    try:
        case = read_case(job.case, {**experiment.settings, **problem.settings(piece.values)})
        model = BODY.model(case)
        record["figures"] = _frequencies(model, experiment.figures)
        if marched:
            begin = kicked(model, piece.start, KICK_SEED) if piece.start else seated(model)
    except (CaseError, RunError) as error:
        verdict = "refused" if isinstance(error, CaseError) else VERDICTS.get(type(error), "failed")
        return record | {"verdict": verdict, "exit_status": error.exit_status, "message": str(error)}
    set_up = time.perf_counter() - clock
    seconds = {"set_up": set_up, "march": 0.0}
    if begin is not None:
        every = steps_between_records(marched, model.step, case.output.history_interval)
        steps, frequency = span(model)
        assert frequency is not None
        response = respond(model, begin.state, steps, every * model.step)
        record |= {
            name: getattr(response, name) for name in ("verdict", "exit_status", "message", "reached", "created")
        }
        seconds["march"] = response.seconds
        if response.verdict == PASSED:
            found = _figures(response, marched, frequency, problem.file.transient)
            record |= found | {"figures": record["figures"] | found.get("figures", {})}
    return record | {"seconds": seconds | {"all": time.perf_counter() - clock}}


def _frequencies(model: Model, figures: tuple[Figure, ...]) -> dict[str, Record]:
    return {
        figure.name: _as_data(natural_frequency(figure, model))
        for figure in figures
        if isinstance(figure, FrequencyFigure)
    }


def _as_data(one: WindowFigure) -> Record:
    return {"mean": one.mean, "scatter": one.scatter, "error": one.uncertainty, "unit": one.unit}


def _figures(
    response: TrialResponse, figures: tuple[MotionFigure | ForceFigure, ...], frequency: float, transient: float | None
) -> Record:
    """Return kind of response and figures; the records that they do not need are not read."""
    probes = [figure.probe for figure in figures if isinstance(figure, MotionFigure)]
    wanted = {"time", "displacement", "velocity", *map(record_of, figures)}
    history = as_history({name: response.history[name] for name in wanted}, response.labels)
    try:
        cycle, windows, notes = settled_windows(
            history, frequency, transient, CYCLE_TOLERANCE, list(dict.fromkeys(probes)) or None
        )
        found = {figure.name: _as_data(read_figure(figure, history, windows)) for figure in figures}
    except SignalError as fault:
        return {"verdict": NO_FIGURES, "exit_status": NOT_CONVERGED, "message": str(fault)}
    return {"response": cycle.word, "windows": [windows.periods, windows.count], "notes": notes, "figures": found}
