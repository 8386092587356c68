"""Figure: the orbits of the probes across the beam."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, letter, panels

ASIDE = 1.0e-6  # of the vertical motion; less is round-off
IN_A_ROW = 4


def moves_in_space(history: xr.Dataset) -> bool:
    """Return whether a probe moves out of the bending plane."""
    if "displacement" not in history or history.sizes.get("component", 0) < 3 or not history.sizes.get("probe", 0):
        return False
    lateral, vertical = (np.ptp(history["displacement"].values[..., axis], axis=0) for axis in (1, 2))
    return bool(np.any(lateral > ASIDE * vertical.max(initial=0.0)) and np.all(np.isfinite(lateral)))


def draw_orbits(history: xr.Dataset, start: float) -> Figure:
    """Draw z over y of every probe on equal scales, from the undeformed beam in the origin.

    Args:
        history: `Results.history`, with displacements in space.
        start: What is drawn before this time is gray, s.
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
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(name, loc="right", fontsize="medium", pad=3.0)
        panel.set_xlabel(f"y ({unit})")
    for panel in axes.flat[len(names) :]:
        panel.set_visible(False)
    for row in axes:
        row[0].set_ylabel(f"z ({unit})")
    letter(list(axes.flat[: len(names)]))
    return figure
