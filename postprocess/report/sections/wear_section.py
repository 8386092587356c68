"""How fast the faces of the supports wear, with intervals where there are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.number_text import number
from gapbeam.postprocess.results.wear_of_run import WearMap

HEADER = ("face", "rate", "value", "unit", "95 % interval", "judged")
WHERE_HEADER = ("face", "x (m)", "angle (deg)", "work rate per area (W/m^2)", "over the mean", "depth rate (m/s)")
PARTS_HEADER = ("face", "work (J)", "impact (%)", "sliding (%)", "sticking (%)")
RATES = {"work_rate": ("work rate", "W"), "volume_rate": ("volume rate", "m^3/s"), "depth_rate": ("depth rate", "m/s")}


def wear_section(
    summary: dict[str, Any], maps: Mapping[str, WearMap], command: str = "", anchor: str = "wear"
) -> ReportSection | None:
    """Return the wear of a run; None for a run of a case without [wear].

    Args:
        summary: Of a run.
        maps: Where its faces wear; none of earlier releases.
        command: That makes the report.
        anchor: Of the section.
    """
    found = summary.get("wear")
    if not found:
        return None
    words = f"Work of sliding over {number(found['seconds'])} s. Rates without an interval are means from t = 0."
    areas = {face: one.get("area", found["area"]) for face, one in found["faces"].items()}
    if known := {face: area for face, area in areas.items() if area is not None}:
        spread = ", ".join(f"{number(area)} m^2 of {face}" for face, area in known.items())
        words += f" Depths are volumes spread evenly over {spread}."
    rows = [
        (face, name, of_face[key]["value"], unit, _interval(of_face[key]), of_face["verdict"])
        for face, of_face in found["faces"].items()
        for key, (name, unit) in RATES.items()
        if of_face[key] is not None
    ]
    blocks: list[Block] = [Words(words), TableBlock("How fast the faces wear", HEADER, rows)]
    if (parts := _parts(found)) is not None:
        blocks += parts
    blocks += _where(maps, command)
    return ReportSection("Wear", anchor, blocks)


def _where(maps: Mapping[str, WearMap], command: str) -> list[Block]:
    """Return where the faces wear most, and charts along the beam and around it."""
    worn = {face: one for face, one in maps.items() if one.unevenness > 0.0}
    if not worn:
        return []
    rows: list[tuple[Cell, ...]] = []
    for face, one in worn.items():
        most = int(np.argmax(one.density))
        depth = None if one.depth_rate is None else float(one.depth_rate[most])
        rows.append((face, float(one.x[most]), float(one.angle[most]), float(one.density[most]), one.unevenness, depth))
    note = "The depth rate is that of this point alone, with its own area. Angles are from straight down."
    found: list[Block] = [TableBlock("Where the faces wear most", WHERE_HEADER, rows, notes=(note,))]
    density = "work rate per area (W/m^2)"
    lines = [ChartCurve(face, *one.along()) for face, one in worn.items()]
    found.append(Chart("Wear along the beam", "x (m)", density, lines, command))
    if turned := [ChartCurve(face, *one.turned()) for face, one in worn.items() if one.around]:
        found.append(Chart("Wear around the beam", "angle from straight down (deg)", density, turned, command))
    return found


def _parts(found: dict[str, Any]) -> list[Block] | None:
    """Return the work by mode of motion; None: nothing was done, or the run is of an earlier release."""
    rows = [
        (face, of_face["work"], *(100.0 * part / of_face["work"] for part in of_face["work_by_mode"].values()))
        for face, of_face in found["faces"].items()
        if of_face["work"] > 0.0 and "work_by_mode" in of_face
    ]
    if not rows:
        return None
    words = f"Impact: the first {number(found['impact_time'])} s of each contact of a face. "
    slip = found["sticking_speed"]
    words += f"Sticking: slower than {number(slip)} m/s behind that." if slip else "Without friction nothing sticks."
    return [TableBlock("By which motion", PARTS_HEADER, rows), Words(words)]


def _interval(rate: dict[str, Any]) -> str:
    return "" if rate["low"] is None else f"{number(rate['low'])} to {number(rate['high'])}"
