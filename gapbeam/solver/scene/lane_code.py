"""Kernels of a number of lanes: functions that treat L members side by side, innermost, so that processors do so, too.

Code is compiled once for each number of lanes, with L a constant, and kept on disk under names that carry a hash of the
sources. Kernels allocate nothing, so that they can do without reference counts.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"
from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from gapbeam.solver.compilation import jit
from gapbeam.solver.scene.touch_kernel import move

L = 1  # lanes: replaced in each set of kernels
ONE, TWO, THREE, FOUR = (np.uint64(k) for k in range(1, 5))  # indices without a sign: none counts from the end

_PARTS: list[Any] = []
_SOURCES = ("lane_code.py", "force_solve.py", "step_kernel.py", "touch_kernel.py")
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False, "fastmath": {"reassoc", "contract"}}


def lanewise(function: Any) -> Any:
    """Mark a function of the kernels, which is compiled once for each number of lanes."""
    _PARTS.append(function)
    return function


@lru_cache
def kernels(lanes: int) -> dict[str, Any]:
    """Return the compiled functions of so many lanes by their names; `march` and `meet` are called from Python."""
    here = Path(__file__).parent
    key = hashlib.sha256(b"".join((here / name).read_bytes() for name in _SOURCES)).hexdigest()[:12]
    space: dict[str, Any] = {}
    for part in _PARTS:
        space.update(part.__globals__)
    space["L"] = lanes
    for part in _PARTS:
        function = FunctionType(part.__code__, space, part.__name__)
        function.__qualname__, function.__module__ = f"{part.__name__}_{lanes}_{key}", part.__module__
        make = jit.kept if part.__name__ in ("march", "meet") else jit.part
        space[part.__name__] = make(function, _OPTIONS | {"forceinline": part.__name__ != "march"})
    return space


@lanewise
def add(A, x, y, scale):
    """Y += scale A x: a row is a product with x."""
    rows, columns = A.shape
    for i in range(rows):
        if L == 1:
            total = 0.0
            for j in range(columns):
                total += A[i, j] * x[j, 0]
            y[i, 0] += scale * total
        else:
            for t in range(columns // 8):
                k = 8 * t
                a0, a1, a2, a3 = scale * A[i, k], scale * A[i, k + 1], scale * A[i, k + 2], scale * A[i, k + 3]
                a4, a5, a6, a7 = scale * A[i, k + 4], scale * A[i, k + 5], scale * A[i, k + 6], scale * A[i, k + 7]
                for lane in range(L):
                    y[i, lane] += (
                        a0 * x[k, lane]
                        + a1 * x[k + 1, lane]
                        + a2 * x[k + 2, lane]
                        + a3 * x[k + 3, lane]
                        + a4 * x[k + 4, lane]
                        + a5 * x[k + 5, lane]
                        + a6 * x[k + 6, lane]
                        + a7 * x[k + 7, lane]
                    )
            done = columns // 8 * 8
            if columns - done >= 4:
                k, done = done, done + 4
                a0, a1, a2, a3 = scale * A[i, k], scale * A[i, k + 1], scale * A[i, k + 2], scale * A[i, k + 3]
                for lane in range(L):
                    y[i, lane] += a0 * x[k, lane] + a1 * x[k + 1, lane] + a2 * x[k + 2, lane] + a3 * x[k + 3, lane]
            for j in range(done, columns):
                a0 = scale * A[i, j]
                for lane in range(L):
                    y[i, lane] += a0 * x[j, lane]


@lanewise
def across(A, x, y):
    """Y += A^T x, four rows of A at a time: where rows are many and columns few, no sum runs along a vector."""
    rows, columns = A.shape
    for t in range(rows // 4):
        j = 4 * t
        for i in range(columns):
            a0, a1, a2, a3 = A[j, i], A[j + 1, i], A[j + 2, i], A[j + 3, i]
            for lane in range(L):
                y[i, lane] += a0 * x[j, lane] + a1 * x[j + 1, lane] + a2 * x[j + 2, lane] + a3 * x[j + 3, lane]
    for j in range(rows // 4 * 4, rows):
        for i in range(columns):
            for lane in range(L):
                y[i, lane] += A[j, i] * x[j, lane]


@lanewise
def blocks(A, begin, end, x, y):
    """Y += A x by the blocks from `begin` to `end` of A, four columns at a time, or by products where they are rows."""
    for b in range(begin, end):
        row, column, at, rows, columns = A.row[b], A.column[b], A.at[b], A.rows[b], A.columns[b]
        if L == 1 and rows == 1:
            total = 0.0
            for j in range(columns):
                total += A.value[at + j] * x[column + j, 0]
            y[row, 0] += total
        else:
            for t in range(columns // FOUR):
                j, k0 = column + FOUR * t, at + FOUR * t * rows
                k1, k2, k3 = k0 + rows, k0 + (rows + rows), k0 + (rows + rows + rows)
                for i in range(rows):
                    a0, a1, a2, a3 = A.value[k0 + i], A.value[k1 + i], A.value[k2 + i], A.value[k3 + i]
                    for lane in range(L):
                        y[row + i, lane] += (
                            a0 * x[j, lane] + a1 * x[j + ONE, lane] + a2 * x[j + TWO, lane] + a3 * x[j + THREE, lane]
                        )
            for j in range(columns // FOUR * FOUR, columns):
                for i in range(rows):
                    for lane in range(L):
                        y[row + i, lane] += A.value[at + j * rows + i] * x[column + j, lane]


@lanewise
def diagonals(A, begin, end, x, y):
    """Y += A x by the diagonals from `begin` to `end` of A."""
    for k in range(begin, end):
        row, column, at = A.row[k], A.column[k], A.at[k]
        for i in range(A.at[k + 1] - at):
            for lane in range(L):
                y[row + i, lane] += A.value[at + i] * x[column + i, lane]


@lanewise
def copy(x, y):
    """Y = x."""
    move(y.ctypes.data, x.ctypes.data, L * x.shape[0])


@lanewise
def clear(x):
    """X = 0."""
    for i in range(x.shape[0]):
        for lane in range(L):
            x[i, lane] = 0.0


@lanewise
def spread(A, which, count, x, y, scale):
    """Y += scale sum_j x_j A_j over the rows j that are listed in `which`: four at a time, then two."""
    columns, done = A.shape[1], count // 4 * 4
    for t in range(count // 4):
        j, k, m, n = which[4 * t], which[4 * t + 1], which[4 * t + 2], which[4 * t + 3]
        for i in range(columns):
            a, b, c, d = scale * A[j, i], scale * A[k, i], scale * A[m, i], scale * A[n, i]
            for lane in range(L):
                y[i, lane] += a * x[j, lane] + b * x[k, lane] + c * x[m, lane] + d * x[n, lane]
    if count - done >= 2:
        j, k, done = which[done], which[done + 1], done + 2
        for i in range(columns):
            a, b = scale * A[j, i], scale * A[k, i]
            for lane in range(L):
                y[i, lane] += a * x[j, lane] + b * x[k, lane]
    if count > done:
        j = which[done]
        for i in range(columns):
            a = scale * A[j, i]
            for lane in range(L):
                y[i, lane] += a * x[j, lane]


@lanewise
def eliminate(A, b, inverse, m):
    """Solve A x = b in place, row by row; without pivots: principal minors are positive where laws do not soften."""
    for i in range(m):
        done = 0
        if L == 1:  # four rows above at a time: the row itself is read and written once
            for t in range(i // 4):
                p = 4 * t
                f0 = A[i, p, 0] * inverse[p, 0]
                f1 = (A[i, p + 1, 0] - f0 * A[p, p + 1, 0]) * inverse[p + 1, 0]
                f2 = (A[i, p + 2, 0] - f0 * A[p, p + 2, 0] - f1 * A[p + 1, p + 2, 0]) * inverse[p + 2, 0]
                f3 = (
                    A[i, p + 3, 0] - f0 * A[p, p + 3, 0] - f1 * A[p + 1, p + 3, 0] - f2 * A[p + 2, p + 3, 0]
                ) * inverse[p + 3, 0]
                b[i, 0] -= f0 * b[p, 0] + f1 * b[p + 1, 0] + f2 * b[p + 2, 0] + f3 * b[p + 3, 0]
                for j in range(p + 4, m):
                    A[i, j, 0] -= f0 * A[p, j, 0] + f1 * A[p + 1, j, 0] + f2 * A[p + 2, j, 0] + f3 * A[p + 3, j, 0]
            done = i // 4 * 4
        for p in range(done, i):
            for lane in range(L):
                A[i, p, lane] *= inverse[p, lane]
                b[i, lane] -= A[i, p, lane] * b[p, lane]
            for j in range(p + 1, m):
                for lane in range(L):
                    A[i, j, lane] -= A[i, p, lane] * A[p, j, lane]
        for lane in range(L):
            inverse[i, lane] = 1.0 / A[i, i, lane]
    for p in range(m - 1, -1, -1):
        for j in range(p + 1, m):
            for lane in range(L):
                b[p, lane] -= A[p, j, lane] * b[j, lane]
        for lane in range(L):
            b[p, lane] *= inverse[p, lane]
