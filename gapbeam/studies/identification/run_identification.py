"""An identification from its file to its tables: the search, how well the unknowns are known, and its results.

Results are files with best values, figures and evaluations, pictures, and tables for the terminal.
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.postprocess.display_units import shown_by
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.postprocess.study_figures.identification_figures import draw_identification
from gapbeam.postprocess.study_figures.sweep_branches import CREEPING
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.overrides import unit_of_key
from gapbeam.solver.case.reading.value_words import toml_value
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.solver.messages.errors import in_one_line
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.worker_memory import worker_memory
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.identification.conclusion import Conclusion, MeasurementRow, conclude
from gapbeam.studies.identification.evaluations import CASE_FILE, LOG_FILE, Evaluations, Record, plan_of
from gapbeam.studies.identification.identifiability import WIDE, combination_words
from gapbeam.studies.identification.identification_file import Problem
from gapbeam.studies.identification.misfit import Misfit, search
from gapbeam.studies.identification.run_figures import unit_of, words_of
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder, study_written, write_json, write_table


def tables(found: Conclusion) -> list[Table]:
    """Return the tables of measurements, of unknowns, and of sensitivities."""
    return [_measurements(found), _unknowns(found), _sensitivities(found)]


def _measurements(found: Conclusion) -> Table:
    problem = found.problem
    left_out = any(row.left_out is not None for row in found.rows)
    residual = problem.file.search.residual
    heads = ["figure", "experiment", "measured", "computed", "deviation", residual, "response", "use"]
    heads += ["from the others"] if left_out else []
    table = Table(*heads, box=None, title="Measured and computed", title_justify="left")
    for row in found.rows:
        one, figure = problem.measurements[row.number], problem.figure(row.number)
        unit, factor = shown_by(unit_of(figure), (one.value, row.computed))
        deviation = f"{100.0 * (row.computed / one.value - 1.0):+.1f} %" if one.value else "-"
        cells = [
            one.figure,
            problem.experiments[problem.places[row.number]].label,
            f"{factor * one.value:.4g} {unit}",
            _computed(row, factor),
            deviation,
            f"{row.residual:+.3f}",
            row.response + (f"; others {', '.join(f'{factor * x:.3g}' for x in row.others)}" if row.others else ""),
            one.use,
        ]
        if left_out:
            cells.append("-" if row.left_out is None else f"{row.left_out:+.3f}")
        table.add_row(*cells)
    return table


def _computed(row: MeasurementRow, factor: float) -> str:
    if not math.isfinite(row.computed):
        return "failed"
    scatter = f" ± {factor * row.scatter:.2g}" if row.scatter > 5e-4 * abs(row.computed) else ""
    return f"{factor * row.computed:.4g}{scatter}"


def _unknowns(found: Conclusion) -> Table:
    percent = f"{100.0 * found.problem.file.search.confidence:g} %"
    heads = ["unknown", "best", "unit", f"interval, {percent}", f"profile, {percent}", "between", "finding"]
    table = Table(*heads, box=None, title="Unknowns", title_justify="left")
    parts = zip(found.problem.coordinates, found.values, found.intervals, found.profiles, found.known.findings,
                strict=True)  # fmt: skip
    for one, value, interval, profile, finding in parts:
        bounds = one.unknown.lower, one.unknown.upper
        table.add_row(one.unknown.key, f"{value:.4g}", one.unit, _range(interval), _range(profile), _range(bounds),
                      finding.sentence if finding.word == "only in combination" else finding.word)  # fmt: skip
    return table


def _range(ends: Sequence[float]) -> str:
    return f"{ends[0]:.3g} to {ends[1]:.3g}"


def _sensitivities(found: Conclusion) -> Table:
    names = [one.unknown.key for one in found.problem.coordinates]
    table = Table("figure", "experiment", *names, box=None, title_justify="left",
                  title="Sensitivity d ln(figure) / d ln(unknown)")  # fmt: skip
    for row, slopes in zip(found.rows, found.sensitivity, strict=True):
        label = found.problem.experiments[found.problem.places[row.number]].label
        cells = ["-" if not math.isfinite(slope) else f"{slope:+.2f}" for slope in slopes]
        table.add_row(found.problem.measurements[row.number].figure, label, *cells)
    return table


def sentences(found: Conclusion) -> Iterator[str]:
    """Yield remarks beyond the tables, the most important first."""
    problem, known = found.problem, found.known
    fitted, unknowns = len(problem.fitted), len(found.values)
    if fitted < unknowns:
        yield (f"WARNING: {counted(fitted, 'measurement')} for {counted(unknowns, 'unknown')}: many other values "
               "fit as well, and the misfit "
               "says nothing about the model")  # fmt: skip
    elif fitted == unknowns:
        yield f"WARNING: as many measurements as unknowns ({fitted}): the misfit says nothing about the model"
    for verdict, count in Counter(str(record["verdict"]) for record in found.failures).most_common():
        yield f"WARNING: {counted(count, 'experiment')} ended {verdict}; they were never taken as results"
    if found.drowned:
        yield (f"WARNING: derivatives by {', '.join(found.drowned)} are within the scatter of the responses: their "
               "intervals are rough; run longer, or take a larger search.difference")  # fmt: skip
    yield f"intervals from {known.spread.sentence}"
    names = [one.unknown.key for one in problem.coordinates]
    powers = np.array([
        one.elasticity(float(z)) for one, z in zip(problem.coordinates, problem.scaled(found.values), strict=True)
    ])  # fmt: skip
    for direction, width in zip(known.combinations, known.widths, strict=True):
        if width >= WIDE:
            sentence = combination_words(direction, powers, names)
            far = f"{width:.2g} of the ranges either way" if width < 1.0 else "anywhere between the bounds"
            yield f"not determined by the measurements: {sentence}, {far}"
    chaotic = [row for row in found.rows if row.response == "no cycle"]
    if chaotic:
        yield f"{len(chaotic)} of {len(found.rows)} figures are means over a response without a cycle (± scatter)"
    unsettled = [row for row in found.rows if row.response == CREEPING]
    if unsettled:
        yield (f"WARNING: {len(unsettled)} of {len(found.rows)} figures come from responses that have not settled: "
               "run longer")  # fmt: skip
    several = [row for row in found.rows if row.others]
    if several:
        yield f"{len(several)} of {len(found.rows)} figures have another value from another start: responses coexist"
    wording = {"fit": "fitted", "predict": "held out"}
    for use, word in wording.items():
        rms = found.rms(use)
        if any(problem.measurements[row.number].use == use for row in found.rows):
            log10 = "" if problem.file.search.residual == "log10" else f", in log10 {found.rms(use, 'log10'):.3g}"
            yield f"rms of {problem.file.search.residual}, {word}: {rms:.3g}{log10}"
    if math.isfinite(found.rms_left_out):
        yield f"rms of {problem.file.search.residual}, each predicted from the others: {found.rms_left_out:.3g}"
    yield f"{counted(found.tried, 'set')} of values tried by the search, {len(found.cloud)} on disk"


DATA, BEST, BEST_CASE, TABLE = "identification.json", "identified.toml", "identified-case.toml", "evaluations.csv"
FORMAT = 1


def write_results(found: Conclusion, folder: Path) -> list[Path]:
    """Write the results of an identification into its folder.

    Returns:
        The files.
    """
    data = as_data(found)
    write_json(folder / DATA, data)
    settings = found.problem.settings(found.values)
    words = [word for key, value in settings.items() for word in ("--set", f"{key}={toml_value(value)}")]
    lines = [
        "# The best values that gapbeam identify found; with the case of the identification:",
        f"#   {shell_command('gapbeam', 'run', 'CASE', *words)}",
        "",
        "[set]",
        *(f'"{key}" = {toml_value(value)}' for key, value in settings.items()),
    ]
    write_beside(folder / BEST, "\n".join(lines) + "\n")
    best = read_case(folder / "case.toml", settings)
    write_beside(folder / BEST_CASE, case_to_toml(best, ["the case of an identification with the best values"]))
    _write_table(found, folder / TABLE)
    return [folder / name for name in (BEST, BEST_CASE, DATA, TABLE, LOG_FILE)]


def as_data(found: Conclusion) -> dict[str, Any]:
    """Return all that was found as plain data."""
    problem, known = found.problem, found.known
    names = [one.unknown.key for one in problem.coordinates]
    powers = np.array([
        one.elasticity(float(z)) for one, z in zip(problem.coordinates, problem.scaled(found.values), strict=True)
    ])  # fmt: skip
    unknowns = [
        {
            "key": one.unknown.key,
            "unit": one.unit,
            "value": value,
            "lower": one.unknown.lower,
            "upper": one.unknown.upper,
            "scale": one.unknown.scale,
            "interval": interval,
            "profile": profile,
            "word": finding.word,
            "sentence": finding.sentence,
        }
        for one, value, interval, profile, finding in zip(
            problem.coordinates, found.values, found.intervals, found.profiles, known.findings, strict=True
        )
    ]
    combinations = [
        {"of": combination_words(direction, powers, names), "direction": direction.tolist(), "half_width": float(width)}
        for direction, width in zip(known.combinations, known.widths, strict=True)
    ]
    data = {
        "format": FORMAT,
        "title": problem.file.title,
        "residual": problem.file.search.residual,
        "confidence": problem.file.search.confidence,
        "tolerance": problem.file.search.tolerance,
        "tried": found.tried,
        "evaluations": len(found.cloud),
        "failures": [
            {key: entry.get(key) for key in ("values", "experiment", "verdict", "message")} for entry in found.failures
        ],
        "unknowns": unknowns,
        "measurements": [_row_data(found, number) for number in range(len(found.rows))],
        "sum_of_squares": found.cost,
        "bound_of_misfit": found.bound,
        "rms": {use: found.rms(use) for use in ("fit", "predict")},
        "rms_log10": {use: found.rms(use, "log10") for use in ("fit", "predict")},
        "rms_left_out": found.rms_left_out,
        "standard_deviation": known.spread.deviation,
        "standard_deviation_from": known.spread.sentence,
        "singular_values": known.singular_values.tolist(),
        "combinations": combinations,
        "correlation": known.correlation.tolist(),
        "sensitivity": found.sensitivity.tolist(),
        "notes": list(sentences(found)),
    }
    plain: dict[str, Any] = finite(data)
    return plain


def _row_data(found: Conclusion, number: int) -> dict[str, Any]:
    problem, row = found.problem, found.rows[number]
    one, figure = problem.measurements[number], problem.figure(number)
    settings = problem.experiments[problem.places[number]].settings
    return {
        "figure": one.figure,
        "meaning": words_of(figure),
        "unit": unit_of(figure),
        "set": dict(settings),
        "set_units": {key: unit_of_key(key, problem.base.model_dump(mode="json")) for key in settings},
        "use": one.use,
        "measured": one.value,
        "computed": row.computed,
        "residual": row.residual,
        "log10": row.log10,
        "scatter": row.scatter,
        "response": row.response,
        "uncertainty": row.uncertainty,
        "other_responses": list(row.others),
        "left_out": row.left_out,
    }


def _write_table(found: Conclusion, path: Path) -> None:
    """Write every evaluation as a row: values, sum of squares, how many of its experiments failed."""
    problem = found.problem
    names = [one.unknown.key for one in problem.coordinates]
    bad: dict[tuple[float, ...], int] = {}
    for record in found.failures:
        if record["start"] == 0:
            values = tuple(record["values"])
            bad[values] = bad.get(values, 0) + 1
    rows = [(values, cost, bad.pop(values, 0)) for values, cost in found.cloud]
    rows += [(values, float("nan"), count) for values, count in bad.items()]
    write_table(
        path, (*names, "sum of squares", "experiments that failed"), [(*values, *rest) for values, *rest in rows]
    )


NOT_PASSED, MISSED = 4, 5
SHOWN_FAILURES = 10
LOG = logging.getLogger("gapbeam")
Progress = Callable[[str, int, int | None], None]


@dataclass(frozen=True, repr=False)
class IdentificationResult(PrintedResult):
    """Result of an identification.

    Attributes:
        problem: The identification.
        folder: Folder of its files.
        found: The best values and how well they are known; None where no set of values passed in all experiments.
        failures: Records of experiments that failed, where nothing was found.
        paths: The files and pictures.
    """

    problem: Problem
    folder: Path
    found: Conclusion | None
    failures: Sequence[Record]
    paths: Sequence[Path]

    @property
    def values(self) -> dict[str, float]:
        """The best value of each unknown by its key, in the unit of the case file; empty where nothing was found."""
        if self.found is None:
            return {}
        names = [one.unknown.key for one in self.problem.coordinates]
        return dict(zip(names, map(float, self.found.values), strict=True))

    @property
    def exit_status(self) -> int:
        """0; 4 where the best values did not pass; 5 where the fit misses search.tolerance or the standard errors."""
        if self.found is None or not self.found.passed:
            return NOT_PASSED
        return MISSED if self.missed or self.found.known.spread.contradicts else 0

    @property
    def missed(self) -> bool:
        """True where the fit misses the requested tolerance."""
        tolerance = self.problem.file.search.tolerance
        if self.found is None or tolerance is None:
            return False
        rms = self.found.rms("fit")
        return not (math.isfinite(rms) and rms <= tolerance)

    def failure_lines(self) -> list[str]:
        """Return the first failures, one a line."""
        return [
            f"{', '.join(f'{value:.6g}' for value in record['values'])}: {record['verdict']}: "
            f"{in_one_line(record['message'])}"
            for record in self.failures[:SHOWN_FAILURES]
        ]

    def remark(self) -> str | None:
        """Return the reason for an exit status other than 0, else None."""
        if self.found is None:
            return "no set of values passed in all experiments: nothing was identified"
        if not self.found.passed:
            return "some experiments did not pass at the best values"
        if self.missed:
            tolerance = self.problem.file.search.tolerance
            return f"the fit misses its tolerance: rms {self.found.rms('fit'):.3g}, search.tolerance = {tolerance:g}"
        spread = self.found.known.spread
        if spread.contradicts:
            return (
                f"the model misses the measurements by {spread.missed:.3g} given standard errors: check units, bounds "
                "and the keys that are taken as known, or give the standard errors that the figures have"
            )
        return None

    def headline(self) -> str:
        """Return the best values, or why there are none."""
        values = ", ".join(f"{key} = {value:.6g}" for key, value in self.values.items())
        return "; ".join(part for part in (values, self.remark()) if part)

    def tables(self) -> list[Table | str]:
        """Return the tables of measurements, unknowns and sensitivities, and findings in sentences."""
        if self.found is None:
            return list(self.failure_lines())
        return [*tables(self.found), *sentences(self.found)]


def run_identification(
    problem: Problem,
    folder: Path,
    leave_one_out: bool = False,
    workers: Workers | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> IdentificationResult:
    """Search for the unknowns of an identification, or continue the search in the folder.

    Args:
        problem: The identification, as `identification_file.read_identification` reads it.
        folder: Folder for the files.
        leave_one_out: Predict each fitted measurement from the others too.
        workers: Workers that compute; by default one a core of this machine.
        overwrite: Begin anew.
        progress: Called with what is done, how many sets of values were tried, and how many may be; None: unknown.

    Raises:
        UserError: The folder holds another identification or cannot be written.
        ResultsError: Results of an earlier search cannot be read.
    """
    if isinstance(problem.base.model, FullModel):
        LOG.warning('model "full" marches all DOFs of the mesh in every experiment; try "reduced" or "beam" in [set]')
    settings = problem.file.search

    def report(words: str, total: int | None) -> None:
        if progress is not None:
            progress(words, len(misfit.tried), total)

    with study_folder(folder, plan=plan_of(problem, overwrite)):
        with study_written(folder / CASE_FILE):
            words = ["the case of an identification, with its [set]"]
            write_beside(folder / CASE_FILE, case_to_toml(problem.base, words))
        with Engine(workers, memory=worker_memory([problem.base]), folder=folder) as engine:
            evaluations = Evaluations(problem, folder, engine, lambda: report("search", settings.budget))
            misfit = Misfit(problem, evaluations)
            if evaluations.records:
                LOG.info("%d experiments are on disk already", len(evaluations.records))
            search(misfit, problem.start, settings, misfit.slopes, misfit.is_met)
            found = conclude(
                problem, evaluations, len(misfit.tried), leave_one_out, lambda words: report(words, None)
            )  # fmt: skip
            if evaluations.computed:
                LOG.info("%d experiments were run", evaluations.computed)
        if found is None:
            return IdentificationResult(problem, folder, None, misfit.failures(), ())
        paths = [*write_results(found, folder), *draw_identification(folder)]
    return IdentificationResult(problem, folder, found, (), paths)
