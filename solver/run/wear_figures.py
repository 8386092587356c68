"""What a run has found about wear: work rate, volume rate and depth rate of every face, with intervals where there are.

    W' = W / T,    V' = k W',    d' = V' / A

W is the work of sliding over the time T, k the coefficient of wear, A the worn area. Under random loads W' and its 95 %
interval are those of the statistics, behind the burn-in; the coefficient and the area count as exact. Other runs have
the mean from t = 0 to the end, and no interval. The parts of W are those since t = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.solver.case.face_wear import face_wear
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE
from gapbeam.solver.models.model import Model
from gapbeam.solver.record_table import SLIP_MODES

NO_INTERVAL = "no interval"
UNITS = {"work_rate": "W", "volume_rate": "m^3/s", "depth_rate": "m/s"}
BOUNDS = ("value", "low", "high")


def wear_figures(model: Model, accounts: Accounts, statistics: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return what the summary reports about wear; None for a case without [wear].

    Args:
        model: Of the run.
        accounts: At its end.
        statistics: Of the summary; None: the run has none.
    """
    wear, work, parts = model.case.wear, accounts.sliding.by_face, accounts.sliding.parts_by_face
    if wear is None or work is None or parts is None:
        return None
    intervals = {} if statistics is None else {one["name"]: one for one in statistics["figures"]}
    faces = {}
    for (face, of_case), done, of_face in zip(face_wear(model.case).items(), work, parts, strict=True):
        figure = intervals.get(f"face.{face}.{WORK_RATE}")
        by_mode = {"work_by_mode": dict(zip(SLIP_MODES, of_face.tolist(), strict=True))}
        faces[face] = (
            {"work": float(done), "coefficient": of_case.coefficient, "area": of_case.area}
            | by_mode
            | _rates(_work_rate(float(done), accounts.time, figure), of_case.coefficient, of_case.area)
        )
    limits = model.system.contact.slip_modes._asdict()
    return {"area": wear.area, "seconds": accounts.time, **limits, "faces": faces}


def wear_words(found: Mapping[str, Any]) -> str:
    """Return the rates of all faces in one line: depth rates where they are known, else volume or work rates."""
    rows = found["faces"].items()
    return "wear: " + "; ".join(f"{face} {_last_known(of_face)}{_shares(of_face)}" for face, of_face in rows)


def _work_rate(work: float, time: float, figure: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the work rate of a face, W: of the statistics, or the mean over the whole run."""
    if figure is None:
        return {"value": work / time if time > 0.0 else 0.0, "low": None, "high": None, "verdict": NO_INTERVAL}
    return {key: figure[key] for key in (*BOUNDS, "verdict")}


def _rates(work_rate: Mapping[str, Any], coefficient: float | None, area: float | None) -> dict[str, Any]:
    """Return all rates of a face; None for those that are not known."""
    volume = None if coefficient is None else _times(work_rate, coefficient)
    depth = None if volume is None or area is None else _times(volume, 1.0 / area)
    return {"verdict": work_rate["verdict"], "work_rate": _times(work_rate, 1.0), "volume_rate": volume} | {
        "depth_rate": depth
    }


def _times(rate: Mapping[str, Any], factor: float) -> dict[str, float | None]:
    return {key: None if rate[key] is None else factor * rate[key] for key in BOUNDS}


def _shares(face: Mapping[str, Any]) -> str:
    """Return by which modes of motion a face wears, of those that have half a percent and more."""
    work = face["work"]
    shares = {mode: 100.0 * part / work for mode, part in face["work_by_mode"].items()} if work > 0.0 else {}
    words = [f"{share:.0f} % {mode}" for mode, share in shares.items() if share >= 0.5]
    return f", {', '.join(words)}" if words else ""


def _last_known(face: Mapping[str, Any]) -> str:
    known = [(face[key], unit) for key, unit in UNITS.items() if face[key] is not None]
    rate, unit = known[-1]
    span = "" if rate["low"] is None else f" ({rate['low']:.3g} to {rate['high']:.3g}, {face['verdict']})"
    return f"{rate['value']:.4g} {unit}{span}"
