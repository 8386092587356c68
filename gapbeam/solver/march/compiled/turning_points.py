"""Directions of stations in round holes, `gapbeam.solver.contact.formulations.circle_contact`, in compiled steps.

They are found by turns as in `gapbeam.solver.march.python.turning_step`, to the same tolerances.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.contact_kernel import Solution
from gapbeam.solver.march.compiled.point_motions import count_in_play, in_play, set_place, turns
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
        for point in around.turning:
            for axis in range(3):
                around.holes[point, END + axis] = around.holes[point, START + axis]


@compiled
def aim(around: AroundPoints | None, found: Solution, first: bool) -> float:
    """Set the directions of stations that may touch to those of the step that is known so far.

    Args:
        around: Places, what the step adds to them without a change of the contact forces and, but for the first time,
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
        if len(around.turning) > 0:
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
        for point in around.turning:
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
        for point in around.turning:
            y, z = from_middle(around, around.motions, point, END)
            length = np.sqrt(y * y + z * z)
            across[point, 0] = -y / length if length > 0.0 else 0.0
            across[point, 1] = -z / length if length > 0.0 else 1.0


@compiled
def record_turning(
    around: AroundPoints | None, levers: Array, across: Array, weights: Array, pressure: Array, joints: Array
) -> None:
    """Add what the forces at stations add to the forces of joints, (r,).

    Args:
        around: The stations.
        levers: Contributions of forces along y and z there, (t, 2, r).
        across: Directions of all points, (m, 2).
        weights: w, (m,), m^2.
        pressure: (m,), Pa.
        joints: Changed in place.
    """
    if around is not None:
        for station in range(len(levers)):
            point = around.turning[station]
            for k in range(len(joints)):
                arm = across[point, 0] * levers[station, 0, k] + across[point, 1] * levers[station, 1, k]
                joints[k] += weights[point] * pressure[point] * arm
