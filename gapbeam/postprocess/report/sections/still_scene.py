"""The scene of a run that left no fields: the beam as its case describes it, undeformed in its supports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.report.moving_scene import MovingScene, SceneBeam, SceneWall
from gapbeam.postprocess.report.sections.scene_section import magnification_of, walls_of
from gapbeam.postprocess.report.station_motion import SQUARE, circle, hull_of
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.supports_of_run import supports_of

WORDS = (
    "The structure in its supports, undeformed; gaps are magnified. The run left fewer than three fields of motion, "
    "so that the scene does not move: a run in time with `output.fields_interval` well below `time.end` writes them."
)
_ROUND = ("round", "tube")


def still_scene_of(results: Results, command: str) -> MovingScene | None:
    """Return the scene of a run without fields; None where its case does not describe a beam.

    Args:
        results: Of a run with a history.
        command: That makes the report.

    Raises:
        ResultsError: The case or the history cannot be read.
    """
    beam = resting_beam(results.case)
    if beam is None:
        return None
    walls = resting_walls(results, results.history, beam)
    gaps = [wall.met.gap + max(wall.met.recesses, default=0.0) for wall in walls]
    return MovingScene(WORDS, np.zeros(1), beam, walls, magnification_of(beam, gaps), 0, command)


def resting_walls(results: Results, history: xr.Dataset, beam: SceneBeam) -> Sequence[SceneWall]:
    """Return the faces where they are at t = 0, without forces, which belong to a motion that is not shown."""
    height = float(beam.half[:, 1].max())
    found = walls_of(
        supports_of(results.summary, results.case), history, np.zeros(1), float(beam.stations[0]), (-height, height)
    )
    return [replace(wall, force=np.empty(0)) for wall in found]


def resting_beam(case: Mapping[str, Any]) -> SceneBeam | None:
    """Return the beam of a case with its segments; None where the case has no size of a beam."""
    table = case.get("beam") or {}
    try:
        length, thickness = float(table["length"]), float(table["thickness"])
        width = float(table.get("width") or thickness)
    except (KeyError, TypeError, ValueError):
        return None
    parts = [(0.0, length, thickness, width)]
    for one in case.get("segment") or ():
        size = float(one.get("thickness") or thickness), float(one.get("width") or width)
        parts.append((float(one["from"]), float(one["to"]), *size))
    edges = np.unique([end for part in parts for end in part[:2]])
    stations, half = [], []
    for start, end in pairwise(edges):
        _, _, high, wide = [part for part in parts if part[0] <= start and end <= part[1]][-1]
        stations += [start, end]
        half += [(0.5 * wide, 0.5 * high)] * 2
    planar, at_rest = (case.get("mesh") or {}).get("dimension") == 2, np.zeros((1, len(stations)))
    middle = np.zeros((len(stations), 2))
    outline = _outline(table.get("section"))
    return SceneBeam(
        np.array(stations), outline, np.array(half), middle, at_rest, at_rest, at_rest, np.zeros(1), planar
    )


def _outline(section: object) -> np.ndarray:
    """Return the convex outline of a section in its box, whose middle is the axis, (n, 2)."""
    table = section if isinstance(section, Mapping) else {"type": section}
    if table.get("type") in _ROUND:
        return circle()
    points = np.array(table.get("points") or (), dtype=float)
    return hull_of(points) if points.size else SQUARE
