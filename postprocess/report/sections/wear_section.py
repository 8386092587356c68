"""How fast the faces of the supports wear, with intervals where there are."""

from __future__ import annotations

from typing import Any

from gapbeam.postprocess.report.blocks import ReportSection, TableBlock, Words
from gapbeam.postprocess.report.number_text import number

HEADER = ("face", "rate", "value", "unit", "95 % interval", "judged")
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
    return ReportSection("Wear", anchor, [Words(words), TableBlock("How fast the faces wear", HEADER, rows)])


def _interval(rate: dict[str, Any]) -> str:
    return "" if rate["low"] is None else f"{number(rate['low'])} to {number(rate['high'])}"
