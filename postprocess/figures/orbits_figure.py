"""Figure: the orbits of the probes across the beam."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, VERMILION, letter, panels
from gapbeam.postprocess.results.supports_of_run import RunSupport

ASIDE = 1.0e-6  # of the vertical motion; less is round-off
IN_A_ROW = 4


def moves_in_space(history: xr.Dataset) -> bool:
    """Return whether a probe moves out of the bending plane."""
    if "displacement" not in history or history.sizes.get("component", 0) < 3 or not history.sizes.get("probe", 0):
        return False
    lateral, vertical = (np.ptp(history["displacement"].values[..., axis], axis=0) for axis in (1, 2))
    return bool(np.any(lateral > ASIDE * vertical.max(initial=0.0)) and np.all(np.isfinite(lateral)))


def holes_at_probes(case: Mapping[str, Any], supports: Sequence[RunSupport]) -> dict[str, tuple[float, float]]:
    """Return clearance and offset, m, of the hole in which a probe on the axis is, by the name of the probe."""
    found = {}
    for probe in case.get("probe") or ():
        place, *aside = np.atleast_1d(probe["point"])
        for one in supports:
            if one.faces[0].around and one.start <= place <= one.end and not np.any(aside):
                found[str(probe["name"])] = one.clearance, one.faces[0].offset
    return found


def draw_orbits(history: xr.Dataset, start: float, holes: Mapping[str, tuple[float, float]]) -> Figure:
    """Draw z over y of every probe on equal scales, from the undeformed beam in the origin.

    Args:
        history: `Results.history`, with displacements in space.
        start: What is drawn before this time is gray, s.
        holes: Clearance and offset, m, of the hole that a probe is in: a circle that its orbit does not leave but by
            penetration and by the tilt of the beam.
    """
    names = [str(name) for name in history["probe"].values]
    rows = -(-len(names) // IN_A_ROW)
    columns = min(len(names), IN_A_ROW)
    figure, axes = panels(rows, columns, height=2.6 if columns < IN_A_ROW else 1.9)
    before = history["time"].values < start
    unit, factor = shown("m")
    for panel, name in zip(axes.flat, names, strict=False):
        y, z = (factor * history["displacement"].sel(probe=name, component=axis).values for axis in "yz")
        panel.plot(y[before], z[before], color=GRAY, lw=0.5, zorder=1)
        panel.plot(y[~before], z[~before], color=BLACK, lw=0.6, zorder=2)
        if name in holes:
            clearance, offset = (factor * value for value in holes[name])
            turn = np.linspace(0.0, 2.0 * np.pi, 181)
            y, z = clearance * np.cos(turn), offset + clearance * np.sin(turn)
            panel.plot(y, z, color=VERMILION, lw=0.8, ls="--", zorder=3)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(name, loc="right", fontsize="medium", pad=3.0)
        panel.set_xlabel(f"y ({unit})")
    for panel in axes.flat[len(names) :]:
        panel.set_visible(False)
    for row in axes:
        row[0].set_ylabel(f"z ({unit})")
    letter(list(axes.flat[: len(names)]))
    return figure
