"""Result of a run, and rates of wear of a face with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gapbeam.solver.models.body import Body


@dataclass(frozen=True, repr=False)
class Outcome:
    """Result of a run.

    Attributes:
        folder: Folder of the results.
        exit_status: 0, or the status of what went wrong.
        message: One line for the user.
        summary: The contents of summary.json.
        body: Body of a small model on one process, for other models on it; None: not kept.
    """

    folder: Path
    exit_status: int
    message: str
    summary: dict[str, Any]
    body: Body | None = None

    def __repr__(self) -> str:
        return f"<Outcome: exit status {self.exit_status}: {self.message}; in {self.folder}>"


NO_INTERVAL = "no interval"
UNITS = {"work_rate": "W", "volume_rate": "m^3/s", "depth_rate": "m/s"}
BOUNDS = ("value", "low", "high")


def wear_words(found: Mapping[str, Any]) -> str:
    """Return the rates of all faces in one line: depth rates where they are known, else volume or work rates."""
    rows = found["faces"].items()
    words = "wear: " + "; ".join(f"{face} {_last_known(of_face)}{_shares(of_face)}" for face, of_face in rows)
    return words if found["parts_doubt"] is None else f"{words}; {found['parts_doubt']}"


def work_rate(work: float, time: float, figure: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the work rate of a face, W, with its interval and verdict.

    Args:
        work: Work of sliding, J.
        time: Time in which it was done, s.
        figure: Figure from the statistics; None: the rate is the mean, without an interval.
    """
    if figure is None:
        return {"value": work / time if time > 0.0 else 0.0, "low": None, "high": None, "verdict": NO_INTERVAL}
    return {key: figure[key] for key in (*BOUNDS, "verdict")}


def all_rates(rate: Mapping[str, Any], coefficient: float | None, area: float | None) -> dict[str, Any]:
    """Return work, volume and depth rate of a face with their verdict; None for those that are not known.

    Args:
        rate: The work rate, of `work_rate`.
        coefficient: Coefficient of wear, 1/Pa; None: not known.
        area: Worn area, m^2; None: not known.
    """
    volume = None if coefficient is None else times_rate(rate, coefficient)
    depth = None if volume is None or area is None else times_rate(volume, 1.0 / area)
    return {"verdict": rate["verdict"], "work_rate": times_rate(rate, 1.0), "volume_rate": volume, "depth_rate": depth}


def times_rate(rate: Mapping[str, Any], factor: float) -> dict[str, float | None]:
    """Return a rate and its interval times a factor; None for unknown values."""
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
