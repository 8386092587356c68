"""Motion of contact points with the DOFs, and of DOFs under point forces: products of Phi and D.

Products are written as loops: they compile faster than array expressions and need no temporary arrays.

Contact points around rigid sections share the motions R of these sections; other points have rows of their own. Which
of the two it is, is known when the functions are compiled.

    d = -(g0 + Phi q),    Phi = T R,    D = Phi A^-1 Phi^T = T (R A^-1 R^T) T^T

The points around a section that keeps its shape all move by the two motions s = R q of the section across the beam: R
has two rows for each section, and each row of T two entries, the direction c of a point. Products then cost as many
rows as there are sections, and not points; and of the points, only those that may touch in a step are looked at.

A station in a round hole is one point, whose direction is that of each step (`circle_contact`):

    d = |r| - c,    r = s - m,    c_i = -(r0 + r1) / (|r0| + |r1|)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba.core.types.misc import NoneType
from numba.extending import overload

from gapbeam.solver.compilation.jit import compiled, compiled_apart
from gapbeam.solver.contact.solve.section_solve import SharedMotions, room_for_motions
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator

SAME_PLACE = 1.0e-9  # of the length over which points stand; at one x
SAME_ROWS = 1.0e-10  # of the largest entry; round-off of places
WORTH = 4  # points for each row from which sharing pays


class AroundPoints(NamedTuple):
    """T, the k / 2 sections, and room for a step.

    Attributes:
        pairs: The two rows of R by which each point moves, (m, 2).
        directions: c, (m, 2).
        rows: R, (k, n).
        starts: Index of the first point of each section among the members, (k / 2 + 1,).
        members: The points, section by section, (m,).
        least_gap: The smallest g0 of each section, (k / 2,), m.
        faces: Face of each section, (k / 2,).
        near: The points that may touch in the step, the first `chosen` entries, (m,).
        chosen: Their number, (1,).
        forces: Room for forces on the rows of R, (k,), N.
        motions: Room for motions of the rows of R, (k,).
        place: s of the state, (k,), m.
        after: s at the end of the step, (k,), m.
        guess: Change of s up to the guess of the scheme, (k,), m.
        rate: Its rate, (k,), m/s.
        free: Change of s in the step beyond the guess while the contact forces stay, (k,), m.
        bound: Largest motion of each section in the step, (k / 2,), m.
        pressed: 1 for sections with a point under pressure, else 0, (k / 2,).
        stations: Points that are stations in round holes, (t,).
        holes: Middle m and clearance c of the hole of each station at the start of the step, the radius of its section,
            and m and c at the end of the step; NaN at points whose directions are fixed, (m, 7), m.
        shared: Room for the equations of the motions s.
    """

    pairs: Indices
    directions: Array
    rows: Array
    starts: Indices
    members: Indices
    least_gap: Array
    faces: Indices
    near: Indices
    chosen: Indices
    forces: Array
    motions: Array
    place: Array
    after: Array
    guess: Array
    rate: Array
    free: Array
    bound: Array
    pressed: Array
    stations: Indices
    holes: Array
    shared: SharedMotions


def around_points(gaps: Array, contact: ContactOperator, planes: Array) -> tuple[Array, AroundPoints | None]:
    """Return R, and the points around it; Phi and None where hardly any points share their motions, or walls move.

    Stations in round holes are always there, and so are all other points beside them.

    Args:
        gaps: Phi, (m, n).
        contact: Its points.
        planes: The motions of the axes of the stations, (t, 2, n).
    """
    if not contact.support.around or (contact.walls.motions and not contact.circles):
        return gaps, None
    sections = _sections(gaps, contact, planes)
    if sections is None:
        return gaps, None
    rows = np.concatenate([motions for _, motions in sections])
    if not contact.circles and WORTH * len(rows) > len(gaps):
        return gaps, None
    starts = np.cumsum([0, *(len(points) for points, _ in sections)])
    members, points = np.concatenate([points for points, _ in sections]), contact.size
    numbers = np.empty(points, dtype=np.int64)
    numbers[members] = np.repeat(np.arange(len(sections)), np.diff(starts))
    return rows, AroundPoints(
        pairs=np.stack([2 * numbers, 2 * numbers + 1], axis=1),
        directions=np.array(contact.across, order="C"),
        rows=np.ascontiguousarray(rows),
        starts=starts.astype(np.int64),
        members=members.astype(np.int64),
        least_gap=_least_gaps(contact, members, starts),
        faces=contact.faces[members[starts[:-1]]].astype(np.int64),
        near=np.zeros(points, dtype=np.int64),
        chosen=np.zeros(1, dtype=np.int64),
        forces=np.zeros(len(rows)),
        motions=np.zeros(len(rows)),
        place=np.zeros(len(rows)),
        after=np.zeros(len(rows)),
        guess=np.zeros(len(rows)),
        rate=np.zeros(len(rows)),
        free=np.zeros(len(rows)),
        bound=np.zeros(len(rows) // 2),
        pressed=np.zeros(len(rows) // 2),
        stations=contact.circles.points.astype(np.int64),
        holes=_holes(contact),
        shared=room_for_motions(len(rows)),
    )


def _sections(gaps: Array, contact: ContactOperator, planes: Array) -> list[tuple[Indices, Array]] | None:
    """Return the points of each section along the beam, and the two rows by which they move.

    A station is a section of its own. Beside stations, a point that shares no rows has its own; else there are none.
    """
    x, largest = contact.positions[:, 0], float(np.abs(gaps).max())
    members = np.argsort(x, kind="stable")
    stations = {int(point): plane for point, plane in zip(contact.circles.points, planes, strict=True)}
    turns = np.isin(members, contact.circles.points)
    apart = (np.diff(x[members]) > SAME_PLACE * np.ptp(x)) | turns[1:] | turns[:-1]
    found = list[tuple[Indices, Array]]()
    for section in np.split(members, np.flatnonzero(apart) + 1):
        if int(section[0]) in stations:
            found.append((section, stations[int(section[0])]))
            continue
        motions = _fitted(contact.across[section], gaps[section])
        if np.abs(contact.across[section] @ motions - gaps[section]).max() <= SAME_ROWS * largest:
            found.append((section, motions))
        elif stations:
            found += [(point, _fitted(contact.across[point], gaps[point])) for point in section[:, None]]
        else:
            return None
    return found


def _fitted(directions: Array, gaps: Array) -> Array:
    """Return the least rows, (2, n), of which directions, (m, 2), make the rows of points, (m, n)."""
    return np.asarray(np.linalg.lstsq(directions, gaps, rcond=None)[0])


def _holes(contact: ContactOperator) -> Array:
    """Return middle, clearance and radius of each station, middle and clearance again, NaN at other points, (m, 7)."""
    found, circles = np.full((contact.size, 7), np.nan), contact.circles
    hole = np.column_stack([circles.middles, circles.clearances])
    found[circles.points] = np.column_stack([hole, circles.radii, hole])
    return found


def _least_gaps(contact: ContactOperator, members: Indices, starts: Indices) -> Array:
    """Return the smallest g0 of each section, (k / 2,), m; of stations whose holes move -inf: they may always touch."""
    gaps = contact.initial_gap.copy()
    if contact.walls.motions:
        gaps[contact.circles.points] = -np.inf
    return np.asarray(np.minimum.reduceat(gaps[members], starts[:-1]))


@compiled
def fill(x: Array, value: float) -> None:
    """Set all entries."""
    for j in range(len(x)):
        x[j] = value


@compiled
def copy_into(x: Array, y: Array) -> None:
    """Set x to y."""
    for j in range(len(x)):
        x[j] = y[j]


@compiled
def inner_product(x: Array, y: Array) -> float:
    """Return x . y."""
    total = 0.0
    for j in range(len(x)):
        total += x[j] * y[j]
    return total


@compiled_apart
def set_products(matrix: Array, x: Array, products: Array) -> None:
    """Set products, (rows,), to matrix x, four rows at a time."""
    rows, size = len(products), len(x)
    whole = rows - rows % 4
    for r in range(0, whole, 4):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(size):
            a += matrix[r, j] * x[j]
            b += matrix[r + 1, j] * x[j]
            c += matrix[r + 2, j] * x[j]
            d += matrix[r + 3, j] * x[j]
        products[r], products[r + 1], products[r + 2], products[r + 3] = a, b, c, d
    for r in range(whole, rows):
        products[r] = inner_product(matrix[r], x)


@compiled
def add_rows(matrix: Array, factors: Array, scale: float, x: Array) -> None:
    """Add scale * matrix^T factors to x; rows with a factor of 0 are not read, the others four at a time."""
    rows, size, row = len(factors), len(x), 0
    while True:
        picked, a, b, c = 0, 0, 0, 0
        while row < rows:
            if factors[row] != 0.0:
                picked += 1
                if picked == 1:
                    a = row
                elif picked == 2:
                    b = row
                elif picked == 3:
                    c = row
                else:
                    break
            row += 1
        if picked == 4:
            fa, fb, fc, fd = scale * factors[a], scale * factors[b], scale * factors[c], scale * factors[row]
            first, second, third, fourth = matrix[a], matrix[b], matrix[c], matrix[row]
            for j in range(size):
                x[j] += fa * first[j] + fb * second[j] + fc * third[j] + fd * fourth[j]
            row += 1
            continue
        for number in range(picked):
            chosen = a if number == 0 else (b if number == 1 else c)
            factor, only = scale * factors[chosen], matrix[chosen]
            for j in range(size):
                x[j] += factor * only[j]
        return


@compiled
def add_all_rows(matrix: Array, factors: Array, x: Array) -> None:
    """Add matrix^T factors to x, eight rows at a time; for factors of which hardly any is 0."""
    size, rows = len(x), len(factors)
    whole = rows - rows % 8
    for r in range(0, whole, 8):
        f0, f1, f2, f3 = factors[r], factors[r + 1], factors[r + 2], factors[r + 3]
        f4, f5, f6, f7 = factors[r + 4], factors[r + 5], factors[r + 6], factors[r + 7]
        for j in range(size):
            one = f0 * matrix[r, j] + f1 * matrix[r + 1, j] + f2 * matrix[r + 2, j] + f3 * matrix[r + 3, j]
            two = f4 * matrix[r + 4, j] + f5 * matrix[r + 5, j] + f6 * matrix[r + 6, j] + f7 * matrix[r + 7, j]
            x[j] += one + two
    for r in range(whole, rows):
        factor = factors[r]
        for j in range(size):
            x[j] += factor * matrix[r, j]


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
