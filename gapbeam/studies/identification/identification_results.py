"""The files of an identification: best values, all figures, all evaluations."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.shell_command import shell_command
from gapbeam.solver.case.case_writer import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.value_words import toml_value
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.studies.identification.conclusion import Conclusion
from gapbeam.studies.identification.evaluations import LOG_FILE
from gapbeam.studies.identification.identifiability import combination_words
from gapbeam.studies.identification.identification_file import unit_of_key
from gapbeam.studies.identification.measured_figures import unit_of, words_of
from gapbeam.studies.identification.printed_tables import sentences

DATA, BEST, BEST_CASE, TABLE = "identification.json", "identified.toml", "identified-case.toml", "evaluations.csv"
FORMAT = 1


def write_results(found: Conclusion, folder: Path) -> list[Path]:
    """Write what was found into the folder of an identification.

    Returns:
        The files.
    """
    data = as_data(found)
    write_beside(folder / DATA, json.dumps(data, indent=1, allow_nan=False) + "\n")
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
        "method": problem.file.search.method,
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
        "set_units": {key: unit_of_key(key, problem.base) for key in settings},
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
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*names, "sum of squares", "experiments that failed"])
        writer.writerows([*values, cost, count] for values, cost, count in rows)
