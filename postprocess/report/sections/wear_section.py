"""How fast the faces of the supports wear, with intervals where there are."""

from __future__ import annotations

from typing import Any

from gapbeam.postprocess.report.blocks import Block, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number

HEADER = ("face", "rate", "value", "unit", "95 % interval", "judged")
PARTS_HEADER = ("face", "work (J)", "impact (%)", "sliding (%)", "sticking (%)")
RATES = {"work_rate": ("work rate", "W"), "volume_rate": ("volume rate", "m^3/s"), "depth_rate": ("depth rate", "m/s")}


def wear_section(summary: dict[str, Any], anchor: str = "wear") -> ReportSection | None:
    """Return the wear of a run; None for a run of a case without [wear].

    Args:
        summary: Of a run.
        anchor: Of the section.
    """
    found = summary.get("wear")
    if not found:
        return None
    words = f"Work of sliding over {number(found['seconds'])} s. Rates without an interval are means from t = 0."
    if found["area"] is not None:
        words += f" Depths are volumes spread evenly over {number(found['area'])} m^2 of each face."
    rows = [
        (face, name, of_face[key]["value"], unit, _interval(of_face[key]), of_face["verdict"])
        for face, of_face in found["faces"].items()
        for key, (name, unit) in RATES.items()
        if of_face[key] is not None
    ]
    blocks: list[Block] = [Words(words), TableBlock("How fast the faces wear", HEADER, rows)]
    if (parts := _parts(found)) is not None:
        blocks += parts
    return ReportSection("Wear", anchor, blocks)


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
