"""Contact problem of a step of any scheme, and the state of the points at its end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, touch_factor
from gapbeam.solver.jit import compiled, compiled_apart
from gapbeam.solver.march.compiled.around_points import AroundPoints
from gapbeam.solver.march.compiled.array_loops import copy_into, fill
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, solve_contact
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Modal, Room
from gapbeam.solver.march.compiled.near_points import begin_near, choose_near, depth_at, stay_in_bounds
from gapbeam.solver.march.compiled.point_motions import (
    count_in_play,
    in_play,
    moved_by,
    set_motions,
    set_place,
    turns,
)
from gapbeam.solver.march.compiled.turning_forces import aim_with_old_forces, turn_with_forces
from gapbeam.solver.march.compiled.turning_points import END, START, aim, hole_growth, set_far
from gapbeam.solver.march.python.turning_step import MOST_TURNS, settled
from gapbeam.solver.system.operators import Array


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


@compiled_apart
def solve_points(
    around: AroundPoints | None, initial_gap: Array, balance: Balance, step: StepPoints, law: LawTable, touch: Touch,
    found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve the contact problem of a step; return the iterations, or -1 where that fails."""
    everything, total, turn, before = False, 0, 0, np.inf
    while True:
        if turn == 0:
            _look_around(around, initial_gap, step, found, everything)
            if count_in_play(around, len(initial_gap)) == 0:
                return total
            aim(around, found, True)
            aim_with_old_forces(around, balance, step, found)
            _hold_points(around, initial_gap, balance.held_depth, step, law, touch)
        else:
            _hold_turned(around, balance.held_depth, step, len(initial_gap))
        iterations = solve_contact(balance, step, law, found, most, turn > 0)
        if iterations < 0:
            return iterations
        total += iterations
        if not stay_in_bounds(balance.delassus, around, found.change, balance.scale):
            everything, turn = True, 0
            continue
        left = aim(around, found, False)
        if settled(left, before):
            return total
        if turn == MOST_TURNS:
            return -1
        before, turn = left, turn + 1
        total += turn_with_forces(around, balance, step, law, found, left)


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

    Walls around sections that share their motions stand still, but for round holes (`wall_kernels.move_walls`).
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
    """Keep the approach speeds of all open points, and what the damper makes of them."""
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
