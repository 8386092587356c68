"""How a disturbance of the state at the start grows over midpoint steps with contact, compiled.

    A dvm = (2/dt) dv0 - s dq0 + Phi^T df,    df = -w (P_0 Phi dq0 + P_1 Phi dq1),
    dq1 = dq0 + dt dvm,    dv1 = 2 dvm - dv0

for all 2n directions at once: (q, v) at a time by (q, v) at the start. P_0 and P_1 are the slopes of the pressure of a
step in the penetrations at its start and its end; only points where one of them is not zero take part.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.compiled.jit import compiled
from solver.compiled.kernel import DONE, FAILED, FRESH_GAPS
from solver.compiled.loops import add_rows, fill
from solver.compiled.ordered_cholesky import OrderedFactor, empty_factor, solve_columns_with, update_factor
from solver.compiled.point_law import IMPLICIT, MEAN, LawTable, Point, StepNumbers, damping, stage_pressure
from solver.compiled.schemes import accept, form_gaps_anew, midpoint_step
from solver.compiled.tables import Modal, Motion, Room, Scheme
from solver.operators import Array, Indices


class Tangent(NamedTuple):
    """The derivatives by the state at the start, and room.

    Attributes:
        place: dq, (n, 2n).
        speed: dv, (n, 2n).
        middle: dvm, (n, 2n).
        mixed: What the gaps of most points are formed with, (n, 2n).
        forces: df of the points that take part, (m, 2n); first those of the factor, in its order.
        points: These points, (m,).
        before: w P_0, (m,).
        after: w P_1, (m,).
        compliance: 1 / (w P_1), 0 where that is 0, (m,).
        column: Room for a column, (max(m, n),).
        factor: Factor of dt D + diag(compliance).
    """

    place: Array
    speed: Array
    middle: Array
    mixed: Array
    forces: Array
    points: Indices
    before: Array
    after: Array
    compliance: Array
    column: Array
    factor: OrderedFactor


def unit_tangent(n: int, m: int) -> Tangent:
    """Return the derivatives at the start itself, for n DOFs and m contact points."""
    return Tangent(
        place=np.eye(n, 2 * n),
        speed=np.eye(n, 2 * n, n),
        middle=np.zeros((n, 2 * n)),
        mixed=np.zeros((n, 2 * n)),
        forces=np.zeros((m, 2 * n)),
        points=np.zeros(m, dtype=np.int64),
        before=np.zeros(m),
        after=np.zeros(m),
        compliance=np.zeros(m),
        column=np.zeros(max(m, n)),
        factor=empty_factor(m),
    )


@compiled
def march_with_tangent(
    modal: Modal, scheme: Scheme, law: LawTable, motion: Motion, room: Room, tangent: Tangent, factors: Array,
    first: int, most: int,
) -> tuple[int, int]:  # fmt: skip
    """March as many midpoint steps as there are rows of load factors, with the derivatives; see `march_steps`.

    Returns:
        DONE or FAILED (that step is not taken), and the steps taken.
    """
    for step in range(len(factors)):
        if midpoint_step(modal, scheme, law, motion, room, factors[step], most) < 0:
            return FAILED, step
        if not move_tangent(modal, scheme, law, motion.depth, room.solution.depth, tangent):
            return FAILED, step
        accept(modal, scheme, motion, room)
        if (first + step + 1) % FRESH_GAPS == 0:
            form_gaps_anew(modal, motion)
    return DONE, len(factors)


@compiled
def move_tangent(modal: Modal, scheme: Scheme, law: LawTable, old: Array, new: Array, tangent: Tangent) -> bool:
    """Take the derivatives over a step between penetrations; tell whether that worked.

    The forces that take part solve  (1 / (w P_1) + dt D) df = -(P_0 / P_1 + 1) Phi dq0 - dt Phi A^-1 (...), in which
    P_0 = P_1 for points that stay closed under a linear law, and P_0 = 0 without damping in the implicit scheme.
    """
    dt, n = scheme.dt, len(modal.squares)
    place, speed, middle, mixed = tangent.place, tangent.speed, tangent.middle, tangent.mixed
    usual = 1.0 if scheme.form == MEAN else 0.0  # P_0 / P_1 of most points
    for j in range(n):
        inverse, square = modal.inverse[j], modal.squares[j]
        for k in range(2 * n):
            middle[j, k] = inverse * ((2.0 / dt) * speed[j, k] - square * place[j, k])
            mixed[j, k] = (1.0 + usual) * place[j, k] + dt * middle[j, k]
    touched = _linearize(modal, scheme, law, old, new, tangent)
    if touched:
        if not update_factor(tangent.factor, modal.delassus, dt, tangent.compliance):
            return False
        count = _solve_forces(modal, dt, usual, tangent)
        for j in range(n):
            for row in range(count):
                tangent.column[row] = modal.gaps[tangent.points[row], j]
            add_rows(tangent.forces, tangent.column[:count], modal.inverse[j], middle[j])
    for j in range(n):
        for k in range(2 * n):
            place[j, k] += dt * middle[j, k]
            speed[j, k] = 2.0 * middle[j, k] - speed[j, k]
    return True


@compiled
def _linearize(modal: Modal, scheme: Scheme, law: LawTable, old: Array, new: Array, tangent: Tangent) -> bool:
    """Set the slopes of the step by the penetrations; tell whether any point takes part."""
    dt, numbers, touched = scheme.dt, law.numbers, False
    for i in range(len(old)):
        tangent.before[i], tangent.after[i], tangent.compliance[i] = 0.0, 0.0, 0.0
        if old[i] <= 0.0 and new[i] <= 0.0:
            continue
        stiffness, coefficient, weight = law.stiffness[i], law.coefficient[i], modal.weights[i]
        point = Point(stiffness, coefficient, old[i], 0.0, 0.0, 0.0)
        pressure, after, _ = stage_pressure(StepNumbers(scheme.form, dt, 0.0, 0.0), numbers, point, new[i])
        before = 0.0
        if scheme.form == IMPLICIT:
            if pressure > 0.0 or numbers.adhesive:
                before = -damping(numbers, stiffness, coefficient, old[i])[0] / dt
        else:  # the discrete gradient of the step reversed in time is the same
            turned = Point(stiffness, coefficient, new[i], 0.0, 0.0, 0.0)
            before = stage_pressure(StepNumbers(MEAN, -dt, 0.0, 0.0), numbers, turned, old[i])[1]
        tangent.before[i], tangent.after[i] = weight * before, weight * after
        if after > 0.0:
            tangent.compliance[i] = 1.0 / (weight * after)
        if before != 0.0 or after > 0.0:
            touched = True
    return touched


@compiled
def _solve_forces(modal: Modal, dt: float, usual: float, tangent: Tangent) -> int:
    """Solve for the forces of the points that take part; return their number."""
    forces, points, factor = tangent.forces, tangent.points, tangent.factor
    solved: int = factor.filled[0]
    count = solved
    for i in range(len(tangent.before)):
        if tangent.before[i] != 0.0 and tangent.compliance[i] == 0.0:
            points[count] = i
            fill(forces[count], 0.0)
            add_rows(tangent.place, modal.gaps[i], -tangent.before[i], forces[count])
            count += 1
    for row in range(solved):
        i = factor.order[row]
        points[row] = i
        fill(forces[row], 0.0)
        add_rows(tangent.mixed, modal.gaps[i], -1.0, forces[row])
        more = tangent.before[i] * tangent.compliance[i] - usual
        if more != 0.0:
            add_rows(tangent.place, modal.gaps[i], -more, forces[row])
        for known in range(solved, count):
            tangent.column[known - solved] = modal.delassus[i, points[known]]
        add_rows(forces[solved:count], tangent.column[: count - solved], -dt, forces[row])
    solve_columns_with(factor, forces, tangent.column)
    return count
