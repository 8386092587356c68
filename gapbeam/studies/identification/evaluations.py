"""Evaluations of an identification and their figures: each set of values once, in parallel, on disk when it is done.

An experiment is marched in a process of its own: march, windows, figures.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gapbeam.postprocess.results.bounded_files import read_plain
from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.postprocess.signals.steady_figures import WindowFigure, settled_windows
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.value_words import flat
from gapbeam.solver.messages.errors import CaseError, OutOfMemory, RunError
from gapbeam.solver.messages.wording import counted, printable
from gapbeam.solver.models.body import body_key
from gapbeam.solver.run.output.results_folder import finite
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.identification.identification_file import FloatArray, Problem, Values
from gapbeam.studies.identification.identification_tables import ForceFigure, FrequencyFigure, MotionFigure
from gapbeam.studies.identification.run_figures import (
    Shifted,
    end_of_run,
    figure_slopes,
    natural_frequency,
    read_figure,
    record_of,
    steps_between_records,
)
from gapbeam.studies.study_folder import REMEDY, StoredPiece, StudyPlan, checked, study_written
from gapbeam.studies.trials.response import VERDICTS, TrialResponse, respond
from gapbeam.studies.trials.starts import KeptBody, Start, kicked, seated, span

BODY = KeptBody()  # of this process
CYCLE_TOLERANCE = 0.01  # of the range: a response that repeats within it is called periodic
PASSED, NO_FIGURES, LOST = "passed", "no figures", "lost"
NOT_CONVERGED = 4
KICK_SEED = 0  # a kick is identified by its number

Record = dict[str, Any]


class Piece(NamedTuple):
    """One experiment with one set of values.

    Attributes:
        values: Values of the unknowns.
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
    """Return records of pieces whose workers were lost, with the cause in words."""
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
        record["figures"] = {
            figure.name: _as_data(natural_frequency(figure, model))
            for figure in experiment.figures
            if isinstance(figure, FrequencyFigure)
        }
        if marched:
            begin = kicked(model, case.load, piece.start, KICK_SEED) if piece.start else seated(model)
    except (CaseError, RunError) as error:
        verdict = VERDICTS.get(type(error), "failed")
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
            if piece.start == 0 and record.get("cycle") is not None:
                record["end"] = end_of_run(model, response.end)
    return record | {"seconds": seconds | {"all": time.perf_counter() - clock}}


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
    return {
        "response": cycle.word,
        "cycle": cycle.period,
        "windows": [windows.periods, windows.count],
        "notes": notes,
        "figures": found,
    }


class SlopeJob(NamedTuple):
    """Derivatives of the figures of one experiment, beside a run of it.

    Attributes:
        problem: The identification.
        case: Its case file.
        record: Record of the run.
        places: Places below and above the values, for each unknown, (2, n).
    """

    problem: Problem
    case: Path
    record: Record
    places: tuple[FloatArray, ...]


def compute_slopes(job: SlopeJob) -> dict[str, list[float | None]]:
    """Return derivatives of figures by the coordinates, by name; empty where the response has none.

    They cost some periods, and no run.
    """
    problem, record = job.problem, job.record
    experiment, z = problem.experiments[record["experiment"]], problem.scaled(tuple(record["values"]))
    figures = [figure for figure in experiment.figures if not isinstance(figure, FrequencyFigure)]

    def case_at(values: Values) -> Any:
        return read_case(job.case, {**experiment.settings, **problem.settings(values)})

    try:
        here, shifted = case_at(tuple(record["values"])), list[Shifted | None]()
        for number, pair in enumerate(job.places):
            values = [problem.values(row) for row in pair]
            cases = [case_at(row) for row in values]
            far = [float(problem.scaled(row)[number] - z[number]) for row in values]
            if far[0] == far[1] or any(body_key(one) != body_key(here) for one in cases):
                shifted.append(None)
                continue
            low, high = (BODY.model(one) for one in cases)
            shifted.append(((far[0], low), (far[1], high)))
        found = figure_slopes(BODY.model(here), np.array(record["end"]), record["cycle"], figures, shifted)
    except (CaseError, RunError, SignalError):
        return {}
    for figure in experiment.figures:
        if isinstance(figure, FrequencyFigure):
            found[figure.name] = [None if one is None else _frequency_slope(figure, one) for one in shifted]
    return found


def _frequency_slope(figure: FrequencyFigure, pair: Shifted) -> float:
    (low, below), (high, above) = pair
    return (natural_frequency(figure, above).mean - natural_frequency(figure, below).mean) / (high - low)


def no_slopes(_job: SlopeJob, _words: str) -> dict[str, list[float | None]]:
    """Return that nothing was found, of a job whose workers were lost."""
    return {}


LOG_FILE, CASE_FILE = "evaluations.jsonl", "case.toml"
RESULT_FILES = ("identification.json", "identified.toml", "identified-case.toml", "evaluations.csv")
FORMAT = 1


