"""Two runs of one case at different sizes, and what differs between them beside the size."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

import gapbeam
from benchmarks.similarity.scaled_case import scaled_tables
from benchmarks.similarity.size_exponents import size_exponent
from gapbeam.solver.case.case import Case
from gapbeam.solver.record_table import HISTORY_FILE

SIZES = (2.0**-14, 2.0**10)
AT_ROUND_OFF = ("iterations", "energy_residual", "algorithmic_dissipation", "active_points", "contact_area")
"""Histories that round-off decides."""

_NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")
_UNLIKE = ("hours", "minutes", "seconds", "GB", "memory", "results folder", "wall")


@dataclass(frozen=True)
class Motion:
    """What a run left behind.

    Attributes:
        status: Exit status.
        message: Its last line, figures replaced.
        lines: Of its log, figures replaced.
        history: Values in the units of the size of the case, by name.
    """

    status: int
    message: str
    lines: tuple[str, ...]
    history: dict[str, np.ndarray]


def motion(case: Case, size: float, folder: Path) -> Motion:
    """Run a case at a size and return its motion in units of the size."""
    lines = list[str]()

    class Kept(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            lines.append(f"{record.levelname} {record.getMessage()}")

    handler, log = Kept(), logging.getLogger("gapbeam")
    log.addHandler(handler)
    try:
        outcome = gapbeam.run(scaled_tables(case, size), output=folder, overwrite=True)
    finally:
        log.removeHandler(handler)
    history = dict[str, np.ndarray]()
    with h5py.File(folder / HISTORY_FILE) as file:

        def keep(name: str, data: object) -> None:
            if isinstance(data, h5py.Dataset) and data.dtype.kind == "f":
                unit = str(data.attrs.get("units", "1"))
                history[name] = data[()] / size ** size_exponent(unit)

        file.visititems(keep)
    return Motion(outcome.exit_status, without_figures(outcome.message), tuple(map(without_figures, lines)), history)


def without_figures(text: str) -> str:
    """Return a text with every number replaced by #."""
    return _NUMBER.sub("#", text)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Return the largest difference relative to the largest value."""
    if one.shape != other.shape:
        return np.inf
    scale = float(np.max(np.abs(one), initial=0.0))
    apart = float(np.max(np.abs(one - other), initial=0.0))
    return apart / scale if scale > 0.0 else apart
