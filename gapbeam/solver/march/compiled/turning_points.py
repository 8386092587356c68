"""Contact points of rigid sections in compiled steps: directions of stations in round holes, and points that may touch.

Directions are those of `gapbeam.solver.contact.formulations.circle_contact`, found by turns as in
`gapbeam.solver.march.stepwise_march`, to the same tolerances.

A section at s holds its points at d_i = -(g0_i + c_i . s) with unit vectors c_i. If it moves by no more than b in a
step, a point with d_i < -b stays open: its law is 0, and nothing of it is computed. What the contact forces of the step
add to s is known after they are; where that is more than was allowed for, the step is solved again with all points.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.march.compiled.contact_kernel import Solution
from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    count_in_play,
    fill,
    in_play,
    moved_by,
    set_place,
    turns,
)
from gapbeam.solver.system.operators import Array

START, END = 0, 4  # where m and c of the start and of the end of a step begin in `AroundPoints.holes`


@compiled
def from_middle(around: AroundPoints, place: Array, point: int, at: int) -> tuple[float, float]:
    """Return r = s - m of a station, y and z, m; `at`: START or END."""
    y = place[around.pairs[point, 0]] - around.holes[point, at]
    z = place[around.pairs[point, 1]] - around.holes[point, at + 1]
    return y, z


@compiled
def hole_growth(around: AroundPoints, point: int) -> float:
    """Return by how much the motion of its hole opens the gap of a station in a step, c1 - c0 - o . (m1 - m0), m."""
    growth: float = around.holes[point, END + 2] - around.holes[point, START + 2]
    for axis in range(2):
        moved = around.holes[point, END + axis] - around.holes[point, START + axis]
        growth -= around.directions[point, axis] * moved
    return growth


@compiled
def stay_holes(around: AroundPoints | None) -> None:
    """Put holes back to where they were at the start of a step."""
    if around is not None:
        for point in around.stations:
            for axis in range(3):
                around.holes[point, END + axis] = around.holes[point, START + axis]


@compiled
def aim(around: AroundPoints | None, found: Solution, first: bool) -> float:
    """Set the directions of stations that may touch to those of the step that is known so far.

    Args:
        around: Places, what the step adds to them without a change of the contact forces and, except the first time,
            what this change adds in `motions`.
        found: The solution so far; its factor is that of other directions.
        first: Whether no solution is known yet.

    Returns:
        The largest change of a direction in contact, no unit; 0 where no direction turns. In contact are stations
        under pressure, and those that lie in the wall at the start or the end of the step: along the direction before
        they may have been free.
    """
    largest = 0.0
    if around is not None:
        for number in range(count_in_play(around, len(found.pressure))):
            point = in_play(around, number)
            if turns(around, point):
                change = turn(around, point, first)
                if not first and (found.pressure[point] != 0.0 or touches(around, point)):
                    largest = max(largest, change)
        if len(around.stations) > 0:
            found.factor.filled[0] = 0
    return largest


@compiled
def turn(around: AroundPoints, point: int, first: bool) -> float:
    """Set the direction of a station as `aim` does; return its change, no unit."""
    y, z = from_middle(around, around.place, point, START)
    new_y, new_z = _end_from_middle(around, point, first)
    lengths = np.sqrt(y * y + z * z) + np.sqrt(new_y * new_y + new_z * new_z)
    scale = -1.0 / lengths if lengths > 0.0 else 0.0
    aside, up = scale * (y + new_y), scale * (z + new_z)
    change: float = max(abs(aside - around.directions[point, 0]), abs(up - around.directions[point, 1]))
    around.directions[point, 0], around.directions[point, 1] = aside, up
    return change


@compiled
def touches(around: AroundPoints, point: int) -> bool:
    """Return whether a station lies in the wall at the start of a step or at its end, as far as that is known."""
    y, z = _end_from_middle(around, point, False)
    inside: bool = np.sqrt(y * y + z * z) > around.holes[point, END + 2]
    return inside or far(around, around.place, point, START) > 0.0


@compiled
def _end_from_middle(around: AroundPoints, point: int, first: bool) -> tuple[float, float]:
    """Return r of a station at the end of a step, y and z, m; `first`: without a change of the contact forces."""
    a, b = around.pairs[point, 0], around.pairs[point, 1]
    y, z = from_middle(around, around.place, point, START)
    y, z = y + around.guess[a] + around.free[a], z + around.guess[b] + around.free[b]
    y -= around.holes[point, END] - around.holes[point, START]
    z -= around.holes[point, END + 1] - around.holes[point, START + 1]
    if not first:
        y, z = y + around.motions[a], z + around.motions[b]
    return y, z


@compiled
def far(around: AroundPoints, place: Array, point: int, at: int) -> float:
    """Return |r| - c of a station at s, m; `at`: START or END."""
    y, z = from_middle(around, place, point, at)
    depth: float = np.sqrt(y * y + z * z) - around.holes[point, at + 2]
    return depth


@compiled
def set_far(around: AroundPoints | None, depth: Array) -> None:
    """Set the penetrations of stations to |r| - c, at the s in `motions`, (m,), m."""
    if around is not None:
        for point in around.stations:
            depth[point] = far(around, around.motions, point, END)


@compiled
def point_outward(around: AroundPoints | None, q: Array, across: Array) -> None:
    """Set the directions that records are made with to those of a state, opposite to r.

    Args:
        around: The stations.
        q: The state, (n,).
        across: Unit vectors, (m, 2), changed in place.
    """
    if around is not None:
        set_place(around, q, around.motions)
        for point in around.stations:
            y, z = from_middle(around, around.motions, point, END)
            length = np.sqrt(y * y + z * z)
            across[point, 0] = -y / length if length > 0.0 else 0.0
            across[point, 1] = -z / length if length > 0.0 else 1.0


@compiled
def record_turning(
    around: AroundPoints | None, levers: Array, across: Array, weights: Array, pressure: Array, rubbed: Array,
    joints: Array,
) -> None:  # fmt: skip
    """Add the contribution of the forces at stations to the forces of joints, (r,).

    Args:
        around: The stations.
        levers: Contributions of what acts there, see `Circles.forces`, (t, 6, r).
        across: Directions of all points, (m, 2).
        weights: w, (m,), m^2.
        pressure: (m,), Pa.
        rubbed: Memory of friction, whose first columns are tractions along x and around the section, Pa; or none.
        joints: Forces of joints, changed in place.
    """
    if around is not None:
        for station in range(len(levers)):
            point = around.stations[station]
            y, z, lever = across[point, 0], across[point, 1], levers[station]
            for k in range(len(joints)):
                arm = pressure[point] * (y * lever[0, k] + z * lever[1, k])
                if rubbed.shape[1] > 0:
                    arm += rubbed[point, 0] * (lever[2, k] + y * lever[3, k] + z * lever[4, k])
                    arm += rubbed[point, 1] * (lever[5, k] + y * lever[1, k] - z * lever[0, k])
                joints[k] += weights[point] * arm


SLACK = 0.01  # of the smallest gap, allowed for beyond twice the motion without a change of the forces


@compiled
def depth_at(around: AroundPoints, initial_gap: Array, place: Array, point: int, at: int) -> float:
    """Return d of a point: -(g0 + c . s), or |s - m| - c of a station in a round hole; `at`: START or END."""
    if turns(around, point):
        return far(around, place, point, at)
    depth: float = -initial_gap[point] - moved_by(around, place, point)
    return depth


@compiled
def begin_near(around: AroundPoints | None, q: Array, pressure: Array) -> None:
    """Begin with a state: the places of its sections, and the points under pressure."""
    if around is not None:
        set_place(around, q, around.place)
        count = 0
        for point in range(len(pressure)):
            if pressure[point] != 0.0:
                around.near[count] = point
                count += 1
        around.chosen[0] = count


@compiled
def choose_near(around: AroundPoints, initial_gap: Array, pressure: Array, everything: bool) -> None:
    """Choose the points that may touch: by the motions in `around`, or all.

    Args:
        around: Points around sections, changed in place.
        initial_gap: g0, (m,), m.
        pressure: Pressure of the state, (m,), Pa; points under pressure are chosen.
        everything: Whether all points are.
    """
    count = 0
    fill(around.pressed, 0.0)
    for number in range(count_in_play(around, len(pressure))):
        point = in_play(around, number)
        if pressure[point] != 0.0:
            around.pressed[around.pairs[point, 0] // 2] = 1.0
    for section in range(len(around.least_gap)):
        free, guess = _length(around.free, section), _length(around.guess, section)
        bound = np.inf if everything else 2.0 * (guess + free) + SLACK * abs(around.least_gap[section])
        around.bound[section] = bound
        if around.pressed[section] == 0.0 and _length(around.place, section) + bound < around.least_gap[section]:
            continue
        for number in range(around.starts[section], around.starts[section + 1]):
            point = around.members[number]
            if pressure[point] != 0.0 or depth_at(around, initial_gap, around.place, point, START) > -bound:
                around.near[count] = point
                count += 1
    around.chosen[0] = count


@compiled
def stay_in_bounds(around: AroundPoints | None) -> bool:
    """Return whether the `motions` that forces make move no section by more than half of the allowance."""
    if around is not None:
        for section in range(len(around.bound)):
            if _length(around.motions, section) > 0.5 * around.bound[section]:
                return False
    return True


@compiled
def raise_closest(around: AroundPoints | None, initial_gap: Array, deepest: Array, so_far: Array) -> None:
    """Raise the penetration of faces, (faces,), to that of points that cannot touch, where it is a new largest one.

    Args:
        around: The sections, at the end of the step.
        initial_gap: g0, (m,), m.
        deepest: Largest penetration in the step so far, changed in place, m.
        so_far: Largest penetration of the steps before, m.
    """
    if around is not None:
        for section in range(len(around.least_gap)):
            face = around.faces[section]
            highest = _length(around.after, section) - around.least_gap[section]
            if highest > deepest[face] and highest > so_far[face]:
                for number in range(around.starts[section], around.starts[section + 1]):
                    depth = depth_at(around, initial_gap, around.after, around.members[number], END)
                    deepest[face] = max(deepest[face], depth)


@compiled
def _length(motions: Array, section: int) -> float:
    """Return the length of the motion of a section."""
    y, z = motions[2 * section], motions[2 * section + 1]
    length: float = np.sqrt(y * y + z * z)
    return length
