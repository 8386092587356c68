"""The largest displacements, stresses and joint forces of a record, as rows of the table of results."""

from __future__ import annotations

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Cell

Row = tuple[Cell, ...]
_WORDS = {
    "axial_stress": ("gauge", "largest axial stress at {}"),
    "von_mises_stress": ("gauge", "largest von Mises stress at {}"),
}


def peak_rows(history: xr.Dataset) -> list[Row]:
    """Return name, value and unit of the largest of each record over the whole history; what is not finite is left out.

    Displacements and accelerations are those across the beam: in space the length of both components.

    Args:
        history: `Results.history`.
    """
    rows: list[Row] = []
    for record, dimension, words in (
        ("displacement", "probe", "largest displacement of {}"),
        ("displacement_from_supports", "moved_probe", "largest displacement of {} from its supports"),
        ("acceleration_absolute", "probe", "largest acceleration of {}"),
        ("acceleration_from_supports", "moved_probe", "largest acceleration of {} from its supports"),
    ):
        if record in history and history.sizes.get(dimension, 0):
            across = history[record].sel(component=[axis for axis in history["component"].values if axis != "x"])
            sizes = np.sqrt((across**2).sum("component"))
            rows += _largest(sizes, dimension, words, str(history[record].attrs.get("units", "m")))
    for record, (dimension, words) in _WORDS.items():
        if record in history and history.sizes.get(dimension, 0) and np.any(history[record].values):
            rows += _largest(np.abs(history[record]), dimension, words, "Pa")
    if "joint_force" in history and history.sizes.get("joint", 0):
        sizes = np.sqrt((history["joint_force"] ** 2).sum("translation"))
        rows += _largest(sizes, "joint", "largest force of the joint {}", "N")
    return rows


def _largest(values: xr.DataArray, dimension: str, words: str, unit: str) -> list[Row]:
    """Return a row for each entry along a dimension."""
    written, factor = shown(unit)
    largest = values.max("time")
    return [
        (words.format(name), factor * float(one), written)
        for name, one in zip(values[dimension].values, largest.values, strict=True)
        if np.isfinite(one)
    ]
