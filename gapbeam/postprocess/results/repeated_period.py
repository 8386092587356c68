"""Runs that computed one period of a periodic response: their records, going round as often as it takes."""

from __future__ import annotations

from math import ceil

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.results import Results
from gapbeam.solver.record_table import HISTORY

ENOUGH = 16.0  # forcing periods


def is_periodic(results: Results) -> bool:
    """Return whether a run found a periodic response, so that its records are one period of it."""
    return results.status == "completed" and (results.case.get("analysis") or {}).get("type") == "periodic"


def motion_of(results: Results, frequency: float | None) -> xr.Dataset:
    """Return the records of a run; of a computed periodic response as they repeat.

    Args:
        results: Of any run.
        frequency: Of the forcing, Hz.

    Raises:
        ResultsError: The results cannot be read.
    """
    if frequency is None or not is_periodic(results):
        return results.history
    return repeated(results.history, frequency)


def repeated(history: xr.Dataset, frequency: float) -> xr.Dataset:
    """Return the records of whole cycles, first and last the same state, going on for 16 forcing periods at least.

    Impulse, work and losses since the start go on growing.
    """
    time = np.asarray(history["time"].values, dtype=float)
    span = float(time[-1] - time[0])
    rounds = ceil(ENOUGH / max(span * frequency, 1.0))
    running = {record.name for record in HISTORY if "since t = 0" in record.meaning}
    first = history.isel(time=slice(0, 1))
    parts = []
    for turn in range(rounds):
        part = history.isel(time=slice(1, None))
        part = part.assign_coords(time=time[1:] + turn * span)
        for name in running & set(map(str, part.data_vars)):
            grown = history[name].isel(time=-1, drop=True) - history[name].isel(time=0, drop=True)
            part[name] = part[name] + turn * grown
        parts.append(part)
    return xr.concat([first, *parts], dim="time")
