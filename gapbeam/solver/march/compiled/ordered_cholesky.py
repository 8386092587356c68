"""Cholesky factor of the active block; only the part after a change is computed anew.

The matrix s D + diag(c) on the active points is factored row by row, in an order in which points that come and go stand
last. A row of the factor needs only the rows before it: when points change their compliance c or leave, rows from the
first of them on are computed again, and these points move to the end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.march.compiled.point_motions import AroundPoints, count_in_play, delassus_entry, in_play
from gapbeam.solver.system.operators import Array, Indices


class OrderedFactor(NamedTuple):
    """A factor L L^T = s D + diag(c) of the active points in their order.

    Attributes:
        rows: L, (m, m), lower triangle of which `filled` rows hold.
        order: Active points in the order of the rows, (m,).
        compliance: c that each row was made with, (m,), m/N.
        filled: Number of rows that hold, (1,).
        spare: Room for an order, (m,).
        placed: Not 0 at points that have a row, (m,).
    """

    rows: Array
    order: Indices
    compliance: Array
    filled: Indices
    spare: Indices
    placed: Indices


def empty_factor(size: int) -> OrderedFactor:
    """Return room for the factor of up to m = `size` active points."""
    integers = np.zeros((4, size), dtype=np.int64)
    return OrderedFactor(
        np.zeros((size, size)), integers[0], np.zeros(size), np.zeros(1, dtype=np.int64), integers[1], integers[2]
    )


@compiled
def update_factor(
    factor: OrderedFactor, delassus: Array, around: AroundPoints | None, scale: float, compliance: Array
) -> bool:
    """Bring the factor to s D + diag(c) on the points with c > 0; tell whether that is positive definite.

    Args:
        factor: The factor, brought up to date in place.
        delassus: As in `contact_kernel.Balance`, and likewise `around`.
        around: Points around sections; None: others.
        scale: s, always the same.
        compliance: c, (m,), m/N; 0 or less where a point is not active.
    """
    order, kept, placed = factor.order, factor.compliance, factor.placed
    before = factor.filled[0]
    first = 0
    while first < before and compliance[order[first]] == kept[first]:
        first += 1
    for number in range(count_in_play(around, len(placed))):
        point = in_play(around, number)
        placed[point] = 0
    for row in range(first):
        placed[order[row]] = 1
    changed = 0
    rows = first
    for row in range(first, before):
        point = order[row]
        if compliance[point] == kept[row]:
            order[rows], kept[rows] = point, kept[row]
            placed[point] = 1
            rows += 1
        elif compliance[point] > 0.0:
            factor.spare[changed] = point
            changed += 1
    for number in range(changed):
        point = factor.spare[number]
        placed[point] = 2
    for number in range(count_in_play(around, len(placed))):
        point = in_play(around, number)
        if compliance[point] > 0.0 and placed[point] == 0:
            order[rows], kept[rows] = point, compliance[point]
            rows += 1
    for number in range(changed):
        point = factor.spare[number]
        order[rows], kept[rows] = point, compliance[point]
        rows += 1
    for row in range(first, rows):
        if not _make_row(factor.rows, order, kept, row, delassus, around, scale):
            factor.filled[0] = row
            return False
    factor.filled[0] = rows
    return True


@compiled
def _make_row(
    rows: Array,
    order: Indices,
    compliance: Array,
    row: int,
    delassus: Array,
    around: AroundPoints | None,
    scale: float,
) -> bool:
    point = order[row]
    mine = rows[row]
    for column in range(row):
        other = rows[column]
        total = scale * delassus_entry(delassus, around, point, order[column])
        inner = 0.0
        for k in range(column):
            inner += mine[k] * other[k]
        mine[column] = (total - inner) / other[column]
    inner = 0.0
    for k in range(row):
        inner += mine[k] * mine[k]
    whole = scale * delassus_entry(delassus, around, point, point) + compliance[row]
    pivot = whole - inner
    if not pivot > 0.0:
        return False
    mine[row] = np.sqrt(pivot)
    return True


@compiled
def solve_with(factor: OrderedFactor, x: Array) -> None:
    """Replace b by x = (s D + diag(c))^-1 b in place, in the order of the rows, (count,)."""
    rows, count = factor.rows, factor.filled[0]
    for row in range(count):
        mine = rows[row]
        inner = 0.0
        for k in range(row):
            inner += mine[k] * x[k]
        x[row] = (x[row] - inner) / mine[row]
    for row in range(count - 1, -1, -1):
        mine = rows[row]
        value = x[row] / mine[row]
        x[row] = value
        for k in range(row):
            x[k] -= value * mine[k]
