"""Where the beam touches its supports: first touch, share of time in contact, penetration and impulse of the points."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.sections.along_supports import chart_along
from gapbeam.postprocess.results.points_of_run import PointMap

HEADER = (
    "face", "points touched", "first touch (s)", "at x (mm)", "at angle (deg)", "contact share, largest (%)",
    "penetration, largest (µm)",
)  # fmt: skip
PRESSED_HEADER = ("face", "impulse (N s)", "most per area (N s/m²)", "over the mean", "at x (mm)", "at angle (deg)")
SHARE, PRESSED = "contact share (%)", "impulse per area (N s/m²)"


def points_section(
    points: Mapping[str, PointMap], command: str = "", anchor: str = "contact-points"
) -> ReportSection | None:
    """Return what the contact points of a run have met; None for a run without `output.points`.

    Args:
        points: Of the faces, by name.
        command: That makes the report.
        anchor: Of the section.
    """
    if not points:
        return None
    touched = {face: one for face, one in points.items() if one.touched}
    title = "Contact points"
    if not touched:
        return ReportSection(title, anchor, [Words("No contact point was in contact at a record.")])
    rest = [face for face in points if face not in touched]
    note = "Seen at the records of the history. Angles are from straight down, positive toward +y."
    notes = (note, f"Not touched at a record: {', '.join(rest)}.") if rest else (note,)
    first = TableBlock("What was touched", HEADER, [_row(face, one) for face, one in touched.items()], notes=notes)
    blocks: list[Block] = [first]
    known = {face: one for face, one in touched.items() if np.all(np.isfinite(one.impulse)) and one.impulse.sum() > 0.0}
    if known:
        rows = [_pressed(face, one) for face, one in known.items()]
        blocks.append(TableBlock("Where the impulse is largest", PRESSED_HEADER, rows))
    blocks += _charts(
        "Contact share", SHARE, {face: (one, 100.0 * one.share) for face, one in touched.items()}, command
    )
    blocks += _charts("Impulse", PRESSED, {face: (one, one.pressed) for face, one in known.items()}, command)
    return ReportSection(title, anchor, blocks)


def _row(face: str, one: PointMap) -> tuple[Cell, ...]:
    at = int(np.nanargmin(one.first_touch))
    count = f"{int(np.isfinite(one.first_touch).sum())} of {len(one.x)}"
    share, deepest = 100.0 * float(one.share.max()), 1e6 * float(one.deepest.max())
    return face, count, float(one.first_touch[at]), 1e3 * float(one.x[at]), _angle(one, at), share, deepest


def _pressed(face: str, one: PointMap) -> tuple[Cell, ...]:
    at, total = int(np.argmax(one.pressed)), float(one.impulse.sum())
    most = float(one.pressed[at])
    mean = total / float(one.area.sum())
    return face, total, most, most / mean, 1e3 * float(one.x[at]), _angle(one, at)


def _angle(one: PointMap, at: int) -> float | None:
    """Return the direction of a point, degrees; None on a plane, which has one for all."""
    return float(one.angle[at]) if one.around else None


def _charts(name: str, unit: str, faces: Mapping[str, tuple[PointMap, np.ndarray]], command: str) -> list[Block]:
    """Return means of values along the beam, and around it where faces have several directions."""
    if not faces:
        return []
    lines = {face: one.along(values) for face, (one, values) in faces.items()}
    found: list[Block] = [chart_along(f"{name} along the beam, means by area", unit, lines, command)]
    around = [ChartCurve(face, *one.turned(values)) for face, (one, values) in faces.items() if one.around]
    if around:
        angle = "angle from straight down (deg)"
        found.append(Chart(f"{name} around the beam, means by area", angle, unit, around, command))
    return found
