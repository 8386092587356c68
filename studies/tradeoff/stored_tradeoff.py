"""Trade-offs on disk: what they depend on, and the fidelity level that one of them names for a tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results.damaged_files import as_written
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import UserError
from gapbeam.studies.tradeoff.tradeoff_report import DATA_FILE

FREE = ("title", "model", "output", "gates")  # what may differ between a study and a run that uses it


def study_key(case: Case) -> dict[str, Any]:
    """Return what a trade-off depends on: the case but for its title, model, outputs, gates and its end."""
    tables = case.model_dump(mode="json")
    time = {name: value for name, value in tables.pop("time").items() if name != "end"}
    return {name: table for name, table in tables.items() if name not in FREE} | {"time": time}


def stored_choice(folder: Path, case: Case, tolerance: float) -> tuple[str, dict[str, Any]] | None:
    """Return the cheapest fidelity level of a study on disk inside a tolerance, and the keys that it replaces.

    Args:
        folder: Of the study.
        case: What shall be run.
        tolerance: Largest error that will do.

    Returns:
        None where there is no study of this very case.

    Raises:
        UserError: The study has no fidelity level inside the tolerance.
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
    inside = [level for level in study["rungs"] if _inside(level, tolerance)]
    if not inside:
        errors = (max(level["errors"].values()) for level in study["rungs"] if level["errors"])
        nearest = min(errors, default=float("inf"))
        raise UserError(
            f"{path}: no fidelity level is within {tolerance:.2%} of the reference, the nearest is {nearest:.2%} off; "
            "expected a larger `tolerance=`, or a run without it"
        )
    chosen = min(inside, key=lambda level: level["seconds_of_the_case"])
    fixed = {key: value for key, value in study["fixed"].items() if not key.startswith("output.")}
    return chosen["name"], {**fixed, **chosen["changes"]}


def _inside(level: Mapping[str, Any], tolerance: float) -> bool:
    if level["verdict"] != "passed" or level["other_cycle"] or not level["errors"]:
        return False
    return bool(max(*level["errors"].values(), level["statistics_beyond_scatter"] or 0.0) <= tolerance)
