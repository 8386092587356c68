"""The report on a trade-off: what models, meshes and steps of a case cost, and how far off they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from postprocess.pareto import KINDS, OTHERS
from postprocess.report.blocks import Block, Cell, Section, Table, Verdict, warnings_of
from postprocess.report.charts import Chart, Curve
from postprocess.report.json_files import read_object
from postprocess.report.markup import sentence

TRADEOFF_FILE = "tradeoff.json"
Rung = Mapping[str, Any]


def tradeoff_sections(folder: Path, command: str) -> list[Section]:
    """Return the verdict, error over wall time, and a table of all rungs.

    Args:
        folder: As `gapbeam tradeoff` left it.
        command: That makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no trade-off.
    """
    found = read_object(folder / TRADEOFF_FILE, ("tolerance", "chosen", "verdict", "reference", "rungs", "uncertainty"))
    blocks: list[Block] = [Verdict("passed" if found["chosen"] else "warning", sentence(str(found["verdict"])))]
    if found.get("chaotic"):
        blocks.append(Verdict("note", "The response does not repeat: means over windows are compared."))
    blocks += warnings_of([str(note) for note in found.get("notes") or ()])
    blocks.append(_chart(found, command))
    blocks.append(_table(found))
    skipped = [(one["name"], float(one["predicted_seconds"])) for one in found.get("skipped") or ()]
    if skipped:
        blocks.append(Table("Rungs left out for their time", ("rung", "predicted (s)"), skipped))
    return [Section("The trade-off", "tradeoff", blocks)]


def _error(rung: Rung) -> float | None:
    errors = rung.get("errors") or {}
    return max((float(value) for value in errors.values()), default=None)


def _chart(found: Mapping[str, Any], command: str) -> Chart:
    curves, places = [], list[float]()
    for kind in (*KINDS, *OTHERS):
        rungs = [(rung, _error(rung)) for rung in found["rungs"] if rung["name"].startswith(kind)]
        passed = [(rung, error) for rung, error in rungs if rung["verdict"] == "passed" and error]
        if passed:
            x = [float(rung["seconds_of_the_case"]) for rung, _ in passed]
            places += x
            texts = [
                f"{rung['name']}: {100 * error:.3g} %, {rung['seconds_of_the_case']:.3g} s" for rung, error in passed
            ]
            curves.append(Curve(kind, x, [100.0 * error for _, error in passed], "markers", texts=texts))
    ends = [min(places, default=1.0), max(places, default=10.0)]
    curves.append(Curve("asked for", ends, [100.0 * float(found["tolerance"])] * 2, dashed=True))
    uncertain = 100.0 * max((float(value) for value in found["uncertainty"].values()), default=0.0)
    if uncertain > 0.0:
        curves.append(Curve("uncertainty of the reference", ends, [uncertain] * 2, dashed=True))
    return Chart(
        "Largest error of a figure against the reference, over the wall time of the whole case.",
        "wall time of the case (s)", "largest error (%)", curves, command, log_x=True, log_y=True,
    )  # fmt: skip


def _table(found: Mapping[str, Any]) -> Table:
    groups = list(found["uncertainty"])
    rungs: Sequence[Rung] = sorted(found["rungs"], key=lambda rung: float(rung["seconds_of_the_case"] or 0.0))
    rows: list[tuple[Cell, ...]] = []
    for rung, mark in [(found["reference"], "reference"), *((rung, _mark(rung, found)) for rung in rungs)]:
        errors = rung.get("errors") or {}
        cells = [100.0 * float(errors[name]) if name in errors else None for name in groups]
        memory = rung.get("memory")
        rows.append(
            (
                rung["name"], mark, rung.get("dofs"), rung.get("set_up"), rung.get("per_simulated_second"),
                rung.get("seconds_of_the_case"), None if memory is None else memory / 1e9, *cells,
            )
        )  # fmt: skip
    heads = ("rung", "", "DOFs", "set-up (s)", "per simulated s (s)", "case (s)", "memory (GB)",
             *(f"{name} (%)" for name in groups))  # fmt: skip
    return Table("Costs and errors of all rungs", heads, rows, digits=3)


def _mark(rung: Rung, found: Mapping[str, Any]) -> str:
    if rung["verdict"] != "passed":
        return str(rung["verdict"])
    return "to take" if rung["name"] == found["chosen"] else "on the front" if rung.get("on_the_front") else ""
