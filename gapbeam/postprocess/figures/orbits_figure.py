"""Figure: the orbits of the probes across the beam."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, VERMILION, letter, panels
from gapbeam.postprocess.figures.room_in_support import room_of
from gapbeam.postprocess.results.supports_of_run import RunSupport, wall_motion_series

ASIDE = 1.0e-6  # of the vertical motion; less is round-off
IN_A_ROW = 4


def moves_in_space(history: xr.Dataset) -> bool:
    """Return whether a probe moves out of the bending plane."""
    if "displacement" not in history or not history.sizes.get("probe", 0):
        return False
    if "z" not in history["component"].values:
        return False
    lateral, vertical = (np.ptp(history["displacement"].sel(component=axis).values, axis=0) for axis in "yz")
    return bool(np.any(lateral > ASIDE * vertical.max(initial=0.0)) and np.all(np.isfinite(lateral)))


def farthest(history: xr.Dataset) -> float:
    """Return the largest distance of a probe from its place across the beam, m."""
    return float(np.hypot(*(history["displacement"].sel(component=axis).values for axis in "yz")).max())


def rooms_at_probes(
    case: Mapping[str, Any], supports: Sequence[RunSupport], motion: float = 0.0
) -> dict[str, np.ndarray]:
    """Return the region that a support leaves to each probe on the axis in it, (n, 2), m, by the name of the probe.

    Args:
        case: The case as run.
        supports: Its supports.
        motion: The largest distance of a probe from its place, m: open regions are shown somewhat farther.
    """
    found = {}
    for name, place, one in _in_supports(case, supports):
        if not any(change[0] for _, change in one.faces[0].moves):  # a region that opens and closes has no one outline
            rise = one.faces[0].tilt * (place - 0.5 * (one.start + one.end))
            found[name] = room_of(one.faces[0], motion) + np.array([0.0, rise])
    return found


def shifts_at_probes(
    case: Mapping[str, Any], supports: Sequence[RunSupport], history: xr.Dataset
) -> dict[str, np.ndarray]:
    """Return how far the support around each probe on the axis in it has moved, (times, 2), m, by the probe's name.

    Args:
        case: The case as run.
        supports: Its supports.
        history: `Results.history`.
    """
    found, motions = dict[str, np.ndarray](), wall_motion_series(history)
    for name, _, one in _in_supports(case, supports):
        for motion, (_, up, aside) in one.faces[0].moves:
            if up or aside:
                along = motions[motion][:, None] * np.array([aside, up])
                found[name] = found.get(name, 0.0) + along
    return found


def _in_supports(case: Mapping[str, Any], supports: Sequence[RunSupport]) -> Iterator[tuple[str, float, RunSupport]]:
    """Yield the probes on the axis in supports around the beam: name, place along the beam, support."""
    for probe in case.get("probe") or ():
        place, *aside = np.atleast_1d(probe["point"])
        for one in supports:
            if one.faces[0].around and one.start <= place <= one.end and not np.any(aside):
                yield str(probe["name"]), float(place), one


def draw_orbits(
    history: xr.Dataset, start: float, rooms: Mapping[str, np.ndarray], shifts: Mapping[str, np.ndarray]
) -> Figure:
    """Draw z over y of every probe on equal scales, from the undeformed beam in the origin.

    Args:
        history: `Results.history`, with displacements in space.
        start: What is drawn before this time is gray, s.
        rooms: Corners of the region that the support around a probe leaves to it, m: its orbit does not leave that but
            by penetration and by the tilt of the beam.
        shifts: How far the support around a probe has moved, (times, 2), m: its orbit is that in the support.
    """
    names = [str(name) for name in history["probe"].values]
    rows = -(-len(names) // IN_A_ROW)
    columns = min(len(names), IN_A_ROW)
    figure, axes = panels(rows, columns, height=2.6 if columns < IN_A_ROW else 1.9)
    before = history["time"].values < start
    unit, factor = shown("m")
    for panel, name in zip(axes.flat, names, strict=False):
        path = np.stack([history["displacement"].sel(probe=name, component=axis).values for axis in "yz"], axis=1)
        y, z = factor * (path - shifts.get(name, 0.0)).T
        panel.plot(y[before], z[before], color=GRAY, lw=0.5, zorder=1)
        panel.plot(y[~before], z[~before], color=BLACK, lw=0.6, zorder=2)
        if len(rooms.get(name, ())):
            y, z = factor * rooms[name].T
            panel.plot(y, z, color=VERMILION, lw=0.8, ls="--", zorder=3)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(f"{name}, in its support" if name in shifts else name, loc="right", fontsize="medium", pad=3.0)
        panel.set_xlabel(f"y ({unit})")
    for panel in axes.flat[len(names) :]:
        panel.set_visible(False)
    for row in axes:
        row[0].set_ylabel(f"z ({unit})")
    letter(list(axes.flat[: len(names)]))
    return figure
