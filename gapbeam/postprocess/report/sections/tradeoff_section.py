"""The report on a trade-off: what models, meshes and steps of a case cost, and how far off they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict, warnings_of
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.markdown_text import sentence
from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.study_figures.tradeoff_figure import KINDS, OTHERS

TRADEOFF_FILE = "tradeoff.json"
Level = Mapping[str, Any]


def tradeoff_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, error over wall time, and a table of all fidelity levels.

    Args:
        folder: As `gapbeam tradeoff` left it.
        command: That makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no trade-off.
    """
    found = read_object(folder / TRADEOFF_FILE, ("tolerance", "chosen", "verdict", "reference", "rungs", "uncertainty"))
    blocks: list[Block] = [Verdict("passed" if found.get("promised") else "warning", sentence(str(found["verdict"])))]
    if found.get("chaotic"):
        blocks.append(Verdict("note", "The response does not repeat: means over windows are compared."))
    blocks += warnings_of([str(note) for note in found.get("notes") or ()])
    blocks.append(_chart(found, command))
    blocks.append(_table(found))
    skipped = [(one["name"], float(one["predicted_seconds"])) for one in found.get("skipped") or ()]
    if skipped:
        blocks.append(
            TableBlock("Fidelity levels left out for their time", ("fidelity level", "predicted (s)"), skipped)
        )
    return [ReportSection("The trade-off", "tradeoff", blocks)]


def _error(level: Level) -> float | None:
    errors = level.get("errors") or {}
    return max((float(value) for value in errors.values()), default=None)


def _chart(found: Mapping[str, Any], command: str) -> Chart:
    curves, places = [], list[float]()
    for kind in (*KINDS, *OTHERS):
        levels = [(level, _error(level)) for level in found["rungs"] if level["name"].startswith(kind)]
        passed = [(level, error) for level, error in levels if level["verdict"] == "passed" and error]
        if passed:
            x = [float(level["seconds_of_the_case"]) for level, _ in passed]
            places += x
            texts = [
                f"{level['name']}: {100 * error:.3g} %, {level['seconds_of_the_case']:.3g} s" for level, error in passed
            ]
            curves.append(ChartCurve(kind, x, [100.0 * error for _, error in passed], "markers", texts=texts))
    ends = [min(places, default=1.0), max(places, default=10.0)]
    curves.append(ChartCurve("asked for", ends, [100.0 * float(found["tolerance"])] * 2, dashed=True))
    uncertain = 100.0 * max((float(value) for value in found["uncertainty"].values()), default=0.0)
    if uncertain > 0.0:
        curves.append(ChartCurve("uncertainty of the reference", ends, [uncertain] * 2, dashed=True))
    return Chart(
        "Largest error of a figure against the reference, over the wall time of the whole case.",
        "wall time of the case (s)", "largest error (%)", curves, command, log_x=True, log_y=True,
    )  # fmt: skip


def _table(found: Mapping[str, Any]) -> TableBlock:
    groups = list(found["uncertainty"])
    levels: Sequence[Level] = sorted(found["rungs"], key=lambda level: float(level["seconds_of_the_case"] or 0.0))
    rows: list[tuple[Cell, ...]] = []
    for level, mark in [(found["reference"], "reference"), *((level, _mark(level, found)) for level in levels)]:
        errors = level.get("errors") or {}
        cells = [100.0 * float(errors[name]) if name in errors else None for name in groups]
        memory = level.get("memory")
        rows.append(
            (
                level["name"], mark, level.get("dofs"), level.get("set_up"), level.get("per_simulated_second"),
                level.get("seconds_of_the_case"), None if memory is None else memory / 1e9, *cells,
            )
        )  # fmt: skip
    heads = ("fidelity level", "", "DOFs", "set-up (s)", "per simulated s (s)", "case (s)", "memory (GB)",
             *(f"{name} (%)" for name in groups))  # fmt: skip
    return TableBlock("Costs and errors of all fidelity levels", heads, rows, digits=3)


def _mark(level: Level, found: Mapping[str, Any]) -> str:
    if level["verdict"] != "passed":
        return str(level["verdict"])
    return "to take" if level["name"] == found["chosen"] else "on the front" if level.get("on_the_front") else ""
