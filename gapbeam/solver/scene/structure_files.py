"""Structures from the matrices that other programs write: Matrix Market, NumPy, and CalculiX's matrix storage.

CalculiX (`*FREQUENCY, SOLVER=MATRIXSTORAGE`) writes `.sti` and `.mas`, the upper triangles as "row column value" from 1
on, and `.dof`, one "node.direction" a line, without the DOFs that are clamped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.structure import SYMMETRY, Structure
from gapbeam.solver.system.operators import Array

UNITS = {"m-kg-s": (1.0, 1.0), "mm-t-s": (1e-3, 1e3), "mm-kg-s": (1e-3, 1.0)}
"""Length in m and mass in kg of a system of units whose time is s."""
DIRECTIONS = {"1": 0, "2": 1, "3": 2, "4": 3, "5": 4, "6": 5}

Label = str | int


def read_structure(
    stiffness: str | Path,
    mass: str | Path,
    *,
    units: str,
    damping: str | Path | None = None,
    dofs: str | Path | None = None,
    nodes: str | Path | None = None,
    points: Mapping[str, Label | Sequence[Label]] | None = None,
    clamped: Sequence[Label] = (),
    frame: Sequence[float] | None = None,
    name: str = "",
) -> Structure:
    """Return the structure of matrices in files, in m, kg and s.

    Args:
        stiffness: File of K: `.mtx` (Matrix Market), `.npz` (`scipy.sparse.save_npz`), `.npy`, or `.sti` of CalculiX.
        mass: File of M, likewise; `.mas` of CalculiX.
        units: Of the files: "m-kg-s", "mm-t-s" or "mm-kg-s".
        damping: File of C, likewise.
        dofs: File with a "node.direction" for each row, directions 1 to 3 along and 4 to 6 about x, y, z.
        nodes: File with "node x y z" lines, separated by blanks or commas: rigid motions then follow in closed form.
        points: By name, one or two DOFs: "node.direction" as in `dofs`, or row numbers from 0 on.
        clamped: Nodes (whole) or "node.direction" that do not move: their rows and columns are left out.
        frame: Direction in which the frame moves, (3,): what weight and base motions act along; needs `dofs`.
        name: Of the structure.

    Raises:
        UserError: A file cannot be read or is of an unknown kind, sizes differ, a matrix is not symmetric, a label is
            unknown, or units are.
    """
    if units not in UNITS:
        raise UserError(f"structure {name or '?'}: found units {units!r}, expected one of {', '.join(UNITS)}")
    K, M = _matrix(Path(stiffness)), _matrix(Path(mass))
    C = None if damping is None else _matrix(Path(damping))
    for A, file in ((K, stiffness), (M, mass), *(((C, damping),) if C is not None else ())):
        if A.shape != K.shape:
            raise UserError(f"{file}: found {A.shape[0]} rows, {stiffness} has {K.shape[0]}")
        _refuse_half(A, Path(str(file)))
    labels = [str(i) for i in range(K.shape[0])] if dofs is None else _labels(Path(dofs), K.shape[0])
    places = {label: i for i, label in enumerate(labels)}
    meter, kilogram = UNITS[units]
    lengths = np.array([meter if DIRECTIONS.get(one.partition(".")[2], 0) < 3 else 1.0 for one in labels])
    K, M = (_in_si(A, kilogram * meter**2, lengths) for A in (K, M))
    C = None if C is None else _in_si(C, kilogram * meter**2, lengths)
    fixed = {i for one in clamped for i in _clamped(str(one), places, dofs is not None)}
    free = np.array([i for i in range(len(labels)) if i not in fixed])
    if not len(free):
        raise UserError(f"structure {name or '?'}: all DOFs are clamped")
    rows = {key: _rows(key, given, places, fixed)[:, free] for key, given in (points or {}).items()}
    motions = None if nodes is None or dofs is None else _rigid(labels, _places(Path(nodes)), meter)
    inertia = along = None
    if frame is not None:
        if dofs is None:
            raise UserError(f"structure {name or '?'}: `frame` needs the directions of the DOFs: give `dofs`")
        along = np.asarray(_along(labels, frame))
        inertia, along = np.asarray(M @ along)[free], along[free]
    K, M = (A[free][:, free] for A in (K, M))
    C = None if C is None else C[free][:, free]
    if motions is not None:
        motions = motions[free]
        strain, most = abs(K @ motions).max(axis=0), abs(K).max() * np.abs(motions).max(axis=0)
        motions = motions[:, strain <= SYMMETRY * np.where(most > 0.0, most, 1.0)]
        motions = motions[:, np.abs(motions).max(axis=0) > 0.0]
    return Structure(M, K, C, rows, motions if motions is not None and motions.size else None, name, inertia, along)


def _in_si(A: Any, energy: float, lengths: Array) -> Any:
    """Return a matrix in m, kg and s: its energies times a factor, its displacements in m, its angles in rad."""
    D = sp.diags(1.0 / lengths)
    return sp.csr_matrix(energy * (D @ A @ D))


def _matrix(path: Path) -> Any:
    """Return the matrix of a file, sparse."""
    try:
        if path.suffix == ".mtx":
            return sp.csr_matrix(scipy.io.mmread(path))
        if path.suffix == ".npz":
            return sp.csr_matrix(sp.load_npz(path))
        if path.suffix == ".npy":
            return sp.csr_matrix(np.load(path))
        if path.suffix in (".sti", ".mas", ".dam"):
            return _triangle(np.loadtxt(path, ndmin=2))
    except (OSError, ValueError, TypeError, KeyError, IndexError) as error:
        raise UserError(f"{path}: cannot be read as a matrix ({error})") from None
    raise UserError(f"{path}: found {path.suffix or 'no suffix'}, expected .mtx, .npz, .npy, .sti or .mas")


def _triangle(table: Array) -> Any:
    """Return the symmetric matrix of "row column value" lines of one triangle, from 1 on."""
    if table.shape[1] != 3:
        raise ValueError(f"{table.shape[1]} columns, expected row, column and value")
    i, j = table[:, 0].astype(int) - 1, table[:, 1].astype(int) - 1
    if min(i.min(), j.min()) < 0:
        raise ValueError("row 0, expected rows from 1 on")
    n, off = int(max(i.max(), j.max())) + 1, i != j
    values, both = table[:, 2], (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]))
    return sp.csr_matrix((np.concatenate([values, values[off]]), both), shape=(n, n))


def _refuse_half(A: Any, path: Path) -> None:
    upper, lower = abs(sp.triu(A, 1)).sum(), abs(sp.tril(A, -1)).sum()
    if (upper == 0.0) != (lower == 0.0):
        raise UserError(
            f"{path}: has entries on one side of the diagonal only; expected the whole matrix: write it with symmetry "
            "(Matrix Market: symmetric), or complete it as A + A.T - diag(A)"
        )


def _labels(path: Path, count: int) -> list[str]:
    try:
        found = path.read_text(encoding="utf-8").split()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: cannot be read ({error})") from None
    wrong = next((one for one in found if one.partition(".")[2] not in DIRECTIONS), None)
    if wrong is not None:
        raise UserError(f"{path}: found {wrong!r}, expected node.direction with a direction of 1 to 6")
    if len(found) != count:
        raise UserError(f"{path}: found {len(found)} DOFs, the matrices have {count}")
    if len(set(found)) < count:
        raise UserError(f"{path}: a DOF stands there twice")
    return found


def _places(path: Path) -> dict[str, Array]:
    """Return coordinates by node."""
    try:
        lines = [line.replace(",", " ").split() for line in path.read_text(encoding="utf-8").splitlines()]
        rows = [line for line in lines if len(line) == 4 and line[0].isdigit()]
        return {line[0]: np.array(line[1:], dtype=float) for line in rows}
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise UserError(f"{path}: cannot be read as node x y z ({error})") from None


def _clamped(label: str, places: Mapping[str, int], whole: bool) -> list[int]:
    found = [i for one, i in places.items() if one == label or (whole and one.partition(".")[0] == label)]
    if not found:
        raise UserError(f"clamped: found {label!r}, which is no node and no DOF of the matrices")
    return found


def _rows(key: str, given: Label | Sequence[Label], places: Mapping[str, int], fixed: set[int]) -> Array:
    wanted = [str(one) for one in ([given] if isinstance(given, str | int) else given)]
    rows = np.zeros((len(wanted), len(places)))
    for row, label in zip(rows, wanted, strict=True):
        if label not in places:
            near = [one for one in places if one.partition(".")[0] == label.partition(".")[0]]
            known = f"; that node has {', '.join(near)}" if near else ""
            raise UserError(f"point {key}: found {label!r}, which is no DOF of the matrices{known}")
        if places[label] in fixed:
            raise UserError(f"point {key}: DOF {label} is clamped")
        row[places[label]] = 1.0
    return rows


def _along(labels: Sequence[str], frame: Sequence[float]) -> Array:
    """Return the DOFs of a unit motion along a direction."""
    direction = np.asarray(frame, dtype=float)
    if direction.shape != (3,) or not np.linalg.norm(direction) > 0.0:
        raise UserError(f"frame: found {frame!r}, expected three numbers that are not all 0")
    unit = np.concatenate([direction / np.linalg.norm(direction), np.zeros(3)])
    return np.array([unit[DIRECTIONS[label.partition(".")[2]]] for label in labels])


def _rigid(labels: Sequence[str], nodes: Mapping[str, Array], meter: float) -> Array:
    """Return the six rigid motions, (DOFs, 6): along x, y, z, and about them through the middle of all nodes."""
    used = {label.partition(".")[0] for label in labels}
    missing = sorted(used - set(nodes), key=len)
    if missing:
        raise UserError(f"nodes: node {missing[0]} of the DOFs has no coordinates ({len(missing)} in all)")
    middle = np.mean([nodes[one] for one in used], axis=0)
    found = np.zeros((len(labels), 6))
    for row, label in zip(found, labels, strict=True):
        node, _, way = label.partition(".")
        k = DIRECTIONS[way]
        if k >= 3:
            row[k] = 1.0
            continue
        row[k] = 1.0
        for about in range(3):
            row[3 + about] = np.cross(np.eye(3)[about], meter * (nodes[node] - middle))[k]
    return found
