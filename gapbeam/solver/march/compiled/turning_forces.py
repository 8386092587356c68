"""Forces at stations in round holes and their directions at once, between the contact solves of a step.

A contact solve finds forces N along given directions o. What it leaves is that turned forces move the sections: both
together are found by Newton's method on the vectors F of all points under pressure,

    F = N o,    o = -z / s,    z = r0 + r1,    s = |r0| + |r1|,    N = w P(|r0| - c0, |r1| - c1)

    r1 = r_free + s_D D F

    (1 - s_D T D) dF = N o - F,    T = dF/dr1 = -(N / s) 1 + (w P' - N / s) o e1^T,    e1 = r1 / |r1|

with T = -w P' c c^T at points whose directions c are fixed. The next contact solve has hardly anything left to do, and
checks that. Where more points press than there is room for, directions alone are brought to where the
forces, turned with them, take them, by products with D; so are those of the first solve of a step, by the forces of the
step before.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, stage_pressure
from gapbeam.solver.jit import compiled, compiled_apart
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.array_loops import add_rows, fill
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at
from gapbeam.solver.march.compiled.point_motions import count_in_play, in_play, set_responses, turns
from gapbeam.solver.march.compiled.turning_points import END, START, from_middle, turn
from gapbeam.solver.system.operators import Array

MOST_PRODUCTS = 8
STOP = 1.0e-14  # of a direction, no unit
SHARE = 1.0e-4  # of the turn before
MOST_UPDATES = 6
CLOSE = 1.0e-8  # of the largest force: an update after which the next one would be round-off


@compiled
def aim_with_forces(around: AroundPoints | None, balance: Balance, found: Solution, left: float) -> None:
    """Turn stations to where the forces of a solve, turned with them, take them; `left`: the turn after the solve."""
    if around is not None:
        for _ in range(MOST_PRODUCTS):
            set_responses(balance.delassus, around, found.change, balance.scale)
            change = 0.0
            for number in range(count_in_play(around, len(balance.held))):
                i = in_play(around, number)
                if found.pressure[i] != 0.0 and turns(around, i):
                    change = max(change, turn(around, i, False))
            if change <= max(STOP, SHARE * left):
                break


@compiled
def aim_with_old_forces(around: AroundPoints | None, balance: Balance, step: StepPoints, found: Solution) -> None:
    """Turn stations to where the forces of the step before, turned with them, would take them."""
    if around is not None:
        pressed = False
        for number in range(count_in_play(around, len(balance.held))):
            i = in_play(around, number)
            found.change[i], found.pressure[i] = 0.0, 0.0
            if turns(around, i) and step.old_pressure[i] > 0.0:
                found.change[i], found.pressure[i] = balance.weights[i] * step.old_pressure[i], step.old_pressure[i]
                pressed = True
        if pressed:
            aim_with_forces(around, balance, found, 1.0)


@compiled_apart
def turn_with_forces(
    around: AroundPoints | None, balance: Balance, step: StepPoints, law: LawTable, found: Solution, left: float
) -> int:
    """Find forces and directions of the points under pressure together; return the iterations.

    Args:
        around: The points.
        balance: The linear side.
        step: What the law is given.
        law: The law.
        found: The solution along the directions before, brought up to date in place.
        left: By how much directions turned after it, no unit.
    """
    updates = 0
    if around is not None:
        order, count, others = found.factor.spare, 0, False
        for number in range(count_in_play(around, len(balance.held))):
            i = in_play(around, number)
            if found.pressure[i] != 0.0:
                order[count] = i
                count += 1
            elif found.change[i] != 0.0:
                others = True
        if others or 2 * count > len(balance.held):
            aim_with_forces(around, balance, found, left)
            return 0
        forces = found.update
        for k in range(count):
            for a in range(2):
                forces[2 * k + a] = found.change[order[k]] * around.directions[order[k], a]
        for _ in range(MOST_UPDATES):
            largest = _linearize(around, balance, step, law, found, count)
            if not _solve_updates(around, balance, found, count):
                break
            updates += 1
            changed = 0.0
            for row in range(2 * count):
                forces[row] += found.target[row]
                changed = max(changed, abs(found.target[row]))
            if not changed > CLOSE * largest:
                break
        _linearize(around, balance, step, law, found, count)
    return updates


@compiled
def _linearize(
    around: AroundPoints, balance: Balance, step: StepPoints, law: LawTable, found: Solution, count: int
) -> float:
    """Set directions and normal forces by the vectors F in `found.update`; set N o - F and T; return the largest N."""
    order, forces = found.factor.spare, found.update
    fill(around.forces, 0.0)
    for k in range(count):
        for a in range(2):
            around.forces[around.pairs[order[k], a]] += forces[2 * k + a]
    fill(around.motions, 0.0)
    add_rows(balance.delassus, around.forces, balance.scale, around.motions)
    largest = 0.0
    for k in range(count):
        i = order[k]
        first, second = around.pairs[i, 0], around.pairs[i, 1]
        away, y, z, length, outward, upward = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if turns(around, i):
            turn(around, i, False)
            before_y, before_z = from_middle(around, around.place, i, START)
            y = before_y + around.guess[first] + around.free[first] + around.motions[first]
            z = before_z + around.guess[second] + around.free[second] + around.motions[second]
            y -= around.holes[i, END] - around.holes[i, START]
            z -= around.holes[i, END + 1] - around.holes[i, START + 1]
            away = np.sqrt(y * y + z * z)
            length = np.sqrt(before_y * before_y + before_z * before_z) + away
            depth = away - around.holes[i, END + 2]
        else:
            depth = balance.held_depth[i]
            depth -= around.directions[i, 0] * around.motions[first] + around.directions[i, 1] * around.motions[second]
        pressure, slope, _ = stage_pressure(step.numbers, numbers_at(law, i), point_at(step, law, i), depth)
        normal, stiffness = balance.weights[i] * pressure, balance.weights[i] * slope
        side = 0.0
        if away > 0.0:
            outward, upward, side = y / away, z / away, normal / length
        else:
            outward, upward = -around.directions[i, 0], -around.directions[i, 1]
        normal -= balance.held[i]
        found.change[i], found.pressure[i] = normal, pressure
        largest = max(largest, abs(normal))
        aside, up = around.directions[i, 0], around.directions[i, 1]
        found.target[2 * k], found.target[2 * k + 1] = normal * aside - forces[2 * k], normal * up - forces[2 * k + 1]
        steep = stiffness - side
        found.newton[2 * k], found.newton[2 * k + 1] = steep * aside * outward - side, steep * aside * upward
        found.deeper[2 * k], found.deeper[2 * k + 1] = steep * up * outward, steep * up * upward - side
    return largest


@compiled
def _solve_updates(around: AroundPoints, balance: Balance, found: Solution, count: int) -> bool:
    """Solve (1 - s T D) dF = N o - F in `found.target`, in place; tell whether that can be."""
    order, matrix, right, size = found.factor.spare, found.factor.rows, found.target, 2 * count
    for k in range(count):
        for m in range(count):
            for b in range(2):
                one = balance.scale * balance.delassus[around.pairs[order[k], 0], around.pairs[order[m], b]]
                two = balance.scale * balance.delassus[around.pairs[order[k], 1], around.pairs[order[m], b]]
                matrix[2 * k, 2 * m + b] = -(found.newton[2 * k] * one + found.newton[2 * k + 1] * two)
                matrix[2 * k + 1, 2 * m + b] = -(found.deeper[2 * k] * one + found.deeper[2 * k + 1] * two)
        matrix[2 * k, 2 * k] += 1.0
        matrix[2 * k + 1, 2 * k + 1] += 1.0
    for row in range(size):
        _pivot(matrix, right, row, size)
        pivot = matrix[row, row]
        if not abs(pivot) > 0.0:
            return False
        for below in range(row + 1, size):
            share = matrix[below, row] / pivot
            if share != 0.0:
                for column in range(row + 1, size):
                    matrix[below, column] -= share * matrix[row, column]
                right[below] -= share * right[row]
    for row in range(size - 1, -1, -1):
        total = right[row]
        for column in range(row + 1, size):
            total -= matrix[row, column] * right[column]
        right[row] = total / matrix[row, row]
    return True


@compiled
def _pivot(matrix: Array, right: Array, row: int, size: int) -> None:
    """Swap a row with the one below it that has the largest entry in its column."""
    best = row
    for below in range(row + 1, size):
        if abs(matrix[below, row]) > abs(matrix[best, row]):
            best = below
    if best != row:
        for column in range(row, size):
            matrix[row, column], matrix[best, column] = matrix[best, column], matrix[row, column]
        right[row], right[best] = right[best], right[row]
