"""Contact with friction in a compiled step: forces along and across the faces by one Newton iteration.

The equations are those of `solve.friction_equations`. Where friction that hardly slides keeps the iteration in a
cycle, the step is solved with a large v0 first, which then falls to what was given.

Only points that touch, or that the forces would press on, have equations.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.compilation.jit import compiled, compiled_apart
from gapbeam.solver.contact.laws.point_law import LawTable, numbers_at, stage_pressure
from gapbeam.solver.contact.solve.contact_solve import ROUND_OFF
from gapbeam.solver.contact.solve.elimination import eliminate
from gapbeam.solver.contact.solve.friction_equations import (
    EASY,
    HARDER,
    MOST_UPDATES,
    Missed,
    PressedPoints,
    Rubbing,
    SlipStep,
    law_of_slip,
    linearize,
    made_of,
    order_forces,
)
from gapbeam.solver.contact.solve.section_solve import WORTH, find_motions, use, use_none
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at
from gapbeam.solver.march.compiled.point_motions import AroundPoints, count_in_play, fill, in_play, inner_product, turns
from gapbeam.solver.march.compiled.rubbing_points import aim, nothing_rubs, opened_by, respond
from gapbeam.solver.system.operators import Array


@compiled
def solve_with_friction(
    friction: Rubbing, around: AroundPoints | None, balance: Balance, step: StepPoints, law: LawTable, rubbed: Array,
    velocity: Array, weight: float, found: Solution, most: int, again: bool,
) -> int:  # fmt: skip
    """Solve contact and friction of a step along given directions; return the iterations, -1 where that fails.

    Args:
        friction: Friction, changed in place.
        around: Points around rigid sections; None: others.
        balance: The linear side.
        step: Input of the law.
        law: The contact law.
        rubbed: Memory of the points at the start of the step, see `KernelState`.
        velocity: Velocity in the balance while the forces stay, (n,).
        weight: c, what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
        found: The solution.
        most: Limit of the iterations.
        again: Whether the points have turned since the solution that `friction` has.
    """
    if not again:
        nothing_rubs(friction)
        fill(friction.free, np.nan)
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
                for term in range(friction.table.terms):
                    used = friction.parts[row + 1 + a, term]
                    if np.isnan(friction.free[used]):
                        friction.free[used] = inner_product(friction.rows[used], velocity)


@compiled_apart
def _iterate(
    friction: Rubbing, around: AroundPoints | None,
    arguments: tuple[Balance, StepPoints, LawTable, Array, Array, float], ease: float, found: Solution, most: int,
) -> int:  # fmt: skip
    """Solve from the forces in `friction` with v0 multiplied by `ease`; return the iterations, below 0: it failed."""
    balance, step, law, rubbed, velocity, weight = arguments
    creep, before = ease * friction.slip_velocity, Missed(np.inf, np.inf)
    points = PressedPoints(balance.held, balance.weights, found.slope)
    for iteration in range(most + 1):
        respond(friction)
        _list_points(friction, around, balance, step, rubbed, velocity)
        missed, largest, steepest, deepest = _press(friction, balance, step, law, found)
        if not np.isfinite(missed):
            return -1 - iteration
        floor = ROUND_OFF * steepest * deepest
        count, before, limit = order_forces(friction, points, rubbed, weight, creep, missed, largest, floor, before)
        if count < 0:
            return iteration
        if not _change(friction, SlipStep(points, balance.scale, rubbed, weight, creep, limit), count):
            return -1 - iteration
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
def _change(friction: Rubbing, slip: SlipStep, count: int) -> bool:
    """Change the ordered forces by the linearized laws; return whether that is possible."""
    if _share_motions(friction, count):
        _add_laws(friction, slip, count)
        if not find_motions(friction.shared, friction.compliance, slip.scale):
            return False
        _follow_motions(friction, slip, count)
    else:
        linearize(friction, slip, count)
        if not eliminate(friction.matrix, friction.right, count):
            return False
    for row in range(count):
        friction.forces[friction.order[row]] += friction.right[row]
    return True


@compiled
def _share_motions(friction: Rubbing, count: int) -> bool:
    """Return whether so many ordered forces are many beside the motions that they act on, which are listed."""
    shared = friction.shared
    if friction.table.terms == 1:
        return False
    use_none(shared)
    for row in range(count):
        force = friction.order[row]
        for term in range(friction.table.terms):
            if friction.share[force, term] != 0.0:
                use(shared, friction.parts[force, term])
    few: bool = WORTH * shared.number[0] <= count
    return few


@compiled
def _add_laws(friction: Rubbing, slip: SlipStep, count: int) -> None:
    """Add up the effects of the laws of all ordered forces on the motions, and set the forces of still motions."""
    along, row = friction.on_face.shape[1], 0
    pressed, at_once = False, 0.0
    while row < count:
        force = friction.order[row]
        point = friction.points[force // (1 + along)]
        if force % (1 + along) == 0:
            pressed, at_once = True, -friction.missed[force]
            friction.right[row] = at_once
            _add(friction, force, force, slip.points.weights[point] * slip.points.slope[point], at_once)
            row += 1
            continue
        pressed = pressed and row > 0 and friction.order[row - 1] == force - 1
        share = slip.points.weights[point] * slip.points.slope[point] if pressed else 0.0
        mu_one, mu_two, xx, yy, xy, _ = law_of_slip(friction, slip, force)
        for a in range(along):
            pull, own = (mu_one, xx) if a == 0 else (mu_two, yy)
            friction.right[row + a] = -friction.missed[force + a] - (pull * at_once if pressed else 0.0)
            _add(friction, force + a, force + a, own, friction.right[row + a])
            if along == 2:
                _add(friction, force + a, force + 1 - a, xy, 0.0)
            if share > 0.0:
                _add(friction, force + a, force - 1, -pull * share, 0.0)
        row += along


@compiled
def _add(friction: Rubbing, force: int, other: int, stiffness: float, known: float) -> None:
    """Add a force that resists the motion along another, and its known part."""
    shared = friction.shared
    for a in range(friction.table.terms):
        one = friction.share[force, a]
        if one != 0.0:
            place = shared.place[friction.parts[force, a]]
            shared.known[place] += one * known
            for b in range(friction.table.terms):
                two = friction.share[other, b]
                if two != 0.0 and stiffness != 0.0:
                    shared.effect[place, shared.place[friction.parts[other, b]]] += one * stiffness * two


@compiled
def _follow_motions(friction: Rubbing, slip: SlipStep, count: int) -> None:
    """Bring the forces of still motions to those of the motions that were found."""
    along, row, changed = friction.on_face.shape[1], 0, 0.0
    while row < count:
        force = friction.order[row]
        point = friction.points[force // (1 + along)]
        if force % (1 + along) == 0:
            changed = -slip.points.weights[point] * slip.points.slope[point] * _found_along(friction, force)
            friction.right[row] += changed
            row += 1
            continue
        if not (row > 0 and friction.order[row - 1] == force - 1):
            changed = 0.0
        mu_one, mu_two, xx, yy, xy, _ = law_of_slip(friction, slip, force)
        first = _found_along(friction, force)
        second = _found_along(friction, force + 1) if along == 2 else 0.0
        friction.right[row] -= mu_one * changed + xx * first + xy * second
        if along == 2:
            friction.right[row + 1] -= mu_two * changed + xy * first + yy * second
        row += along


@compiled
def _found_along(friction: Rubbing, force: int) -> float:
    """Return the motion along a force that was found."""
    total = 0.0
    for term in range(friction.table.terms):
        if friction.share[force, term] != 0.0:
            place = friction.shared.place[friction.parts[force, term]]
            total += friction.share[force, term] * friction.shared.moved[place]
    return total
