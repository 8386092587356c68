"""Report on forces that follow the motion of a scene: states, delay, work, and coefficients with their fit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict, percent
from gapbeam.postprocess.report.charts import Chart, ChartCurve

PARTS = {"real": "real part", "imaginary": "imaginary part"}
REDUCED = "reduced velocity U/(f D) (1)"


def flow_section(summary: Mapping[str, Any], command: str) -> ReportSection | None:
    """Return the section on feedback; None for a run without any.

    Args:
        summary: `Results.summary`.
        command: That makes the report.
    """
    scene = summary.get("scene")
    forces = scene.get("feedbacks") if isinstance(scene, Mapping) else None
    if not isinstance(forces, list) or not forces:  # a number in results of earlier releases
        return None
    works = (summary.get("energy") or {}).get("work_of_feedback") or {}
    rows: list[tuple[Cell, ...]] = [
        (
            one["name"] or "?", one["states"], one.get("velocity"), one.get("density"), one.get("delay"),
            works.get(one["name"]),
        )
        for one in forces
    ]  # fmt: skip
    heads = ("force", "states", "velocity (m/s)", "density (kg/m³)", "delay (s)", "work in the run (J)")
    blocks: list[Block] = [TableBlock("Forces that follow the motion", heads, rows)]
    for one in forces:
        if one.get("coefficients"):
            blocks += _coefficients(one["name"], one["coefficients"], command)
    return ReportSection("Flow", "flow", blocks)


def _coefficients(name: str, found: Mapping[str, Any], command: str) -> list[Block]:
    names = [key for key in found["measured"] if key != "reduced_velocity"]
    curves = [
        ChartCurve(
            f"{words}, {kind}", found[kind]["reduced_velocity"], found[kind][coefficient][part],
            "markers" if kind == "measured" else "lines", coefficient if len(names) > 1 else None, like=words,
        )
        for coefficient in names
        for part, words in PARTS.items()
        for kind in ("measured", "fit")
    ]  # fmt: skip
    misfit = percent(found["misfit"], signed=False)
    good = found["misfit"] <= found["tolerance"]
    words = f"`{name}`: the fit of {found['states']} states misses measured coefficients by {misfit} of the largest."
    chart = Chart(
        f"Coefficients of `{name}`: measured, and the fit that the run used.", REDUCED, "coefficient c (1)", curves,
        command, choices=names if len(names) > 1 else (), choice="coefficient" if len(names) > 1 else "",
    )  # fmt: skip
    return [Verdict("passed" if good else "warning", words), chart]
