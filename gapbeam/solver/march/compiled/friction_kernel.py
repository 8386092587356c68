"""Contact with friction in a compiled step: forces along and across the faces by one Newton iteration.

    d = d_held - s G A^-1 (H^T (f - f_held) + T^T h),    f = w P(d)
    v = v_free + c T A^-1 (H^T (f - f_held) + T^T h),    h = -mu <f> v / sqrt(|v|^2 + v0^2)

The linearized laws are those of `solve.friction_solve`. Where friction that hardly slides keeps the iteration in a
cycle, the step is solved with a large v0 first, which then falls to what was given.

Only points that touch, or that the forces would press on, have equations.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from gapbeam.solver.compilation.jit import compiled, compiled_apart
from gapbeam.solver.contact.laws.damper import NOTHING
from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, stage_pressure
from gapbeam.solver.contact.solve.contact_solve import RELATIVE_TOLERANCE, ROUND_OFF
from gapbeam.solver.contact.solve.friction_solve import ENOUGH
from gapbeam.solver.contact.solve.slip_solve import FLATTEST, NEGLIGIBLE
from gapbeam.solver.contact.solve.slip_solve import ROUND_OFF as ROUND_OFF_OF_SLIP
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at
from gapbeam.solver.march.compiled.ordered_cholesky import eliminate
from gapbeam.solver.march.compiled.point_motions import AroundPoints, count_in_play, fill, in_play, inner_product, turns
from gapbeam.solver.march.compiled.rubbing_points import (
    Rubbing,
    aim,
    coefficient_at,
    coupling,
    made_of,
    nothing_rubs,
    opened_by,
    respond,
)
from gapbeam.solver.system.operators import Array

MOST_UPDATES = 25
EASY, HARDER = 2.0**20, 0.25  # v0 at first over the v0 of the law, and the factor by which it changes


@compiled
def _slip(friction: Rubbing, row: int, weight: float) -> float:
    """Return the slip velocity of a listed point along a direction, m/s."""
    return made_of(friction, row, friction.free) + weight * made_of(friction, row, friction.moved)


@compiled_apart
def solve_with_friction(
    friction: Rubbing, around: AroundPoints | None, balance: Balance, step: StepPoints, law: LawTable, rubbed: Array,
    velocity: Array, weight: float, found: Solution, most: int, again: bool,
) -> int:  # fmt: skip
    """Solve contact and friction of a step along given directions; return the iterations, -1 where that fails.

    Args:
        friction: Changed in place.
        around: Points around rigid sections; None: others.
        balance: The linear side.
        step: What the law is given.
        law: The contact law.
        rubbed: Memory of the points at the start of the step, see `KernelState`.
        velocity: Of the balance while the forces stay, (n,).
        weight: c, what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
        found: The solution.
        most: Limit of the iterations.
        again: Whether the points have turned since the solution that `friction` has.
    """
    if not again:
        nothing_rubs(friction)
    for number in range(friction.chosen[0]):
        aim(friction, around, number)
    _list_points(friction, around, balance, step, rubbed, velocity)
    along = friction.on_face.shape[1]
    arguments = (balance, step, law, rubbed, velocity, weight)
    iterations = _iterate(friction, around, arguments, 1.0, found, min(most, MOST_UPDATES))
    spent, ease = abs(iterations), EASY
    if iterations < 0:
        fill(friction.forces, 0.0)
        while iterations < 0 or ease >= 1.0:
            iterations = _iterate(friction, around, arguments, ease, found, most)
            if iterations < 0:
                return -1
            spent, ease = spent + iterations, ease * HARDER
    for number in range(count_in_play(around, len(balance.held))):
        i = in_play(around, number)
        if friction.listed[i] == 0.0:
            found.depth[i] = balance.held_depth[i] - balance.scale * opened_by(friction, around, i)
            found.change[i], found.pressure[i], found.elastic[i] = 0.0, 0.0, 0.0
    for number in range(friction.chosen[0]):
        found.change[friction.points[number]] = friction.forces[number * (1 + along)]
    return spent


@compiled
def _list_points(
    friction: Rubbing, around: AroundPoints | None, balance: Balance, step: StepPoints, rubbed: Array, velocity: Array
) -> None:
    """List further points: under pressure, in contact before the step, or where the forces so far lead into contact."""
    along = friction.on_face.shape[1]
    for number in range(count_in_play(around, len(balance.held))):
        i = in_play(around, number)
        if friction.listed[i] > 0.0:
            continue
        known = balance.held[i] != 0.0 or step.old_depth[i] > 0.0 or step.old_pressure[i] != 0.0
        if known or balance.held_depth[i] - balance.scale * opened_by(friction, around, i) > 0.0:
            place = friction.chosen[0]
            friction.points[place], friction.listed[i], friction.chosen[0] = i, 1.0, place + 1
            aim(friction, around, place)
            row = place * (1 + along)
            friction.forces[row] = balance.weights[i] * step.old_pressure[i] if turns(around, i) else 0.0
            for a in range(along):
                friction.forces[row + 1 + a] = balance.weights[i] * rubbed[i, a]
                for term in range(friction.terms):
                    used = friction.parts[row + 1 + a, term]
                    friction.free[used] = inner_product(friction.rows[used], velocity)


@compiled_apart
def _iterate(
    friction: Rubbing, around: AroundPoints | None,
    arguments: tuple[Balance, StepPoints, LawTable, Array, Array, float], ease: float, found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve from the forces in `friction` with v0 multiplied by `ease`; return the iterations, below 0: it failed."""
    balance, step, law, rubbed, velocity, weight = arguments
    creep, before, before_slip = ease * friction.slip_velocity, np.inf, np.inf
    for iteration in range(most + 1):
        respond(friction)
        _list_points(friction, around, balance, step, rubbed, velocity)
        missed, largest, steepest, deepest = _press(friction, balance, step, law, found)
        if not np.isfinite(missed):
            return -1 - iteration
        missed_slip, limit, fastest, count = _rub(friction, balance, rubbed, weight, creep, found)
        if missed <= ENOUGH * largest and missed_slip <= ENOUGH * limit:
            return iteration
        floor = max(RELATIVE_TOLERANCE * largest, ROUND_OFF * steepest * deepest)
        floor_of_slip = limit * max(RELATIVE_TOLERANCE, ROUND_OFF_OF_SLIP * fastest / creep)
        stalled = missed >= 0.5 * before or missed_slip >= 0.5 * before_slip
        if stalled and missed <= floor and missed_slip <= floor_of_slip:
            return iteration
        before, before_slip = missed, missed_slip
        _linearize(friction, balance, rubbed, weight, creep, found, count, limit)
        if not eliminate(friction.matrix, friction.right, count):
            return -1 - iteration
        for row in range(count):
            friction.forces[friction.order[row]] += friction.right[row]
    return -1 - most


