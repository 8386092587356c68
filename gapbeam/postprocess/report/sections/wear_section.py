"""How fast the faces of the supports wear, with intervals where there are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.number_text import number
from gapbeam.postprocess.report.sections.along_supports import chart_along
from gapbeam.postprocess.results.wear_of_run import WearMap

HEADER = ("face", "rate", "value", "unit", "95 % interval", "judged")
WHERE_HEADER = ("face", "x (m)", "angle (deg)", "work rate per area (W/m^2)", "over the mean", "depth rate (m/s)")
PARTS_HEADER = ("face", "work (J)", "impact (%)", "sliding (%)", "sticking (%)")
PART_RATES_HEADER = ("face", "motion", "work rate (W)", "95 % interval (W)", "judged")
LARGEST_HEADER = (
    "face", "x (m)", "angle (deg)", "work rate per area (W/m^2)", "95 % interval of the largest", "by other batches",
    "depth rate (m/s)",
)  # fmt: skip
LARGEST_NOTE = (
    "Behind the burn-in. The largest of many means with chance in them is larger than the mean of its place: the "
    "interval is that of the largest true mean (all points at once, Bonferroni). By other batches: the mean at "
    "places that the other half of the record chose, which chance does not lift."
)
RATES = {"work_rate": ("work rate", "W"), "volume_rate": ("volume rate", "m^3/s"), "depth_rate": ("depth rate", "m/s")}


def wear_section(
    summary: dict[str, Any],
    maps: Mapping[str, WearMap],
    command: str = "",
    anchor: str = "wear",
    since: str = "t = 0",
) -> ReportSection | None:
    """Return the wear of a run; None for a run of a case without [wear].

    Args:
        summary: Of a run.
        maps: Where its faces wear; none of earlier releases.
        command: That makes the report.
        anchor: Of the section.
        since: When the work begins to count.
    """
    found = summary.get("wear")
    if not found:
        return None
    words = f"Work of sliding over {number(found['seconds'])} s. Rates without an interval are means from {since}."
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
    blocks += [*_largest(found), *_where(maps, command)]
    return ReportSection("Wear", anchor, blocks)


def _largest(found: dict[str, Any]) -> list[Block]:
    """Return the largest work rate per area of each face with its interval; nothing for runs without statistics."""
    rows: list[tuple[Cell, ...]] = []
    for face, of_face in found["faces"].items():
        if (one := of_face.get("largest")) is not None:
            rate, depth = one["work_rate_per_area"], one["depth_rate"]
            at = one["at_places_of_other_batches"]
            deepest = "" if depth is None else f"{number(depth['value'])} ({_interval(depth)})"
            rows.append((face, one["x"], one["angle"], rate["value"], _interval(rate), at, deepest))
    if not rows:
        return []
    return [TableBlock("The largest of each map", LARGEST_HEADER, rows, notes=(LARGEST_NOTE,))]


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
    found.append(
        chart_along("Wear along the beam", density, {face: one.along() for face, one in worn.items()}, command)
    )
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
    if doubt := found.get("parts_doubt"):
        words += f" **Doubt:** {doubt}. Their sum is not concerned."
    rates = [
        (face, mode, rate["value"], _interval(rate), rate["verdict"])
        for face, of_face in found["faces"].items()
        for mode, rate in of_face.get("work_rate_by_mode", {}).items()
        if rate["low"] is not None and rate["verdict"] != "no event"
    ]
    more = [TableBlock("Work rate by motion", PART_RATES_HEADER, rates)] if rates else []
    return [TableBlock("By which motion", PARTS_HEADER, rows), Words(words), *more]


def _interval(rate: dict[str, Any]) -> str:
    return "" if rate["low"] is None else f"{number(rate['low'])} to {number(rate['high'])}"
