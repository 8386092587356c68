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
from gapbeam.solver.contact.solve.friction_equations import (
    EASY,
    HARDER,
    MOST_UPDATES,
    Missed,
    PressedPoints,
    Rubbing,
    made_of,
    set_equations,
)
from gapbeam.solver.march.compiled.contact_kernel import Balance, Solution, StepPoints, point_at
from gapbeam.solver.march.compiled.ordered_cholesky import eliminate
from gapbeam.solver.march.compiled.point_motions import AroundPoints, count_in_play, fill, in_play, inner_product, turns
from gapbeam.solver.march.compiled.rubbing_points import aim, nothing_rubs, opened_by, respond
from gapbeam.solver.system.operators import Array


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
    creep, before = ease * friction.slip_velocity, Missed(np.inf, np.inf)
    points = PressedPoints(balance.held, balance.weights, found.slope)
    for iteration in range(most + 1):
        respond(friction)
        _list_points(friction, around, balance, step, rubbed, velocity)
        missed, largest, steepest, deepest = _press(friction, balance, step, law, found)
        if not np.isfinite(missed):
            return -1 - iteration
        floor = ROUND_OFF * steepest * deepest
        count, before = set_equations(
            friction, points, balance.scale, rubbed, weight, creep, missed, largest, floor, before
        )
        if count < 0:
            return iteration
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
