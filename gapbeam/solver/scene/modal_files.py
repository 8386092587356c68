"""Modal data in files: frequencies, damping ratios and mass-normalized shapes at named points.

A CSV file has a mode a row. In universal files a mode is a data set 55: six whole numbers in line 6 (type of model, of
analysis, number of data, their quantity, real or complex, numbers at a node), then in line 8 frequency, modal mass and
damping ratios, then a line with the number of a node and one with its displacements, for each node.

Source: SDRC, Universal dataset number 55, Data at nodes, and number 164, Units.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection
from math import pi
from pathlib import Path

import numpy as np

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, finite
from gapbeam.solver.scene.structure import Structure, from_modes
from gapbeam.solver.scene.universal_file import UNIVERSAL, UniversalFile
from gapbeam.solver.system.operators import Array

FREQUENCY, DAMPING, FRAME = "frequency", "damping", "frame"
AXES = "xyz"
NORMAL_MODE, SHAPES, REAL, COMPLEX = 2, 8, 2, 5  # codes of data set 55
ANALYSES = {
    0: "an unknown analysis", 1: "a static analysis", 3: "complex modes", 4: "a transient", 5: "a frequency response",
    6: "buckling", 7: "complex modes",
}  # fmt: skip


@checked
def read_modes(path: str | Path, name: str = "", points: Collection[str] = ()) -> Structure:
    """Return the structure of a file of modes: CSV, or a universal file where its name ends in ".unv" or ".uff".

    The first line of a CSV file names the columns: `frequency`, Hz; optional `damping`, a fraction of critical;
    optional `frame`, the participation phi . M r of a motion r with the frame, sqrt(kg); any other column is a point
    with its shapes, 1/sqrt(kg): "tip" for one motion, "tip.1" and "tip.2" for two.

    The points of a universal file are its nodes: "12x" is the motion of node 12 along x, "12xz" along x and z, "12" in
    space; by default all nodes along x, y and z. Shapes are divided by the root of the modal mass, kg, or in the units
    of data set 164; a hysteretic damping ratio counts by half, as it is at resonance. It has no participation in the
    motion of a frame.

    Args:
        path: The file.
        name: Name of the structure.
        points: Points that are kept; none: all.

    Raises:
        UserError: The file cannot be read, a column is missing or holds no numbers, modes are complex or have other
            nodes than the first, or there are no modes or points, or not one that is to be kept.
    """
    if Path(path).suffix.lower() in UNIVERSAL:
        return _of_universal(Path(path), name, points)
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
    if missing := [one for one in points if one not in shapes]:
        raise ArgumentError(f"{path}: found no point {missing[0]}, expected one of {', '.join(shapes)}", "file")
    kept = {key: np.array(rows) for key, rows in shapes.items() if not points or key in points}
    damping = np.diag(2.0 * zeta * w)
    return Structure(np.eye(n), np.diag(w * w), damping, kept, still if still.size else None, name, inertia)


def _of_universal(path: Path, name: str, points: Collection[str]) -> Structure:
    file = UniversalFile.read(path)
    units = file.first("164")
    length, force = (1.0, 1.0) if units is None else units.numbers(1, (25, 25))
    if units is not None and not min(length, force) > 0.0:
        raise units.fault(f"the factors {length:g} of lengths and {force:g} of forces", "factors above 0")
    modes, shapes = list[tuple[float, float]](), dict[int, list[Array]]()
    for one in file.of_kind("55", "data at nodes"):
        _, analysis, _, quantity, kind, count = map(int, one.numbers(5, (10,) * 6))
        if analysis != NORMAL_MODE:
            raise one.fault(ANALYSES.get(analysis, f"analysis type {analysis}"), "normal modes, analysis type 2")
        if kind != REAL:
            raise one.fault("complex shapes" if kind == COMPLEX else f"values of type {kind}", "real ones")
        if quantity not in (0, SHAPES):
            raise one.fault(f"data of type {quantity}", "displacements, type 8")
        frequency, modal_mass, viscous, hysteretic = one.numbers(7, (13,) * 4)
        if not modal_mass > 0.0:
            raise one.fault(f"the modal mass {modal_mass:g}", "one above 0")
        modes.append((frequency, viscous + 0.5 * hysteretic))
        scale = np.sqrt(modal_mass * length / force)
        nodes = [int(one.numbers(line, (10,))[0]) for line in range(8, len(one.lines), 2)]
        if count not in (3, 6) or not nodes or (shapes and nodes != list(shapes)):
            found = f"{counted(len(nodes), 'node')} with {counted(count, 'number')} each"
            raise one.fault(found, "the nodes of the first mode, with 3 or 6 numbers each")
        for place, node in enumerate(nodes):
            shapes.setdefault(node, []).append(np.array(one.numbers(9 + 2 * place, (13,) * 3)) / scale)
    kept = dict[str, Array]()
    for point in points or [f"{node}{axis}" for node in shapes for axis in AXES]:
        parts = re.fullmatch("([0-9]+)(x?y?z?)", point)
        if parts is None or int(parts[1]) not in shapes:
            node, others = next(iter(shapes)), ", ".join(map(str, list(shapes)[:9])) + ", ..." * (len(shapes) > 9)
            raise ArgumentError(
                f"{path}: found no point {point}, expected a node with its directions, such as {node}x, {node}xz, or "
                f"{node} in space; nodes: {others}", "file",
            )  # fmt: skip
        kept[point] = np.array(shapes[int(parts[1])]).T[[AXES.index(axis) for axis in parts[2] or AXES]]
    frequencies, ratios = np.array(modes).T
    return from_modes(2.0 * pi * frequencies, ratios, kept, name=name)


def _columns(path: Path) -> dict[str, Array]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as lines:
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
    if len(set(names)) < len(names) or "" in names:
        what = "has no name" if "" in names else "stands there twice"
        raise ArgumentError(f"{path}: a column {what}", "file")
    cells = [[_number(cell, f"{path}: {name} of mode {number}") for name, cell in zip(names, row, strict=True)]
             for number, row in enumerate(rows[1:], 1)]  # fmt: skip
    columns = zip(*cells, strict=True)
    return {name: finite(column, f"{path}: {name}") for name, column in zip(names, columns, strict=True)}


def _number(cell: str, where: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ArgumentError(f"{where}: found {cell.strip()!r}, expected a number", "file") from None