@compiled
def _press(
    friction: Rubbing, balance: Balance, step: StepPoints, law: LawTable, found: Solution
) -> tuple[float, float, float, float]:
    """Evaluate the contact law of listed points.

    Return how far it is missed, N, the largest force, N, stiffness, N/m, and penetration under the forces held, m.
    """
    missed, largest, steepest, deepest, total = 0.0, 0.0, 0.0, 0.0, 0.0
    for number in range(friction.chosen[0]):
        i, row = friction.points[number], number * (1 + friction.on_face.shape[1])
        depth = balance.held_depth[i] - balance.scale * made_of(friction, row, friction.moved)
        force = balance.held[i] + friction.forces[row]
        pressure, slope, elastic = stage_pressure(step.numbers, numbers_at(law, i), point_at(step, law, i), depth)
        found.depth[i], found.pressure[i], found.slope[i], found.elastic[i] = depth, pressure, slope, elastic
        friction.missed[row] = force - balance.weights[i] * pressure
        missed, largest = max(missed, abs(friction.missed[row])), max(largest, abs(force))
        steepest, total = max(steepest, balance.weights[i] * slope), total + abs(friction.missed[row])
        deepest = max(deepest, abs(balance.held_depth[i]))
    return (missed if np.isfinite(total) else np.nan), largest, steepest, deepest


