"""Segments of drawn cases: one of another section or material, in the longest part of the beam without supports."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from benchmarks.drawn_schema.tables import Draw
from gapbeam.solver.case.segment_table import PlacedSegment, Segment
from gapbeam.solver.sections.section_choice import SectionChoice
from gapbeam.solver.table import models_in, type_name

SEGMENTED = 0.15  # share of the cases
MARGIN = 0.1  # of the free part, on either side
SECTIONS = models_in(SectionChoice)


def drawn_segments(draw: Draw) -> list[dict[str, Any]]:
    """Draw the segment of a few cases, without its place."""
    if not _asked(draw) and draw.chance.random() > SEGMENTED:
        return []
    return [draw.table(PlacedSegment)]


def with_segments(draw: Draw, whole: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a case with its segment where it fits, and a beam and a mesh that its section fits to."""
    if not whole.get("segment"):
        return {key: value for key, value in whole.items() if key != "segment"}
    (segment,) = whole["segment"]
    if _asks_for_section(draw):
        kind = segment["section"]["type"]
        if kind == "polygon":  # drawn as thick as the beam
            segment = {key: value for key, value in segment.items() if key != "thickness"}
        kept = {key: value for key, value in whole["mesh"].items() if key not in ("cell", "plane")}
        section = {"type": "round" if kind in ("round", "tube") else "rectangle"}
        whole = whole | {"beam": whole["beam"] | {"section": section}, "mesh": kept | {"dimension": 3}}
    else:
        segment = {key: value for key, value in segment.items() if key != "section"}
    start, end = _free_part(draw, whole["support"])
    margin = MARGIN * (end - start)
    place = {"name": "part", "from": round(start + margin, 6), "to": round(end - margin, 6)}
    return whole | {"segment": [segment | place]}


def _free_part(draw: Draw, support: Any) -> tuple[float, float]:
    """Return the longest part of the beam without supports, m."""
    if isinstance(support, dict):
        return float(support["length"]), draw.scene.length
    ends = [0.0, *(end for one in sorted(support, key=_start) for end in (one["from"], one["to"])), draw.scene.length]
    return max(list(pairwise(ends))[::2], key=lambda part: part[1] - part[0])


def _start(support: dict[str, Any]) -> float:
    return float(support["from"])


def _asked(draw: Draw) -> bool:
    """Return whether the choice in focus is one of segments."""
    whole = (draw.focus.table, draw.focus.key) == ("Case", "segment")
    return whole or draw.focus.table in (Segment.__name__, PlacedSegment.__name__)


def _asks_for_section(draw: Draw) -> bool:
    """Return whether the choice in focus is the section of a segment."""
    return _asked(draw) and draw.focus.key == "section" and draw.focus.value in map(type_name, SECTIONS)
