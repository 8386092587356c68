"""The report on a life: when the limit was reached, how sure that is, and depths and rates of the faces over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.report.blocks import Block, ReportSection, TableBlock, Verdict, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.number_text import number
from gapbeam.postprocess.report.study_json import read_object

LIFE_FILE = "life.json"
KEYS = ("reached", "message", "limit", "faces", "states", "relative_chance", "block_error", "verdict")
HOUR, MILLIMETER = 3600.0, 1.0e-3
DIGITS = 9  # of places that count as one
HEADER = ("time (s)", "face", "depth (m)", "depth rate (m/s)", "95 % interval", "judged")


def life_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the life, charts of depths and rates, and their table.

    Args:
        folder: As `gapbeam life` left it.
        command: That makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    found = read_object(folder / LIFE_FILE, KEYS)
    faces, states = found["faces"], found["states"]
    good = found["reached"] and found["verdict"] == "good"
    summary: list[Block] = [Verdict("passed" if good else "warning", str(found["message"]))]
    if found["reached"]:
        summary.append(
            Words(
                f"Chance in the rates: half of the 95 % interval is {100.0 * found['relative_chance']:.2g} %. "
                f"Length of the blocks: {number(found['block_error'])} s. Coefficients and areas count as exact."
            )
        )
    rows = [
        (state["time"], face, depth, rate, f"{number(low)} to {number(high)}", verdict)
        for state in states
        for face, depth, rate, low, high, verdict in zip(
            faces, *(state[key] for key in ("depths", "depth_rates", "low", "high", "verdicts")), strict=True
        )
    ]
    charts = [
        Chart("Depths of the faces", "time (h)", "depth (mm)", _curves(states, faces, "depths", MILLIMETER), command),
        Chart(
            "How fast they wear", "time (h)", "depth rate (m/s)", _curves(states, faces, "depth_rates", 1.0), command
        ),
    ]
    charts += _profiles(found.get("profiles", {}), command)
    return [
        ReportSection("Life", "life", summary),
        ReportSection("Over time", "over-time", charts),
        ReportSection("Runs", "runs", [TableBlock("Depths and rates at the end of each block", HEADER, rows)]),
    ]


def _profiles(profiles: Mapping[str, Mapping[str, Sequence[float]]], command: str) -> list[Chart]:
    """Return how deep the faces are worn at the end along the beam and, where they are met all around, around it."""
    charts = []
    for key, title, label in (
        ("x", "Worn profiles along the beam", "x (m)"),
        ("angle", "Worn profiles around the beam", "angle from straight down (deg)"),
    ):
        curves = []
        for face, one in profiles.items():
            places, owners = np.unique(np.round(one[key], DIGITS), return_inverse=True)
            if key == "x" or len(places) > 1:
                deepest = np.zeros(len(places))
                np.maximum.at(deepest, owners, np.array(one["depth"]) / MILLIMETER)
                curves.append(ChartCurve(face, places, deepest, "lines+markers"))
        if curves:
            charts.append(Chart(title, label, "depth of the deepest point (mm)", curves, command))
    return charts


def _curves(states: Sequence[dict[str, Any]], faces: Sequence[str], key: str, unit: float) -> list[ChartCurve]:
    hours = [state["time"] / HOUR for state in states]
    values = [[value / unit for value in state[key]] for state in states]
    return [
        ChartCurve(face, hours, [row[place] for row in values], "lines+markers") for place, face in enumerate(faces)
    ]
