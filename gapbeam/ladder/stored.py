"""Trade-offs on disk: what they depend on, and the rung that one of them names for a tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gapbeam.ladder.report import DATA_FILE
from postprocess.damage import as_written
from postprocess.report.json_files import read_object
from solver.case import Case
from solver.errors import UserError

FREE = ("title", "model", "output", "gates")  # what may differ between a study and a run that uses it


def study_key(case: Case) -> dict[str, Any]:
    """Return what a trade-off depends on: the case but for its title, model, outputs, gates and its end."""
    tables = case.model_dump(mode="json")
    time = {name: value for name, value in tables.pop("time").items() if name != "end"}
    return {name: table for name, table in tables.items() if name not in FREE} | {"time": time}


def stored_choice(folder: Path, case: Case, tolerance: float) -> tuple[str, dict[str, Any]] | None:
    """Return the cheapest rung of a study on disk inside a tolerance, and the keys that it replaces.

    Args:
        folder: Of the study.
        case: What shall be run.
        tolerance: Largest error that will do.

    Returns:
        None where there is no study of this very case.

    Raises:
        UserError: The study has no rung inside the tolerance.
        ResultsError: It cannot be read.
    """
    path = folder / DATA_FILE
    if not path.exists():
        return None
    with as_written(path):
        return _cheapest(path, case, tolerance)


def _cheapest(path: Path, case: Case, tolerance: float) -> tuple[str, dict[str, Any]] | None:
    study = read_object(path, ("key", "rungs", "fixed"), "remove it, or repeat the trade-off")
    if study.get("key") != study_key(case):
        return None
    inside = [rung for rung in study["rungs"] if _inside(rung, tolerance)]
    if not inside:
        nearest = min((max(rung["errors"].values()) for rung in study["rungs"] if rung["errors"]), default=float("inf"))
        raise UserError(
            f"{path}: no rung is within {tolerance:.2%} of the reference, the nearest is {nearest:.2%} off; expected a "
            "larger --tolerance, or a run without it"
        )
    chosen = min(inside, key=lambda rung: rung["seconds_of_the_case"])
    fixed = {key: value for key, value in study["fixed"].items() if not key.startswith("output.")}
    return chosen["name"], {**fixed, **chosen["changes"]}


def _inside(rung: Mapping[str, Any], tolerance: float) -> bool:
    if rung["verdict"] != "passed" or rung["other_cycle"] or not rung["errors"]:
        return False
    return bool(max(*rung["errors"].values(), rung["statistics_beyond_scatter"] or 0.0) <= tolerance)