class Evaluations:
    """The evaluations in a folder, and the engine that adds to them.

    Attributes:
        problem: The identification.
        folder: Its folder.
        computed: Pieces computed by this call.

    Args:
        problem: The identification.
        folder: Its folder.
        engine: Engine that computes them.
        reported: Called after every piece that was computed.
    """

    def __init__(
        self, problem: Problem, folder: Path, engine: Engine, difference: Callable[[], None] = lambda: None
    ) -> None:
        self.problem, self.folder, self.computed = problem, folder, 0
        self._engine, self._report = engine, difference
        self._records = _read_log(folder / LOG_FILE, problem)
        self._slopes: dict[Piece, dict[str, list[float | None]]] = {}

    @property
    def records(self) -> list[Record]:
        """All records, in the order in which they were computed."""
        return list(self._records.values())

    def of(self, points: Sequence[Values], experiments: Iterable[int], start: int = 0) -> list[list[Record]]:
        """Return the records of sets of values, a list of one for each experiment; missing ones are computed."""
        wanted = [[Piece(values, number, start) for number in experiments] for values in points]
        missing = list(dict.fromkeys(piece for row in wanted for piece in row if piece not in self._records))
        if missing:
            self._compute(missing)
        return [[self._records[piece] for piece in row] for row in wanted]

    def slopes(
        self, values: Values, experiments: Sequence[int], places: Sequence[FloatArray]
    ) -> list[dict[str, list[float | None]]]:  # fmt: skip
        """Return derivatives of figures by the coordinates, as `compute_slopes`, one for each experiment.

        Those of responses without a period, and of experiments that have not run, are empty.

        Args:
            values: Values of the unknowns.
            experiments: Numbers of the experiments.
            places: Places below and above the values on the scales, for each unknown, (2, n).
        """
        pieces = [Piece(values, number) for number in experiments]
        left = [one for one in pieces if one not in self._slopes and self._records.get(one, {}).get("end")]
        jobs = [SlopeJob(self.problem, self.folder / CASE_FILE, self._records[one], tuple(places)) for one in left]
        for place, found in self._engine.done(compute_slopes, jobs, lost=no_slopes) if jobs else ():
            self._slopes[left[place]] = found
        return [self._slopes.get(one, {}) for one in pieces]

    def _compute(self, missing: Sequence[Piece]) -> None:
        """Compute pieces and put them on disk one by one, in whatever order they end."""
        case = self.folder / CASE_FILE
        jobs = [TrialJob(self.problem, case, pieces) for pieces in _shares(missing, self._engine.count)]
        with study_written(self.folder / LOG_FILE), (self.folder / LOG_FILE).open("a", encoding="utf-8") as log:
            for _, records in self._engine.done(compute, jobs, lost=lost_pieces):
                for record in records:
                    self._records[_piece(record)] = record
                    if record["verdict"] != LOST:  # computed again when the search is called again
                        log.write(json.dumps(record, allow_nan=False) + "\n")
                    self.computed += 1
                log.flush()
                self._report()


def _shares(pieces: Sequence[Piece], processes: int) -> list[tuple[Piece, ...]]:
    """Return the pieces of each job: all experiments with one set of values, which share a body, if there are enough.

    Otherwise every experiment is a job of its own, so that no process waits for another.
    """
    by_values: dict[Values, list[Piece]] = {}
    for piece in pieces:
        by_values.setdefault(piece.values, []).append(piece)
    if len(by_values) >= 2 * processes:
        return [tuple(share) for share in by_values.values()]
    return [(piece,) for piece in pieces]


def _piece(record: Record) -> Piece:
    return Piece(tuple(record["values"]), int(record["experiment"]), int(record["start"]))


def _read_log(path: Path, problem: Problem) -> dict[Piece, Record]:
    """Return the records of a log; a last line that was cut off while it was written is taken off the file.

    Raises:
        ResultsError: A line is no record of an experiment of the problem.
    """
    if not path.exists():
        return {}
    content = read_plain(path, "a file of records", REMEDY)
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        path.write_bytes(whole)
    records: dict[Piece, Record] = {}
    for number, line in enumerate(whole.split(b"\n")[:-1], 1):
        try:
            found = json.loads(line)
        except (ValueError, RecursionError) as fault:
            found = f"text that is not JSON in line {number} ({printable(fault)})"
            raise ResultsError(path, found, "a record a line", REMEDY) from fault
        record = checked(found, StoredPiece, path)
        piece = _piece(record)
        if piece.experiment >= len(problem.experiments) or len(piece.values) != len(problem.coordinates):
            found = f"experiment {piece.experiment} with {counted(len(piece.values), 'value')} in line {number}"
            expected = (
                f"{counted(len(problem.experiments), 'experiment')} with {counted(len(problem.coordinates), 'value')}"
            )
            raise ResultsError(path, found, expected, REMEDY)
        lacking = [one.name for one in problem.experiments[piece.experiment].figures]
        lacking = [name for name in lacking if name not in record.get("figures", {})]
        if lacking and not failed(record):
            raise ResultsError(path, f"no figure {', '.join(lacking)} in line {number}", "all of them", REMEDY)
        records[piece] = record
    return records


def plan_of(problem: Problem, overwrite: bool) -> StudyPlan:
    """Return the inputs of evaluations and results, except for the settings of the search."""
    file = problem.file.model_dump(mode="json", exclude={"title", "case", "set", "search"})
    plan: dict[str, Any] = {"format": FORMAT} | flat(problem.base.model_dump(mode="json"))
    for table in ("unknown", "figure", "measurement"):
        for number, entry in enumerate(file[table], 1):
            plan[f"[[{table}]] number {number}"] = entry
    plan["transient"] = problem.file.transient
    return StudyPlan(plan, overwrite, (LOG_FILE, *RESULT_FILES, "pictures"))


def failed(record: Record) -> bool:
    """Return whether a record has no figures that can be trusted."""
    return bool(record["exit_status"])


def mean(record: Record, figure: str) -> float:
    """Return a figure of a record; not a number where it failed."""
    return math.nan if failed(record) else float(record["figures"][figure]["mean"])
