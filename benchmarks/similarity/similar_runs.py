"""Comparison of two runs of one case at different sizes, apart from the size."""

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
from gapbeam.solver.case.checks.case_warnings import unit_questions, unusual_loads
from gapbeam.solver.case.reading.case_reader import read_case_tables
from gapbeam.solver.record_table import HISTORY_FILE

SIZES = (2.0**-14, 2.0**10)
AT_ROUND_OFF = ("iterations", "energy_residual", "algorithmic_dissipation", "active_points", "contact_area")
"""Histories that round-off decides."""
ENERGY = ("_energy", "_work", "_dissipation")
"""Endings of histories that are energies."""

_NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")
_PREFIX = re.compile(r"# [kMGmunµ](?=(?:m|s|N|Pa|J|W|Hz)\b)")
_PROGRESS = re.compile(r"t = \S+ of ")


@dataclass(frozen=True)
class Motion:
    """Log and history of a run.

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
    """Run a case at a size and return its motion in units of the size.

    Questions about units ask for what engineers usually build, and so for a size: they are left out. Lines of progress
    follow the clock.
    """
    tables = scaled_tables(case, size)
    asked = _questions(read_case_tables(tables, name="scaled"))
    lines = list[str]()

    class Kept(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if (text := record.getMessage()) not in asked and not _PROGRESS.match(text):
                lines.append(f"{record.levelname} {text}")

    handler, log = Kept(), logging.getLogger("gapbeam")
    log.addHandler(handler)
    try:
        outcome = gapbeam.run(tables, output=folder, overwrite=True)
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
    return _PREFIX.sub("# ", _NUMBER.sub("#", text))


def _questions(case: Case) -> set[str]:
    """Return the warnings of a case that ask for its units."""
    return {line for look in (unit_questions, unusual_loads) for line in look(case)}


def difference(one: np.ndarray, other: np.ndarray, scale: float) -> float:
    """Return the largest difference over a scale; without a scale the difference itself."""
    if one.shape != other.shape:
        return np.inf
    apart = float(np.max(np.abs(one - other), initial=0.0))
    return apart / scale if scale > 0.0 else apart


def largest(unit: Motion, name: str) -> float:
    """Return the scale of differences of a history: its largest value, or the largest of all energies."""
    energies = [key for key in unit.history if key.endswith(ENERGY)]
    return max(float(np.max(np.abs(unit.history[key]))) for key in (energies if name in energies else [name]))
