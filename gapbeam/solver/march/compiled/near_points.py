"""The contact points around rigid sections that may touch in a step.

A section at s holds its points at d_i = -(g0_i + c_i . s) with unit vectors c_i. If it moves by no more than b in a
step, a point with d_i < -b stays open: its law is 0, and nothing of it is computed. What the contact forces of the step
add to s is known after they are; where that is more than was allowed for, the step is solved again with all points.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.jit import compiled
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.array_loops import fill
from gapbeam.solver.march.compiled.point_motions import (
    count_in_play,
    in_play,
    moved_by,
    set_place,
    set_responses,
    turns,
)
from gapbeam.solver.march.compiled.turning_points import END, START, far
from gapbeam.solver.system.operators import Array

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
        around: Changed in place.
        initial_gap: g0, (m,), m.
        pressure: Of the state, (m,), Pa; points under pressure are chosen.
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
def stay_in_bounds(delassus: Array, around: AroundPoints | None, change: Array, scale: float) -> bool:
    """Return whether forces f, (m,), N, move no section by more than half of what was allowed for."""
    if around is not None:
        set_responses(delassus, around, change, scale)
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
