"""Modal data in files: frequencies, damping ratios and mass-normalized shapes at named points, a mode a row."""

from __future__ import annotations

import csv
from math import pi
from pathlib import Path

import numpy as np

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, finite
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.system.operators import Array

FREQUENCY, DAMPING, FRAME = "frequency", "damping", "frame"


@checked
def read_modes(path: str | Path, name: str = "") -> Structure:
    """Return the structure of a CSV file of modes.

    The first line names the columns: `frequency`, Hz; optional `damping`, a fraction of critical; optional `frame`, the
    participation phi . M r of a motion r with the frame, sqrt(kg); any other column is a point with its shapes,
    1/sqrt(kg): "tip" for one motion, "tip.1" and "tip.2" for two.

    Args:
        path: The file.
        name: Name of the structure.

    Raises:
        UserError: The file cannot be read, a column is missing or holds no numbers, or there are no modes or points.
    """
    columns = _columns(Path(path))
    if FREQUENCY not in columns:
        raise ArgumentError(f"{path}: found the columns {', '.join(columns)}, expected one called frequency", "file")
    w = 2.0 * pi * columns.pop(FREQUENCY)
    zeta, inertia = columns.pop(DAMPING, np.zeros_like(w)), columns.pop(FRAME, None)
    if not (np.all(w >= 0.0) and np.all(zeta >= 0.0) and np.all(zeta < 1.0)):
        raise ArgumentError(f"{path}: expected frequencies from 0 on, and damping ratios from 0 to below 1", "file")
    shapes: dict[str, list[Array]] = {}
    for key in sorted(columns):
        point, _, motion = key.partition(".")
        if motion not in ("", "1", "2"):
            raise ArgumentError(f"{path}: found the column {key!r}, expected a point, or its motions .1 and .2", "file")
        shapes.setdefault(point, []).append(columns[key])
    if not shapes:
        raise ArgumentError(f"{path}: found no points, expected a column of shapes for each point", "file")
    n, still = len(w), np.eye(len(w))[:, w == 0.0]
    points = {key: np.array(rows) for key, rows in shapes.items()}
    damping = np.diag(2.0 * zeta * w)
    return Structure(np.eye(n), np.diag(w * w), damping, points, still if still.size else None, name, inertia)


def _columns(path: Path) -> dict[str, Array]:
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            rows = [row for row in csv.reader(lines) if row and not row[0].startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise ArgumentError(f"{path}: cannot be read ({error})", "file") from None
    if len(rows) < 2:
        raise ArgumentError(
            f"{path}: found {counted(len(rows), 'line')}, expected names of columns and a line for each mode", "file"
        )
    names = [name.strip() for name in rows[0]]
    for number, row in enumerate(rows[1:], 1):
        if len(row) != len(names):
            raise ArgumentError(
                f"{path}: found {counted(len(row), 'value')} for mode {number}, expected {len(names)}: "
                f"{', '.join(names)}",
                "file",
            )
    if len(set(names)) < len(names):
        raise ArgumentError(f"{path}: a column stands there twice", "file")
    cells = [[_number(cell, f"{path}: {name} of mode {number}") for name, cell in zip(names, row, strict=True)]
             for number, row in enumerate(rows[1:], 1)]  # fmt: skip
    columns = zip(*cells, strict=True)
    return {name: finite(column, f"{path}: {name}") for name, column in zip(names, columns, strict=True)}


def _number(cell: str, where: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ArgumentError(f"{where}: found {cell.strip()!r}, expected a number", "file") from None
