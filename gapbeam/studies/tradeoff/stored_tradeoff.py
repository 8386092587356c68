"""Trade-offs on disk: what they depend on, and the fidelity level that one of them names for a tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results.damaged_files import as_written
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import UserError
from gapbeam.studies.tradeoff.fidelity_levels import Level
from gapbeam.studies.tradeoff.level_errors import Judged
from gapbeam.studies.tradeoff.level_measurement import MeasuredLevel
from gapbeam.studies.tradeoff.promise import WHOLE, Grounds, choice, doubts, nearest
from gapbeam.studies.tradeoff.tradeoff_report import DATA_FILE

FREE = ("title", "model", "output", "gates")  # what may differ between a study and a run that uses it


@dataclass(frozen=True)
class Taken:
    """The fidelity level that a run takes for a tolerance.

    Attributes:
        name: Of the level.
        changes: Keys that it replaces.
        tolerance: What was asked for, as a fraction.
        errors: Of the level against the reference, by group of figures.
        uncertainty: Of the reference, likewise.
        covered: Time from the start that the errors cover, s.
        doubts: Why the tolerance is not promised for the run; nothing where it is.
    """

    name: str
    changes: dict[str, Any]
    tolerance: float
    errors: dict[str, float]
    uncertainty: dict[str, float]
    covered: float
    doubts: tuple[str, ...]


def study_key(case: Case) -> dict[str, Any]:
    """Return what a trade-off depends on: the case but for its title, model, outputs, gates and its end."""
    tables = case.model_dump(mode="json")
    time = {name: value for name, value in tables.pop("time").items() if name != "end"}
    return {name: table for name, table in tables.items() if name not in FREE} | {"time": time}


def stored_choice(folder: Path, case: Case, tolerance: float) -> Taken | None:
    """Return the cheapest fidelity level of a study on disk inside a tolerance; the nearest where none is inside.

    Args:
        folder: Of the study.
        case: What shall be run.
        tolerance: Largest error that will do.

    Returns:
        None where there is no study of this very case, or only one of a shorter time.

    Raises:
        UserError: All fidelity levels of the study failed.
        ResultsError: It cannot be read.
    """
    path = folder / DATA_FILE
    if not path.exists():
        return None
    with as_written(path):
        return _cheapest(path, case, tolerance)


def _cheapest(path: Path, case: Case, tolerance: float) -> Taken | None:
    study = read_object(path, ("key", "rungs", "fixed"), "remove it, or repeat the trade-off")
    if study.get("key") != study_key(case) or study.get("end", 0.0) < WHOLE * case.time.end:
        return None  # studies without an end compared the first forcing periods only
    grounds = Grounds(case.time.end, study["uncertainty"], study["chaotic"], study["not_covered_because"])
    levels = [_level(one) for one in study["rungs"]]
    taken = choice(levels, tolerance, grounds) or nearest(levels, grounds)
    if taken is None:
        raise UserError(f"{path}: every fidelity level failed; expected a run without `tolerance=`")
    found = doubts(taken, tolerance, grounds)
    if found and study["end"] > case.time.end / WHOLE:
        found.append(
            f"errors are those up to t = {study['end']:g} s: a trade-off of this shorter case may promise more"
        )
    fixed = {key: value for key, value in study["fixed"].items() if not key.startswith("output.")}
    return Taken(
        taken.level.name, {**fixed, **taken.level.changes}, tolerance, dict(taken.errors), dict(grounds.uncertainty),
        min(taken.covered, case.time.end), tuple(found),
    )  # fmt: skip


def _level(row: Mapping[str, Any]) -> Judged:
    """Return a fidelity level as the study judged it; one in another cycle is infinitely far."""
    failed = row["verdict"] != "passed"
    level, measured = Level("", {}), MeasuredLevel(verdict=row["verdict"])
    if failed:
        return Judged(level, measured, {}, None, inf)
    level = Level(row["name"], row["changes"])
    statistics, means = (inf, inf) if row["other_cycle"] else (row["statistics_beyond_scatter"], row["means_known_to"])
    return Judged(level, measured, row["errors"], statistics, row["seconds_of_the_case"], row["covered"], means)
