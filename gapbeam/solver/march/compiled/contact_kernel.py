"""The contact problem of a step, `solve.contact_solve`, compiled for symmetric Delassus operators.

The same iteration with the same tolerances: semi-smooth Newton in force form for the change of the forces, with an
exact line search after a few iterations. What it cannot solve (no convergence, a block that is singular to round-off)
is left to the original, which also softens and halves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled, compiled_apart
from gapbeam.solver.contact.laws.point_law import LawTable, Point, StepNumbers, numbers_at, stage_pressure
from gapbeam.solver.contact.solve.contact_solve import (
    EPSILON,
    FULL_STEPS,
    NOTHING,
    RELATIVE_TOLERANCE,
    ROUND_OFF,
    SETTLED,
)
from gapbeam.solver.contact.solve.section_solve import WORTH, find_motions, use, use_none
from gapbeam.solver.march.compiled.ordered_cholesky import OrderedFactor, empty_factor, solve_with, update_factor
from gapbeam.solver.march.compiled.point_motions import AroundPoints, add_responses, count_in_play, in_play
from gapbeam.solver.system.operators import Array

BISECTIONS = 60
UNTRIED, SOLVED, SINGULAR = 0, 1, 2


class Balance(NamedTuple):
    """The linear side of the contact problem, d = d_held - s D (f - f_held).

    Attributes:
        scale: s.
        delassus: D, (m, m); of the rows of R where points share them, (k, k).
        around: The points around rigid sections; None: others.
        largest: Largest entry of the diagonal of D, m/N.
        weights: w, (m,), m^2.
        held_depth: d_held, (m,), m.
        held: f_held, (m,), N.
    """

    scale: float
    delassus: Array
    around: AroundPoints | None
    largest: float
    weights: Array
    held_depth: Array
    held: Array


class StepPoints(NamedTuple):
    """Form of the law in the step, and the points at its start; see `Point`."""

    numbers: StepNumbers
    old_depth: Array
    old_pressure: Array
    guess_depth: Array
    guess_rate: Array


class Solution(NamedTuple):
    """Solution of a contact problem, and work space; all (m,).

    Attributes:
        change: f - f_held, N.
        depth: Penetration, m.
        pressure: The law there, Pa.
        slope: Its slope, Pa/m.
        elastic: Its elastic part, Pa.
        newton: The change that the linearized law asks for, N.
        update: Its difference from the change, N.
        deeper: Change of the penetration by this update, m.
        compliance: 1 / (w kappa) of active points, else 0, m/N.
        target: Right side in the order of the factor.
        factor: Factor of the active block.
    """

    change: Array
    depth: Array
    pressure: Array
    slope: Array
    elastic: Array
    newton: Array
    update: Array
    deeper: Array
    compliance: Array
    target: Array
    factor: OrderedFactor


def room_for_solution(size: int) -> Solution:
    """Return room for the solution at m = `size` points."""
    return Solution._make([*np.zeros((10, size)), empty_factor(size)])


@compiled
def point_at(step: StepPoints, law: LawTable, point: int) -> Point:
    """Return a contact point in a step."""
    return Point(
        law.stiffness[point],
        law.coefficient[point],
        step.old_depth[point],
        step.old_pressure[point],
        step.guess_depth[point],
        step.guess_rate[point],
        law.yielding[point, 0],
        law.yielding[point, 1],
    )


@compiled
def solve_contact(
    balance: Balance, step: StepPoints, law: LawTable, found: Solution, most: int, again: bool = False
) -> int:
    """Solve the contact problem of a step into `found`; return the iterations, or -1 where that fails.

    `again`: from the change that `found` has, of the same points in other directions.
    """
    around, size = balance.around, len(balance.held)
    largest_depth, largest_held = 0.0, 0.0
    for number in range(count_in_play(around, size)):
        i = in_play(around, number)
        largest_depth = max(largest_depth, abs(balance.held_depth[i]))
        largest_held = max(largest_held, abs(balance.held[i]) / balance.weights[i])
        found.change[i] = found.change[i] if again else 0.0
        found.depth[i] = balance.held_depth[i]
    if again:
        add_responses(balance.delassus, around, found.change, -balance.scale, found.depth)
    least = max(NOTHING, EPSILON * largest_held)
    before = np.inf
    for iteration in range(most + 1):
        residual, highest, steepest, moved = _evaluate(balance, step, law, found)
        if not np.isfinite(residual):
            return -1
        if residual <= max(RELATIVE_TOLERANCE * highest, least):
            return iteration
        floor = ROUND_OFF * steepest * max(largest_depth, balance.scale * balance.largest * moved)
        stalled = residual >= 0.5 * before
        before = residual
        if not _newton_change(balance, found):
            return -1
        largest_update, largest_force = 0.0, 0.0
        for number in range(count_in_play(around, size)):
            i = in_play(around, number)
            found.update[i] = found.newton[i] - found.change[i]
            largest_update = max(largest_update, abs(found.update[i]))
            largest_force = max(largest_force, abs(balance.held[i] + found.change[i]))
        # a nearly rigid law turns round-off in depths into pressures, but the forces no longer move
        if stalled and residual <= floor and largest_update <= SETTLED * largest_force:
            return iteration
        length = 1.0
        if iteration >= FULL_STEPS:
            _set_response(balance, found.update, found.deeper)
            length = _exact_step(balance, step, law, found)
        if length < 1.0:
            for number in range(count_in_play(around, size)):
                i = in_play(around, number)
                found.change[i] += length * found.update[i]
                found.depth[i] += length * found.deeper[i]
        else:
            for number in range(count_in_play(around, size)):
                i = in_play(around, number)
                found.change[i], found.depth[i] = found.newton[i], balance.held_depth[i]
            add_responses(balance.delassus, around, found.change, -balance.scale, found.depth)
    return -1


@compiled
def _set_response(balance: Balance, change: Array, depth: Array) -> None:
    """Set penetrations to -s D f."""
    for number in range(count_in_play(balance.around, len(depth))):
        i = in_play(balance.around, number)
        depth[i] = 0.0
    add_responses(balance.delassus, balance.around, change, -balance.scale, depth)


@compiled
def _evaluate(balance: Balance, step: StepPoints, law: LawTable, found: Solution) -> tuple[float, float, float, float]:
    """Evaluate the law; return how far it is missed, the largest pressure and slope, and the sum of |f - f_held|."""
    residual, highest, steepest, moved, total = 0.0, 0.0, 0.0, 0.0, 0.0
    held, change, weights, depths = balance.held, found.change, balance.weights, found.depth
    pressures, slopes, elastics, old_depth = found.pressure, found.slope, found.elastic, step.old_depth
    for number in range(count_in_play(balance.around, len(held))):
        i = in_play(balance.around, number)
        if depths[i] <= 0.0 and old_depth[i] <= 0.0 and held[i] == 0.0 and change[i] == 0.0:
            pressures[i], slopes[i], elastics[i] = 0.0, 0.0, 0.0
            continue
        pressure, slope, elastic = stage_pressure(step.numbers, numbers_at(law, i), point_at(step, law, i), depths[i])
        pressures[i], slopes[i], elastics[i] = pressure, slope, elastic
        missed = abs((held[i] + change[i]) / weights[i] - pressure)
        residual, total = max(residual, missed), total + missed
        highest, steepest = max(highest, abs(pressure)), max(steepest, slope)
        moved += abs(change[i])
    return (residual if np.isfinite(total) else np.nan), highest, steepest, moved


@compiled
def _newton_change(balance: Balance, found: Solution) -> bool:
    """Solve the linearized law with the balance for f - f_held into `found.newton`; tell whether it can be."""
    around, size, weights = balance.around, len(balance.held), balance.weights
    active, known = 0, False
    for number in range(count_in_play(around, size)):
        i = in_play(around, number)
        wanted = weights[i] * found.pressure[i] - balance.held[i]
        found.newton[i] = wanted
        found.compliance[i] = 0.0
        if found.slope[i] > 0.0:
            found.compliance[i] = 1.0 / (weights[i] * found.slope[i])
            found.update[i] = balance.held_depth[i] - found.depth[i] + found.compliance[i] * wanted
            found.newton[i] = 0.0
            active += 1
        elif wanted != 0.0:
            known = True
    if active == 0:
        return True
    solved = _by_sections(around, balance, found, active)
    if solved != UNTRIED:
        return solved == SOLVED
    if known:
        _set_response(balance, found.newton, found.deeper)
        for number in range(count_in_play(around, size)):
            i = in_play(around, number)
            found.update[i] += found.deeper[i]
    factor, order = found.factor, found.factor.order
    if not update_factor(factor, balance.delassus, around, balance.scale, found.compliance):
        return False
    for row in range(active):
        found.target[row] = found.update[order[row]]
    solve_with(factor, found.target)
    for row in range(active):
        found.newton[order[row]] = found.target[row]
    return True


@compiled
def _by_sections(around: AroundPoints | None, balance: Balance, found: Solution, active: int) -> int:
    """Solve as `_newton_change` for the motions of sections where so many active points are many beside these."""
    if around is None:
        return UNTRIED
    use_none(around.shared)
    for number in range(around.chosen[0]):
        i = around.near[number]
        if found.compliance[i] > 0.0 or found.newton[i] != 0.0:
            for a in range(2):
                use(around.shared, around.pairs[i, a])
    if WORTH * around.shared.number[0] > active:
        return UNTRIED
    return SOLVED if _newton_of_sections(balance, around, found) else SINGULAR


@compiled
def _newton_of_sections(balance: Balance, around: AroundPoints, found: Solution) -> bool:
    """Solve for the motions of sections: f = kappa (d - c . z) at active points, else known; tell whether it can be."""
    shared, direction = around.shared, around.directions
    for number in range(around.chosen[0]):
        i = around.near[number]
        stiffness = 1.0 / found.compliance[i] if found.compliance[i] > 0.0 else 0.0
        force = stiffness * found.update[i] if stiffness > 0.0 else found.newton[i]
        if force != 0.0 or stiffness > 0.0:
            for a in range(2):
                row = shared.place[around.pairs[i, a]]
                shared.known[row] += direction[i, a] * force
                for b in range(2):
                    column = shared.place[around.pairs[i, b]]
                    shared.effect[row, column] += stiffness * direction[i, a] * direction[i, b]
    if not find_motions(shared, balance.delassus, balance.scale):
        return False
    for number in range(around.chosen[0]):
        i = around.near[number]
        if found.compliance[i] > 0.0:
            moved = 0.0
            for a in range(2):
                moved += direction[i, a] * shared.moved[shared.place[around.pairs[i, a]]]
            found.newton[i] = (found.update[i] - moved) / found.compliance[i]
    return True


@compiled_apart
def _exact_step(balance: Balance, step: StepPoints, law: LawTable, found: Solution) -> float:
    """Return the length in (0, 1] that minimizes the step potential along the update, by bisection."""
    if _step_slope(balance, step, law, found, 1.0) <= 0.0 or _step_slope(balance, step, law, found, 0.0) >= 0.0:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if _step_slope(balance, step, law, found, middle) > 0.0:
            high = middle
        else:
            low = middle
    return high


@compiled
def _step_slope(balance: Balance, step: StepPoints, law: LawTable, found: Solution, length: float) -> float:
    total = 0.0
    for number in range(count_in_play(balance.around, len(balance.held))):
        i = in_play(balance.around, number)
        pressure = stage_pressure(
            step.numbers, numbers_at(law, i), point_at(step, law, i), found.depth[i] + length * found.deeper[i]
        )[0]
        force = balance.held[i] + found.change[i] + length * found.update[i]
        total -= found.deeper[i] * (force - balance.weights[i] * pressure)
    return total
