"""Motion of contact points with the DOFs, and of DOFs under point forces: products of Phi and D.

Points around rigid sections share R, see `around_points`; others have their own rows. Which of the two it is, is known
when these functions are compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core.types.misc import NoneType
from numba.extending import overload

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.array_loops import add_rows, fill, set_products
from gapbeam.solver.system.operators import Array


def count_in_play(around: AroundPoints | None, size: int) -> int:
    """Return the number of m = `size` points that may touch in the step."""
    return size if around is None else int(around.chosen[0])


@overload(count_in_play, inline="always")  # type: ignore[untyped-decorator]
def _count_in_play(around: Any, size: Any) -> Callable[..., Any]:  # noqa: ARG001
    """Return the function compiled for the type of `around`."""

    def all_points(around: Any, size: Any) -> Any:  # noqa: ARG001
        return size

    def near_points(around: Any, size: Any) -> int:  # noqa: ARG001
        chosen: int = around.chosen[0]
        return chosen

    return all_points if isinstance(around, NoneType) else near_points


def in_play(around: AroundPoints | None, number: int) -> int:
    """Return one of the points that may touch in the step: the number itself where all may."""
    return number if around is None else int(around.near[number])


@overload(in_play, inline="always")  # type: ignore[untyped-decorator]
def _in_play(around: Any, number: Any) -> Callable[..., Any]:  # noqa: ARG001
    """Return the function compiled for the type of `around`."""

    def any_point(around: Any, number: Any) -> Any:  # noqa: ARG001
        return number

    def near_point(around: Any, number: Any) -> int:
        point: int = around.near[number]
        return point

    return any_point if isinstance(around, NoneType) else near_point


def turns(around: AroundPoints | None, point: int) -> bool:
    """Return whether a point is a station in a round hole, whose direction turns."""
    return around is not None and bool(around.holes[point, 2] == around.holes[point, 2])


@overload(turns, inline="always")  # type: ignore[untyped-decorator]
def _turns(around: Any, point: Any) -> Callable[..., bool]:  # noqa: ARG001
    """Return the function compiled for the type of `around`: none turns where there are no sections."""

    def never(around: Any, point: Any) -> bool:  # noqa: ARG001
        return False

    def where_a_hole_is(around: Any, point: Any) -> bool:
        return bool(around.holes[point, 2] == around.holes[point, 2])

    return never if isinstance(around, NoneType) else where_a_hole_is


@compiled
def set_motions(rows: Array, around: AroundPoints | None, x: Array, moved: Array) -> None:
    """Set moved, (m,), to Phi x."""
    if around is None:
        set_products(rows, x, moved)
    else:
        set_place(around, x, around.motions)
        for point in range(len(moved)):
            moved[point] = moved_by(around, around.motions, point)


@compiled
def add_forces(rows: Array, around: AroundPoints | None, forces: Array, x: Array) -> None:
    """Add Phi^T f to x, (n,); f is 0 but at points in play."""
    if around is None:
        add_rows(rows, forces, 1.0, x)
    else:
        _gather(around, forces)
        add_rows(rows, around.forces, 1.0, x)


@compiled
def add_responses(delassus: Array, around: AroundPoints | None, forces: Array, scale: float, moved: Array) -> None:
    """Add scale * D f to moved, (m,), at points in play; f is 0 at all others.

    Rows of D of points without a force are not read.
    """
    if around is None:
        add_rows(delassus, forces, scale, moved)
    else:
        set_responses(delassus, around, forces, scale)
        for number in range(count_in_play(around, len(moved))):
            point = in_play(around, number)
            moved[point] += moved_by(around, around.motions, point)


@compiled
def delassus_entry(delassus: Array, around: AroundPoints | None, i: int, j: int) -> float:
    """Return D_ij, m/N."""
    total = 0.0
    if around is None:
        total += delassus[i, j]
    else:
        for a in range(2):
            for b in range(2):
                entry = delassus[around.pairs[i, a], around.pairs[j, b]]
                total += around.directions[i, a] * around.directions[j, b] * entry
    return total


@compiled
def set_place(around: AroundPoints, x: Array, place: Array) -> None:
    """Set place to R x, (k,)."""
    set_products(around.rows, x, place)


@compiled
def moved_by(around: AroundPoints, motions: Array, point: int) -> float:
    """Return c . s of a point."""
    first, second = around.pairs[point, 0], around.pairs[point, 1]
    moved: float = around.directions[point, 0] * motions[first] + around.directions[point, 1] * motions[second]
    return moved


@compiled
def set_responses(delassus: Array, around: AroundPoints, forces: Array, scale: float) -> None:
    """Set the motions of the rows of R to scale * R A^-1 R^T T^T f; f is 0 but at points in play."""
    _gather(around, forces)
    fill(around.motions, 0.0)
    add_rows(delassus, around.forces, scale, around.motions)


@compiled
def _gather(around: AroundPoints, forces: Array) -> None:
    """Set the forces on the rows of R to T^T f."""
    fill(around.forces, 0.0)
    for number in range(count_in_play(around, len(forces))):
        point = in_play(around, number)
        if forces[point] != 0.0:
            for a in range(2):
                around.forces[around.pairs[point, a]] += around.directions[point, a] * forces[point]
