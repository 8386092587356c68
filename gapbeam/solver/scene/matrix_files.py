"""Matrices in files of other programs: Matrix Market, NumPy, CalculiX, Abaqus and Nastran.

CalculiX (`*FREQUENCY, SOLVER=MATRIXSTORAGE`) writes `.sti` and `.mas`, upper triangles as "row column value" from 1 on.
Abaqus (`*MATRIX OUTPUT`) writes `.mtx` as "row column value" (FORMAT=COORDINATE), or as "node, DOF, node, DOF, value"
(FORMAT=MATRIX INPUT); a triangle stands for a symmetric matrix. Nastran's DMIG names rows by grid point and component.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
import scipy.sparse as sp

from gapbeam.solver.scene.dmig_file import read_dmig
from gapbeam.solver.scene.given_numbers import ArgumentError
from gapbeam.solver.system.operators import Array

TRIANGLES = (".sti", ".mas", ".dam")
DMIG = (".pch", ".dmig", ".bdf")
OTHERS = (".op4", ".op2")
KNOWN = (".mtx", ".npz", ".npy", *TRIANGLES, *DMIG, *OTHERS)


class ReadMatrix(NamedTuple):
    """A matrix and, where its file names them, the "node.direction" of its rows."""

    matrix: Any
    labels: list[str] | None = None


def read_matrix(path: Path, argument: str) -> ReadMatrix:
    """Return the matrix of a file, sparse.

    Args:
        path: The file; its suffix says what it is.
        argument: "stiffness", "mass" or "damping": which matrix is taken from a file of several, and for messages.

    Raises:
        ArgumentError: The file cannot be read, or its kind is unknown.
    """
    if path.suffix not in KNOWN:
        found = path.suffix or "no suffix"
        raise ArgumentError(f"{path}: found {found}, expected {', '.join(KNOWN[:-1])} or {KNOWN[-1]}", argument)
    if path.suffix in OTHERS and path.exists():
        return _by_pyyeti(path, argument)
    try:
        if path.suffix in DMIG:
            return ReadMatrix(*read_dmig(path, argument))
        if path.suffix == ".npz":
            return ReadMatrix(sp.csr_matrix(sp.load_npz(path)))
        if path.suffix == ".npy":
            return ReadMatrix(sp.csr_matrix(np.load(path)))
        if path.suffix in TRIANGLES:
            return ReadMatrix(_by_rows(np.loadtxt(path, ndmin=2), completed=True))
        return _mtx(path)
    except ArgumentError:
        raise
    except (OSError, ValueError, TypeError, KeyError, IndexError) as error:
        raise ArgumentError(f"{path}: cannot be read as a matrix ({error})", argument) from None


def refuse_half(A: Any, path: Path, argument: str) -> None:
    """Refuse a matrix with entries on one side of its diagonal only.

    Raises:
        ArgumentError: It is one.
    """
    upper, lower = abs(sp.triu(A, 1)).sum(), abs(sp.tril(A, -1)).sum()
    if (upper == 0.0) != (lower == 0.0):
        raise ArgumentError(
            f"{path}: found entries on one side of the diagonal only, expected the whole matrix; write it with "
            "symmetry (Matrix Market: symmetric), or complete it as A + A.T - diag(A)",
            argument,
        )


def aligned(read: Sequence[ReadMatrix | None]) -> tuple[list[Any], list[str] | None]:
    """Return matrices with one order of rows: where files name their rows, by node and direction.

    Files name only rows that have entries: a row that one of them lacks is empty in its matrix.
    """
    named = [set(one.labels) for one in read if one is not None and one.labels is not None]
    if not named:
        return [None if one is None else one.matrix for one in read], None
    labels = sorted(set().union(*named), key=label_order)
    places = {label: i for i, label in enumerate(labels)}
    found: list[Any] = []
    for one in read:
        if one is None or one.labels is None:
            found.append(None if one is None else one.matrix)
            continue
        at = np.array([places[label] for label in one.labels])
        entries = sp.coo_matrix(one.matrix)
        shape = (len(labels), len(labels))
        found.append(sp.csr_matrix((entries.data, (at[entries.row], at[entries.col])), shape=shape))
    return found, labels


def label_order(label: str) -> tuple[int, int]:
    """Return the key that sorts "node.direction" by numbers."""
    node, _, way = label.partition(".")
    return int(node), int(way or 0)


def _mtx(path: Path) -> ReadMatrix:
    """Return a matrix of Matrix Market, or of Abaqus, which takes the same suffix."""
    with path.open(encoding="utf-8") as lines:
        first = lines.readline()
        while first.startswith("**") or (first.isspace() and first):
            first = lines.readline()
    if first.startswith("%%MatrixMarket"):
        return ReadMatrix(sp.csr_matrix(scipy.io.mmread(path)))
    if "," not in first and not first.startswith("*"):
        return ReadMatrix(_by_rows(np.loadtxt(path, ndmin=2, comments="**"), completed=False))
    rows = np.loadtxt(path, ndmin=2, delimiter=",", comments="*")
    if rows.shape[1] != 5:
        raise ValueError(f"{rows.shape[1]} columns, expected node, DOF, node, DOF and value")
    ends = [[f"{int(node)}.{int(way)}" for node, way in rows[:, at : at + 2]] for at in (0, 2)]
    labels = sorted({*ends[0], *ends[1]}, key=label_order)
    places = {label: i + 1 for i, label in enumerate(labels)}
    i, j = (np.array([places[label] for label in end]) for end in ends)
    return ReadMatrix(_by_rows(np.column_stack([i, j, rows[:, 4]]), completed=False, least=len(labels)), labels)


def _by_rows(table: Array, completed: bool, least: int = 0) -> Any:
    """Return the symmetric matrix of "row column value" lines, from 1 on.

    Args:
        table: The lines.
        completed: Whether they are always one triangle; otherwise they are one where no entry has its mirror.
        least: Rows that there are at least.
    """
    if table.shape[1] != 3:
        raise ValueError(f"{table.shape[1]} columns, expected row, column and value")
    i, j, values = table[:, 0].astype(int) - 1, table[:, 1].astype(int) - 1, table[:, 2]
    if not len(i) or min(i.min(), j.min()) < 0:
        raise ValueError("row 0, expected rows from 1 on")
    n, off = max(int(max(i.max(), j.max())) + 1, least), i != j
    pairs = np.column_stack([np.minimum(i, j), np.maximum(i, j)])[off]
    if completed or len(np.unique(pairs, axis=0)) == len(pairs):
        i, j, values = (*_both(i, j, off), np.concatenate([values, values[off]]))
    return sp.csr_matrix((values, (i, j)), shape=(n, n))


def _both(i: Any, j: Any, off: Any) -> tuple[Any, Any]:
    return np.concatenate([i, j[off]]), np.concatenate([j, i[off]])


def _by_pyyeti(path: Path, argument: str) -> ReadMatrix:
    """Return a matrix of Nastran's output4 or output2, through pyyeti where it is installed."""
    try:
        from pyyeti.nastran import op2, op4  # type: ignore[import-not-found]
    except ImportError:
        raise ArgumentError(
            f"{path}: found Nastran's {path.suffix}, expected the package pyyeti to read it; pip install pyyeti, or "
            "write DMIG (.pch) or Matrix Market (.mtx)",
            argument,
        ) from None
    first = {"stiffness": "k", "mass": "m", "damping": "b"}[argument]
    try:
        held = op4.load(str(path), into="dct") if path.suffix == ".op4" else op2.rdnas2cam(str(path))
        names = [name for name in held if name.lower().startswith(first)] if len(held) > 1 else list(held)
        if len(names) != 1:
            raise ValueError(f"matrices {', '.join(held)}; expected one that begins with {first}")
        one = held[names[0]]
        return ReadMatrix(sp.csr_matrix(one[0] if isinstance(one, list | tuple) else one))
    except (OSError, ValueError, TypeError, KeyError, IndexError) as error:
        raise ArgumentError(f"{path}: cannot be read as a matrix ({error})", argument) from None
