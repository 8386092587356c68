"""The frequency content of the recorded motion of the probes."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
from mpi4py import MPI

from gapbeam.solver.diagnostics.assumptions.frequency_content import FrequencyContent, content_of_motion
from gapbeam.solver.record_table import HISTORY_FILE


def recorded_content(folder: Path, comm: MPI.Comm) -> FrequencyContent | None:
    """Return the energy content of the probes; None where no probe has moved, or too few records are there.

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
    return content_of_motion(np.asarray(file["time"]), file["velocity"]) if "velocity" in file else None
