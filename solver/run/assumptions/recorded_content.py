"""The frequency content of the recorded motion of the probes."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
from mpi4py import MPI

from gapbeam.solver.diagnostics.assumptions.frequency_content import (
    FrequencyContent,
    content_of,
    power_of,
    segments,
)
from gapbeam.solver.record_table import HISTORY_FILE
from gapbeam.solver.system.operators import Array

FEWEST = 16  # records; fewer show no frequency
DEPTH = 1e-6  # of the interval, by which records may be unevenly spaced


def recorded_content(folder: Path, comm: MPI.Comm) -> FrequencyContent | None:
    """Return what carries the energy of the probes; None where no probe has moved, or too few records are there.

    Args:
        folder: The results folder, its history closed.
        comm: The ranks; rank 0 reads.

    Collective.
    """
    found: FrequencyContent | None = None
    if comm.rank == 0:
        try:
            with h5py.File(folder / HISTORY_FILE, "r") as file:
                found = _content(file)
        except (OSError, RuntimeError, KeyError):
            found = None  # a history that cannot be read is reported by what reads it
    shared: FrequencyContent | None = comm.bcast(found)
    return shared


def _content(file: h5py.File) -> FrequencyContent | None:
    if "velocity" not in file:
        return None
    times = np.asarray(file["time"])
    intervals = np.diff(times)
    if len(times) < FEWEST:
        return None
    interval = float(np.median(intervals))
    even = np.flatnonzero(np.abs(intervals - interval) > DEPTH * interval)
    count = int(even[0]) + 1 if len(even) else len(times)  # the last record may come early
    if count < FEWEST:
        return None
    velocity = file["velocity"]
    power: Array = np.zeros(1)
    for taken in segments(count):
        power = power + power_of(np.asarray(velocity[taken]).reshape(taken.stop - taken.start, -1))
    return content_of(power, interval, 2 * (len(power) - 1) + (min(count, taken.stop - taken.start) % 2))
