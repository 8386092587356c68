"""Moving scene of a run: fields, magnification, and walls at their times; without fields, the undeformed beam."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import rounded_down, size_words
from gapbeam.postprocess.report.blocks import number
from gapbeam.postprocess.report.moving_scene import ContactMap, MovingScene, SceneBeam, SceneWall
from gapbeam.postprocess.report.station_motion import (
    SQUARE,
    beam_of,
    circle,
    contact_maps_of,
    hull_of,
    stations_of,
    within_room,
)
from gapbeam.postprocess.results.columns_of_run import RunSupport, supports_of, wall_motion_series
from gapbeam.postprocess.results.results import Results
from gapbeam.solver.schema.record_table import FIELDS_FILE

MOST = 400  # frames
LEAST = 3  # fields that show a motion
FEWEST = 24  # of a large mesh
POINTS = 2.0e7  # of the mesh, in all frames together: a few seconds to read
SMOOTH = 12  # frames in a forcing period, that a motion looks as it is
_SHARE = 0.8  # of the thickness: the largest motion as it is drawn
_GAP = 0.25  # of the thickness: the largest gap as it is drawn, where the motion allows that
_SWING = 0.1  # of the length: the largest motion as it is drawn for that


def scene_of(
    results: Results, command: str, begin: float | None = None, end: float | None = None
) -> MovingScene | None:
    """Return the scene of a run, or of a span of it; None where that has fewer than three fields, its ends at most.

    Args:
        results: Results of a run.
        command: Command that makes the report.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.

    Raises:
        ResultsError: The fields or the history cannot be read.
    """
    if not (results.folder / FIELDS_FILE).is_file():
        return None
    with results.fields() as fields:
        there = range(len(fields)) if begin is None and end is None else within(fields.times, begin, end)
        if len(there) < LEAST:
            return None
        history, frequency = results.history, results.forcing_frequency
        interval = fields.frame(there[1]).time - fields.frame(there[0]).time
        numbers = [there[k] for k in frames_shown(len(there), len(fields.points), interval, frequency)]
        frames = [fields.frame(k) for k in numbers]
        beam = beam_of(stations_of(fields.points, fields.dimension), frames, fields.dimension, _width(results.case))
        bending = fields.points[:, fields.dimension - 1]
        size = float(bending.min()), float(bending.max())
        total, times = len(there), np.array([frame.time for frame in frames])
        walls = walls_of(supports_of(results.summary, results.case), history, times, float(beam.stations[0]), size)
        maps = contact_maps_of(fields.points, fields.cells, fields.dimension, walls, frames)
    maps, left_out = within_room(maps)
    gaps = [wall.met.gap + max(wall.met.recesses, default=0.0) for wall in walls]
    opening = _opening(beam, walls)
    words = _words(times, len(numbers), total, frequency) + _words_on_maps(maps, left_out, beam.planar)
    return MovingScene(words, times, beam, walls, magnification_of(beam, gaps), opening, command, maps)


def within(times: np.ndarray, begin: float | None, end: float | None) -> range:
    """Return the numbers of the fields from one time to another, both within round-off.

    Args:
        times: Times of all fields, ascending, s.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.
    """
    slack = 1.0e-9 * float(np.max(np.abs(times), initial=0.0))
    first = 0 if begin is None else int(np.searchsorted(times, begin - slack))
    last = len(times) if end is None else int(np.searchsorted(times, end + slack))
    return range(first, last)


def frames_shown(count: int, points: int, interval: float, frequency: float | None) -> list[int]:
    """Return the numbers of the fields that a scene shows: all, some evenly, or the last ones.

    The last ones where every second or third of a forced motion would be too few to see it as it is.

    Args:
        count: Fields there are.
        points: Points of the mesh.
        interval: Interval between fields, s.
        frequency: Frequency of the forcing, Hz.
    """
    most = int(min(MOST, max(FEWEST, POINTS // max(points, 1))))
    every = -(-(count - 1) // most)  # the start and `most` fields after it, at least every second
    if every < 2:
        return list(range(count))
    if frequency is not None and every * interval * frequency * SMOOTH > 1.0:
        return list(range(count - most - 1, count))
    return list(range(0, count, every))


def magnification_of(beam: SceneBeam, gaps: Sequence[float] = ()) -> float:
    """Return a round factor, at least 1, of displacements and gaps.

    With it the largest motion is drawn nearly as large as the beam is thick; a larger one draws the gaps as a quarter
    of it, where the motion stays a small part of the length.

    Args:
        beam: The moving beam.
        gaps: Gaps of the walls, m.
    """
    gap = max(gaps, default=0.0)
    if beam.farthest == 0.0 and gap <= 0.0:
        return 1.0
    wished = _SHARE * beam.thickness / beam.farthest if beam.farthest else _GAP * beam.thickness / gap
    if beam.farthest and gap > 0.0:
        length = float(np.ptp(beam.stations))
        wished = max(wished, min(_GAP * beam.thickness / gap, _SWING * length / beam.farthest))
    return max(1.0, rounded_down(wished))


def walls_of(
    supports: Sequence[RunSupport], history: xr.Dataset, times: np.ndarray, start: float, size: tuple[float, float]
) -> list[SceneWall]:
    """Return the faces of the supports with their motion and contact force at the times of the frames.

    Args:
        supports: Supports of the run.
        history: History of the run.
        times: Times of the frames, s.
        start: x of the end of the beam that their places count from, m.
        size: Lowest and highest place of the beam in the bending direction, m.
    """
    recorded, middle = history["time"].values, 0.5 * (size[0] + size[1])
    motions = wall_motion_series(history)
    forces = history.get("contact_force")
    known = [] if forces is None else [str(name) for name in forces["face"].values]
    walls = []
    for one in supports:
        bottom, top = size
        if one.thickness is not None:
            bottom, top = middle - 0.5 * one.thickness, middle + 0.5 * one.thickness
        for met in one.faces:
            moved = None
            if any(name in motions for name, _ in met.moves):
                places = [met.moved({name: float(v[k]) for name, v in motions.items()}) for k in range(len(recorded))]
                rows = np.array([(place.gap, place.offset, place.lateral) for place in places])
                moved = np.column_stack([np.interp(times, recorded, rows[:, k]) for k in range(3)])
            force = np.empty(0)
            if forces is not None and met.face in known:
                force = np.interp(times, recorded, forces.sel(face=met.face).values)
            along = (start + one.start, start + one.end)
            walls.append(SceneWall(met, one.name, along, bottom, top, moved, force))
    return walls


def _width(case: Mapping[str, Any]) -> float:
    beam = case.get("beam") or {}
    return float(beam.get("width") or beam.get("thickness") or 0.0)


def _opening(beam: SceneBeam, walls: Sequence[SceneWall]) -> int:
    """Return the frame with the largest contact force, or with the largest displacement."""
    forces = [wall.force for wall in walls if wall.force.size]
    total = np.sum(forces, axis=0) if forces else np.zeros(len(beam.slide))
    if np.any(total > 0.0):
        return int(np.argmax(total))
    return int(np.argmax(np.hypot(beam.lateral, beam.vertical).max(axis=1)))


def _words(times: np.ndarray, shown: int, total: int, frequency: float | None) -> str:
    span = f"from {number(float(times[0]), 3)} to {number(float(times[-1]), 3)} s"
    which = f"all {total} fields" if shown == total else f"{shown} of {total} fields"
    words = f"The structure in its supports, {which} {span}; displacements and gaps are magnified alike."
    interval = float(np.diff(times).max(initial=0.0))
    if frequency is not None and interval * frequency * 8.0 > 1.0:
        words += (
            f" There is a field every {size_words(interval, 3, 's')}, fewer than eight in a forcing period: the motion "
            "looks slower or rougher than it is. A smaller `output.fields_interval` shows it as it is."
        )
    return words


def _words_on_maps(maps: Sequence[ContactMap], left_out: Sequence[str], planar: bool) -> str:
    """Return the caption of the maps of contact pressure, with the supports left out for want of room."""
    parts = []
    if any(one.around for one in maps):
        parts.append("over x and the angle around the beam, which counts from its lowest line toward +y")
    if not all(one.around for one in maps):
        parts.append(f"over x{' on planes' if parts else ''}{'' if planar else ', the largest across the beam'}")
    words = f" Below it stands the contact pressure at the same time, {'; '.join(parts)}." if parts else ""
    if left_out:
        words += f" The pressures on {', '.join(left_out)} are too many for a page."
    return words


WORDS = (
    "The structure in its supports, undeformed; gaps are magnified. The run left fewer than three fields of motion, "
    "so that the scene does not move: a run in time with `output.fields_interval` well below `time.end` writes them."
)
_STILL_SCENE_ROUND = ("round", "tube")


def still_scene_of(results: Results, command: str) -> MovingScene | None:
    """Return the scene of a run without fields; None where its case does not describe a beam.

    Args:
        results: Results of a run with a history.
        command: Command that makes the report.

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
    if table.get("type") in _STILL_SCENE_ROUND:
        return circle()
    points = np.array(table.get("points") or (), dtype=float)
    return hull_of(points) if points.size else SQUARE
