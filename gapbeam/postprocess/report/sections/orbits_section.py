"""Orbits of the probes across the beam, on which a dot follows the time of the page."""

from __future__ import annotations

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.motion_figures import farthest, moves_in_space, rooms_at_probes, shifts_at_probes
from gapbeam.postprocess.report.blocks import ReportSection
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.supports_of_run import supports_of

MOST = 6000  # points of an orbit


def orbits_section(results: Results, command: str) -> ReportSection | None:
    """Return z over y of every probe, with what its support leaves to it; None where all stay in the bending plane.

    Args:
        results: Results of a run with a history.
        command: That makes the figure.

    Raises:
        ResultsError: The history cannot be read.
    """
    history = results.history
    if history.sizes["time"] < 2 or not moves_in_space(history):
        return None
    supports = supports_of(results.summary, results.case)
    rooms = rooms_at_probes(results.case, supports, farthest(history))
    shifts = shifts_at_probes(results.case, supports, history)
    unit, factor = shown("m")
    every = slice(None, None, -(-history.sizes["time"] // MOST))
    curves, names = [], [str(name) for name in history["probe"].values]
    for name in names:
        path = np.stack([history["displacement"].sel(probe=name, component=axis).values for axis in "yz"], axis=1)
        y, z = factor * (path - shifts.get(name, 0.0))[every].T
        curves.append(ChartCurve("orbit", y, z, choice=name, times=history["time"].values[every]))
        room = rooms.get(name)
        if room is not None and len(room):
            aside, up = factor * np.asarray(room).T
            curves.append(ChartCurve("room in the support", aside, up, choice=name, dashed=True))
    bodies = _body_orbits(history, factor, every)
    curves += bodies
    words = "Orbit of each probe across the beam, from the undeformed beam in the origin; the dot follows the time."
    if rooms:
        words += " Dashed: the region that a support leaves to a probe on the axis in it."
    if bodies:
        words += " Supports with a mass have orbits of their own, from where their springs are relaxed."
    if shifts:
        words += f" Orbits of {', '.join(shifts)} are drawn in their supports, which move."
    choices = [*names, *(str(curve.choice) for curve in bodies)]
    chart = Chart(words, f"y ({unit})", f"z ({unit})", curves, command, choices=choices, choice="of", equal=True)
    return ReportSection("Orbits", "orbits", [chart])


def _body_orbits(history: xr.Dataset, factor: float, every: slice) -> list[ChartCurve]:
    """Return the orbits of flexible supports in space."""
    if "support_displacement" not in history or not {"y", "z"} <= set(map(str, history["support_axis"].values)):
        return []
    moved, curves = factor * history["support_displacement"].isel(time=every), []
    for name in moved["support_body"].values:
        y, z = (moved.sel(support_body=name, support_axis=axis).values for axis in "yz")
        if np.any(y) or np.any(z):
            curves.append(ChartCurve("orbit", y, z, choice=f"support {name}", times=moved["time"].values))
    return curves
