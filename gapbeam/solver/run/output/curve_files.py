"""A curve of periodic responses as a table: curve.json and curve.csv in the results folder."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.periodic.continuation import CurvePoint, ResponseCurve
from gapbeam.solver.periodic.periodic_response import SteadyModel
from gapbeam.solver.periodic.response_branches import Branches
from gapbeam.solver.record_table import CURVE_FILE, CURVE_TABLE_FILE
from gapbeam.solver.run.output.results_folder import write_beside


def curve_rows(curves: Sequence[ResponseCurve], model_at: Callable[[float], SteadyModel]) -> list[dict[str, Any]]:
    """Return one row for every point: parameter, branch, stability, and what probes and faces do there.

    Args:
        curves: The branches.
        model_at: The model for a value of the parameter.
    """
    return [
        _row(point, number, model_at(point.value))
        for number, curve in enumerate(curves, start=1)
        for point in curve.points
    ]


def _row(point: CurvePoint, branch: int, steady: SteadyModel) -> dict[str, Any]:
    period_map = steady.modal_map()
    assert period_map is not None
    places, forces = period_map.history(point.x)
    model, stability = steady.model, point.stability
    leading = stability.multipliers[0]
    row: dict[str, Any] = {
        "value": point.value,
        "branch": branch,
        "stable": stability.stable,
        "kind": stability.kind,
        "event": point.event,
        "largest_multiplier": stability.largest,
        "multiplier_real": float(leading.real),
        "multiplier_imaginary": float(abs(leading.imag)),
        "residual": point.residual,
        "iterations": point.iterations,
    }
    for name, probe in model.probes.items():
        along = [float(probe.evaluate(place, model.system.operators)[-1]) for place in places]
        row[f"{name}.peak_to_peak"] = float(np.ptp(along))
    for face, name in enumerate(model.system.contact.face_names):
        row[f"{name}.peak_force"] = float(np.max(forces[:, face]))
    return row


def write_curve(folder: Path, key: str, unit: str, periods: int, found: Branches, rows: list[dict[str, Any]]) -> None:
    """Write the table.

    Args:
        folder: Results folder.
        key: The parameter.
        unit: Its unit.
        periods: Forcing periods in a period of the response.
        found: The branches.
        rows: Those of `curve_rows`.
    """
    contents = {"key": key, "unit": unit, "periods": periods, **coverage(found), "points": rows}
    write_beside(folder / CURVE_FILE, json.dumps(contents, indent=1) + "\n")
    with (folder / CURVE_TABLE_FILE).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def coverage(found: Branches) -> dict[str, Any]:
    """Return the reason for which the first branch ends, and intervals without a branch, or a stable response."""
    return {
        "endings": list(found.curves[0].endings),
        "branches": len(found.curves),
        "missing": [{"low": low, "high": high, "reason": why} for low, high, why in found.missing],
        "unstable": [{"low": low, "high": high} for low, high in found.unstable],
    }


def unit_of(key: str, steady: SteadyModel) -> str:
    """Return the unit of what varies along a curve."""
    case, field = steady.model.case, key.rsplit(".", 1)[1]
    if key.startswith("load."):
        return next(load for load in case.load if load.name == key.split(".")[1]).curve_units[field]
    contact = {"stiffness": case.contact.stiffness_unit, "damping": case.contact.damping_unit}
    return {"clearance": "m", **contact}[field]
