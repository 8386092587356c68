"""Contact problem of a step of any scheme, and the state of the points at its end.

Forces at stations in round holes are found with their directions between the contact solves of a step.

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

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled, compiled_apart
from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, stage_pressure, touch_factor
from gapbeam.solver.contact.solve.elimination import eliminate
from gapbeam.solver.contact.solve.friction_equations import Rubbing
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at, solve_contact
from gapbeam.solver.march.compiled.friction_kernel import solve_with_friction
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Modal, Room
from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    add_rows,
    copy_into,
    count_in_play,
    fill,
    in_play,
    moved_by,
    set_motions,
    set_place,
    set_responses,
    turns,
)
from gapbeam.solver.march.compiled.rubbing_points import nothing_rubs
from gapbeam.solver.march.compiled.turning_points import (
    END,
    START,
    aim,
    begin_near,
    choose_near,
    depth_at,
    from_middle,
    hole_growth,
    set_far,
    stay_in_bounds,
    turn,
)
from gapbeam.solver.march.stepwise_march import MOST_TURNS, idle_turns, settled
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
        step: Input of the law.
        law: The law.
        found: The solution along the directions before, brought up to date in place.
        left: Largest turn of the directions after it, no unit.
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
    return eliminate(matrix, right, size)


class Touch(NamedTuple):
    """Velocity of the state, (n,), and the touch speeds that follow from it, (m,), m/s, changed in place."""

    velocity: Array
    speed: Array


@compiled
def begin_points(modal: Modal, motion: KernelState, room: Room) -> None:
    """Begin with a state."""
    fill(room.held, 0.0)
    fill(room.solution.compliance, 0.0)
    begin_near(modal.around, motion.q, motion.pressure)


@compiled
def hold_forces(
    gaps: Array, around: AroundPoints | None, response: Array, scale: float, start: Array, held_depth: Array
) -> None:
    """Set the penetrations that points would have with the forces held, d - s Phi x; around sections, s R x.

    Args:
        gaps: Phi or R.
        around: Points around rigid sections; None: others.
        response: x, what the operator of the step makes of the right side, (n,).
        scale: s.
        start: d, of the state or of the guess of the scheme, (m,), m.
        held_depth: Set to d - s Phi x, (m,), m.
    """
    if around is None:
        set_motions(gaps, around, response, held_depth)
        for i in range(len(held_depth)):
            held_depth[i] = start[i] - scale * held_depth[i]
    else:
        set_place(around, response, around.free)
        for row in range(len(around.free)):
            around.free[row] *= scale


@compiled
def guess_depths(
    gaps: Array, around: AroundPoints | None, initial_gap: Array, u: Array, v: Array, depth: Array, rate: Array
) -> None:
    """Set the penetrations that a guess of the scheme makes, -(g0 + Phi u), and their rates; around sections, R u.

    Args:
        gaps: Phi or R.
        around: Points around rigid sections; None: others.
        initial_gap: g0, (m,), m.
        u: Guess, (n,).
        v: Its velocity, (n,).
        depth: Set to the penetrations, (m,), m.
        rate: Set to their rates, (m,), m/s.
    """
    if around is None:
        set_motions(gaps, around, u, depth)
        set_motions(gaps, around, v, rate)
        for i in range(len(depth)):
            depth[i] = -initial_gap[i] - depth[i]
            rate[i] = -rate[i]
    else:
        set_place(around, u, around.guess)
        set_place(around, v, around.rate)
        for row in range(len(around.guess)):
            around.guess[row] -= around.place[row]


class Slip(NamedTuple):
    """Memory of friction, see `KernelState`, the velocity in the balance while the forces stay, (n,), and c.

    c is what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
    """

    rubbed: Array
    velocity: Array
    weight: float


@compiled
def solve_points(
    around: AroundPoints | None, friction: Rubbing | None, initial_gap: Array, balance: Balance, step: StepPoints,
    law: LawTable, touch: Touch, slip: Slip, found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve the contact problem of a step; return the iterations, or -1 where that fails."""
    everything, total, turn, least, idle = False, 0, 0, np.inf, 0
    while True:
        if turn == 0:
            _look_around(around, initial_gap, step, found, everything)
            if count_in_play(around, len(initial_gap)) == 0:
                nothing_rubs(friction)
                return total
            aim(around, found, True)
            aim_with_old_forces(around, balance, step, found)
            _hold_points(around, initial_gap, balance.held_depth, step, law, touch)
        else:
            _hold_turned(around, balance.held_depth, step, len(initial_gap))
        iterations = _solve_forces(around, friction, balance, step, law, slip, found, most, turn > 0)
        if iterations < 0:
            return iterations
        total += iterations
        if not stay_in_bounds(around):
            everything, turn, least, idle = True, 0, np.inf, 0
            continue
        left = aim(around, found, False)
        idle = idle_turns(left, least, idle)
        if settled(left, idle):
            return total
        if turn == MOST_TURNS:
            return -1
        least, turn = min(least, left), turn + 1
        if friction is None:
            total += turn_with_forces(around, balance, step, law, found, left)


@compiled
def _solve_forces(
    around: AroundPoints | None, friction: Rubbing | None, balance: Balance, step: StepPoints, law: LawTable,
    slip: Slip, found: Solution, most: int, again: bool,
) -> int:  # fmt: skip
    """Solve along given directions, and set the motions of sections; return the iterations, -1: it failed."""
    if friction is None:
        iterations = solve_contact(balance, step, law, found, most, again)
        if around is not None and iterations >= 0:
            set_responses(balance.delassus, around, found.change, balance.scale)
    else:
        iterations = solve_with_friction(
            friction, around, balance, step, law, slip.rubbed, slip.velocity, slip.weight, found, most, again
        )
        if around is not None:
            for row in range(len(around.motions)):
                around.motions[row] = balance.scale * friction.moved[row]
    return iterations