@compiled
def _rub(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, found: Solution
) -> tuple[float, float, float, int]:
    """Evaluate the law of friction, and order the forces to solve for.

    Return how far it is missed, N, the largest limit of a force, N, the largest free slip, m/s, and their number.
    """
    missed, largest, fastest, count = 0.0, 0.0, 0.0, 0
    along = friction.on_face.shape[1]
    for number in range(friction.chosen[0]):
        i, row = friction.points[number], number * (1 + along)
        force = balance.held[i] + friction.forces[row]
        bound = coefficient_at(friction, rubbed, i) * force if force > NOTHING else 0.0
        square, held = creep * creep, 0.0
        for a in range(1, 1 + along):
            slip = _slip(friction, row + a, weight)
            friction.missed[row + a] = slip  # until all of them are known
            square += slip * slip
            held += abs(friction.forces[row + a])
            fastest = max(fastest, abs(made_of(friction, row + a, friction.free)) if bound > 0.0 else 0.0)
        largest = max(largest, bound)
        for a in range(1, 1 + along):
            friction.missed[row + a] = friction.forces[row + a] + bound * friction.missed[row + a] / sqrt(square)
            missed = max(missed, abs(friction.missed[row + a]))
        if found.slope[i] > 0.0 or friction.missed[row] != 0.0:
            friction.order[count] = row
            count += 1
        if bound > 0.0 or held > 0.0:
            for a in range(1, 1 + along):
                friction.order[count] = row + a
                count += 1
    return missed, largest, fastest, count


@compiled
def _linearize(
    friction: Rubbing, balance: Balance, rubbed: Array, weight: float, creep: float, found: Solution, count: int,
    limit: float,
) -> None:  # fmt: skip
    """Set the equations of the ordered forces; all rows are gaps, m, those of slip over c / s."""
    scale, along, row = balance.scale, friction.on_face.shape[1], 0
    while row < count:
        force = friction.order[row]
        point = friction.points[force // (1 + along)]
        if force % (1 + along) == 0:
            stiffness = balance.weights[point] * found.slope[point]
            _set_row(friction, scale, row, count, stiffness > 0.0)
            softness = 1.0 / stiffness if stiffness > 0.0 else scale * coupling(friction, force, force)
            friction.matrix[row, row] += softness
            friction.right[row] = -softness * friction.missed[force]
            row += 1
        else:
            mu, normal = coefficient_at(friction, rubbed, point), balance.held[point] + friction.forces[force - 1]
            _set_rows_of_slip(friction, scale, mu, normal, weight, creep, row, count, limit)
            row += along


@compiled
def _set_row(friction: Rubbing, scale: float, row: int, count: int, coupled: bool) -> None:
    """Set a row to what the ordered forces do to its motion; to 0 where its force is known."""
    for column in range(count):
        entry = scale * coupling(friction, friction.order[row], friction.order[column]) if coupled else 0.0
        friction.matrix[row, column] = entry


@compiled
def _set_rows_of_slip(
    friction: Rubbing, scale: float, mu: float, normal: float, weight: float, creep: float, row: int, count: int,
    limit: float,
) -> None:  # fmt: skip
    """Set the rows of a point that rubs: (b J)^-1 (dh + phi mu df) + c T A^-1 (...) = -(b J)^-1 q, over c / s."""
    matrix, right, along, first = friction.matrix, friction.right, friction.on_face.shape[1], friction.order[row]
    bound = mu * normal if normal > NOTHING else 0.0
    rubs = bound > NEGLIGIBLE * limit
    for a in range(along):
        _set_row(friction, scale, row + a, count, rubs)
        if not rubs:
            own = scale * coupling(friction, first + a, first + a)
            matrix[row + a, row + a], right[row + a] = own, -own * friction.missed[first + a]
    if rubs:
        square, length = creep * creep, 0.0
        for a in range(along):
            slip = _slip(friction, first + a, weight)
            square += slip * slip
            length += friction.forces[first + a] * friction.forces[first + a]
        speed, within = sqrt(square), bound / max(sqrt(length), bound)
        one = _slip(friction, first, weight) / speed
        pulled = -within * friction.forces[first] / bound
        xx, yy, xy, two = 1.0 + FLATTEST - pulled * one, 1.0, 0.0, 0.0
        if along == 2:
            two = _slip(friction, first + 1, weight) / speed
            across = -within * friction.forces[first + 1] / bound
            yy, xy = 1.0 + FLATTEST - across * two, -0.5 * (pulled * two + across * one)
        inverse = scale / weight * speed / bound / (xx * yy - xy * xy)
        column = row - 1 if row > 0 and friction.order[row - 1] == first - 1 else -1
        for a in range(along):
            for b in range(along):
                part = inverse * ((yy if a == 0 else xx) if a == b else -xy)
                matrix[row + a, row + b] += part
                if column >= 0:
                    matrix[row + a, column] += part * mu * (one if b == 0 else two)
                right[row + a] = (right[row + a] if b > 0 else 0.0) - part * friction.missed[first + b]