@compiled
def _hold_turned(around: AroundPoints | None, held_depth: Array, step: StepPoints, size: int) -> None:
    """Set the penetrations that stations would have with the forces held, in directions that have turned."""
    if around is not None:
        for number in range(count_in_play(around, size)):
            i = in_play(around, number)
            if turns(around, i):
                step.guess_depth[i] = step.old_depth[i] - moved_by(around, around.guess, i)
                held_depth[i] = step.guess_depth[i] - moved_by(around, around.free, i) - hole_growth(around, i)


@compiled
def _look_around(
    around: AroundPoints | None, initial_gap: Array, step: StepPoints, found: Solution, everything: bool
) -> None:
    """Choose the points that may touch."""
    if around is not None:
        for number in range(count_in_play(around, len(initial_gap))):
            i = in_play(around, number)
            found.change[i], found.pressure[i], found.compliance[i] = 0.0, 0.0, 0.0
        choose_near(around, initial_gap, step.old_pressure, everything)


@compiled
def _hold_points(
    around: AroundPoints | None, initial_gap: Array, held_depth: Array, step: StepPoints, law: LawTable, touch: Touch
) -> None:
    """Set the penetrations of the points that may touch: before the step, of the guess, and held."""
    if around is not None:
        for number in range(count_in_play(around, len(initial_gap))):
            i = in_play(around, number)
            step.old_depth[i] = depth_at(around, initial_gap, around.place, i, START)
            step.guess_depth[i] = step.old_depth[i] - moved_by(around, around.guess, i)
            step.guess_rate[i] = -moved_by(around, around.rate, i)
            held_depth[i] = step.guess_depth[i] - moved_by(around, around.free, i)
            if turns(around, i):
                held_depth[i] -= hole_growth(around, i)
        if law.by_touch:
            set_place(around, touch.velocity, around.motions)
            for number in range(count_in_play(around, len(initial_gap))):
                i = in_play(around, number)
                _touch(law, step.old_depth, touch.speed, i, moved_by(around, around.motions, i))


@compiled
def open_gaps(around: AroundPoints | None, opened: Array, depth: Array) -> None:
    """Subtract the opening of walls, (m,), from penetrations or their rates, (m,): still walls change no digit.

    Walls around sections that share their motions stand still, except for round holes (`scheme_kernels.move_walls`).
    """
    if around is None:
        for i in range(len(depth)):
            depth[i] -= opened[i]


@compiled
def end_points(around: AroundPoints | None, initial_gap: Array, room: Room) -> None:
    """Set the penetrations of points around sections at the end of a step."""
    if around is not None:
        set_place(around, room.new_q, around.after)
        for number in range(count_in_play(around, len(initial_gap))):
            i = in_play(around, number)
            room.solution.depth[i] = depth_at(around, initial_gap, around.after, i, END)


@compiled
def accept_points(around: AroundPoints | None) -> None:
    """Make the end of a step the state."""
    if around is not None:
        copy_into(around.place, around.after)


@compiled
def form_gaps_anew(modal: Modal, motion: KernelState, room: Room) -> None:
    """Form the penetrations of all points from the DOFs, so that round-off does not add up."""
    set_motions(modal.gaps, modal.around, motion.q, motion.depth)
    for i in range(len(motion.depth)):
        motion.depth[i] = -modal.initial_gap[i] - motion.depth[i]
    open_gaps(modal.around, room.opened, motion.depth)
    set_far(modal.around, motion.depth)


@compiled
def added_up(gaps: Array, around: AroundPoints | None, initial_gap: Array, q: Array, point: int) -> float:
    """Return the sum of the sizes of all terms that the penetration of a point adds up, m."""
    total: float = abs(initial_gap[point])
    if around is None:
        for j in range(len(q)):
            total += abs(gaps[point, j] * q[j])
    else:
        for a in range(2):
            for j in range(len(q)):
                total += abs(around.rows[around.pairs[point, a], j] * q[j])
        if turns(around, point):
            for a in range(3):
                total += abs(around.holes[point, END + a])
    return total


@compiled
def touch_all(modal: Modal, law: LawTable, motion: KernelState, room: Room) -> None:
    """Keep the approach speeds of all open points, and the damping coefficients that follow."""
    set_motions(modal.gaps, modal.around, motion.v, room.guess_rate)
    for i in range(len(motion.depth)):
        _touch(law, motion.depth, motion.touch_speed, i, room.guess_rate[i] + room.opening_speed[i])


@compiled_apart
def complete_points(modal: Modal, around: AroundPoints | None, law: LawTable, motion: KernelState, room: Room) -> None:
    """Bring points around sections up to date that could not touch."""
    if around is not None:
        form_gaps_anew(modal, motion, room)
        if law.by_touch:
            touch_all(modal, law, motion, room)


@compiled
def _touch(law: LawTable, depth: Array, speed: Array, point: int, opening: float) -> None:
    """Keep the approach speed of a point whose gap opens at some speed, m/s, if it is open."""
    if depth[point] <= 0.0:
        speed[point] = -opening
        numbers = numbers_at(law, point)
        if numbers.touch_product > 0.0:
            law.coefficient[point] = touch_factor(numbers.touch_product, numbers.slowest_touch, speed[point])
