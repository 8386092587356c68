"""The monodromy matrix of midpoint steps in modal coordinates, by linearizing one step after the other.

A step takes  A vm = (2/dt) v0 - s q0 + f_ext + Phi^T (w p),  q1 = q0 + dt vm,  v1 = 2 vm - v0,  A = 2/dt + c + dt s/2,
with dashpots in A besides, p = P(d0, d1) and d = -(g0 + Phi q). Its derivative needs the penetrations only.

Stations in round holes turn their directions.

With the rows R of the stations and A, s as above, a disturbance (q0, v0) of a step leads to

    m = A^-1 (2/dt v0 - s q0 + R^T dF),    q1 = q0 + dt m,    v1 = 2 m - v0,    dF = T0 R q0 + T1 R q1

and of F = -N z / s, z = r0 + r1, s = |r0| + |r1|, e = r / |r|,

    T1 = -(N / s) 1 - (dN/dx1 - N / s) z e1^T / s,    T0 = -(N / s) 1 - (dN/dx0 - N / s) z e0^T / s

Points whose directions are fixed have T0 = -w P0 and T1 = -w P1.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.compilation.jit import allocating, allocating_entry
from gapbeam.solver.contact.laws.contact_law import ContactLaw, step_slopes
from gapbeam.solver.march.compiled.plan_arrays import inverse_updates
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array


def monodromy(modal: ModalSystem, law: ContactLaw, implicit: bool, dt: float, depths: Array) -> Array:
    """Return d(q1, v1) / d(q0, v0), (2n, 2n), over steps between given penetrations.

    Args:
        modal: The system.
        law: Its contact law.
        implicit: Whether the scheme takes the law at the end of the step, or its discrete gradient.
        dt: Step, s.
        depths: Penetrations at the start of the first step and at the end of each, (steps + 1, m), m.
    """
    weights = modal.system.contact.weights
    before, after = (weights * slope for slope in step_slopes(law, implicit, depths[:-1], depths[1:], dt))
    inverse: Array = np.asarray(1.0 / (2.0 / dt + modal.damping + 0.5 * dt * modal.squares))
    updates, factors = inverse_updates(inverse, modal.dashpots)
    gaps = np.ascontiguousarray(modal.gaps)
    return linearized_steps(modal.squares, inverse, updates, factors, gaps, before, after, dt)


@allocating_entry
def linearized_steps(
    squares: Array, inverse: Array, updates: Array, factors: Array, gaps: Array, before: Array, after: Array, dt: float
) -> Array:
    """Return the product of the derivatives of all steps, (2n, 2n).

    Args:
        squares: s, (n,), 1/s^2.
        inverse: 1 / A without dashpots, (n,), s.
        updates: Rows of its rank-one updates by dashpots, `gapbeam.solver.march.compiled.plan_arrays.inverse_updates`,
            (k, n).
        factors: Factors of these updates, (k,).
        gaps: Phi, (m, n).
        before: Derivatives of the point forces of each step by the penetrations at its start, (steps, m), N/m.
        after: Derivatives of the same forces by the penetrations at its end, (steps, m), N/m.
        dt: Step, s.
    """
    steps, n = len(before), len(squares)
    place, speed, middle = np.eye(n, 2 * n), np.zeros((n, 2 * n)), np.zeros((n, 2 * n))
    for row in range(n):
        speed[row, n + row] = 1.0
    for step in range(steps):
        for row in range(n):
            for column in range(2 * n):
                middle[row, column] = 2.0 / dt * speed[row, column] - squares[row] * place[row, column]
        _solve_columns(inverse, updates, factors, middle)
        active = np.flatnonzero((before[step] != 0.0) | (after[step] != 0.0))
        if len(active) > 0:
            phi = gaps[active]
            start, moved = phi @ place, phi @ middle
            compliance = np.ascontiguousarray(phi.T)
            _solve_columns(inverse, updates, factors, compliance)
            matrix = phi @ compliance
            for i in range(len(active)):
                early, late = before[step, active[i]], after[step, active[i]]
                for j in range(len(active)):
                    matrix[i, j] *= dt * late
                matrix[i, i] += 1.0
                for column in range(2 * n):
                    moved[i, column] = -(early + late) * start[i, column] - late * dt * moved[i, column]
            forces = np.linalg.solve(matrix, moved)
            push = compliance @ forces
            for row in range(n):
                for column in range(2 * n):
                    middle[row, column] += push[row, column]
        for row in range(n):
            for column in range(2 * n):
                place[row, column] += dt * middle[row, column]
                speed[row, column] = 2.0 * middle[row, column] - speed[row, column]
    return np.concatenate((place, speed))


@allocating
def _solve_columns(inverse: Array, updates: Array, factors: Array, columns: Array) -> None:
    """Set columns, (n, r), to A^-1 columns."""
    changes = np.zeros((len(factors), columns.shape[1]))
    for k in range(len(factors)):
        for row in range(len(inverse)):
            for column in range(columns.shape[1]):
                changes[k, column] += factors[k] * updates[k, row] * columns[row, column]
    for row in range(len(inverse)):
        for column in range(columns.shape[1]):
            columns[row, column] *= inverse[row]
        for k in range(len(factors)):
            for column in range(columns.shape[1]):
                columns[row, column] -= updates[k, row] * changes[k, column]


def monodromy_along(modal: ModalSystem, law: ContactLaw, implicit: bool, dt: float, places: Array) -> Array:
    """Return d(q1, v1) / d(q0, v0), (2n, 2n), over steps between given places.

    Args:
        modal: The system.
        law: Its contact law.
        implicit: Whether the scheme takes the law at the end of the step, or its discrete gradient.
        dt: Step, s.
        places: q at the start of the first step and at the end of each, (steps + 1, n).
    """
    contact = modal.system.contact
    depths = -(contact.initial_gap + places @ modal.gaps.T)
    if not contact.circles:
        return monodromy(modal, law, implicit, dt, depths)
    return _with_stations(modal, law, implicit, dt, places, depths)


def _with_stations(
    modal: ModalSystem, law: ContactLaw, implicit: bool, dt: float, places: Array, depths: Array
) -> Array:
    contact, circles = modal.system.contact, modal.system.contact.circles
    n, stations = len(modal.squares), len(circles.points)
    fixed = np.setdiff1d(np.arange(contact.size), circles.points)
    rows = np.concatenate([modal.gaps[fixed], modal.planes.reshape(-1, n)])
    r = np.einsum("kan,tn->tka", modal.planes, places) - circles.middles
    far = np.linalg.norm(r, axis=2)
    depths[:, circles.points] = far - circles.clearances
    over_step = law.implicit if implicit else law.discrete_gradient
    compliance = _responses(modal, dt, rows.T)
    delassus = rows @ compliance
    place, speed = np.eye(n, 2 * n), np.eye(n, 2 * n, n)
    for step in range(len(places) - 1):
        old, new = depths[step], depths[step + 1]
        early, late = (contact.weights * slope for slope in step_slopes(law, implicit, old, new, dt))
        force = contact.weights * over_step(old, new, dt).pressure
        before, after = np.zeros((2, len(rows), len(rows)))
        count = np.arange(len(fixed))
        before[count, count], after[count, count] = -early[fixed], -late[fixed]
        for k in range(stations):
            point, here = circles.points[k], slice(len(fixed) + 2 * k, len(fixed) + 2 * k + 2)
            if force[point] == 0.0 and early[point] == 0.0 and late[point] == 0.0:
                continue
            length, z = far[step, k] + far[step + 1, k], r[step, k] + r[step + 1, k]
            share = force[point] / length
            for block, slope, number in ((before, early, step), (after, late, step + 1)):
                along = np.outer(z, r[number, k] / far[number, k]) / length
                block[here, here] = -share * np.eye(2) - (slope[point] - share) * along
        middle = _responses(modal, dt, 2.0 / dt * speed - modal.squares[:, None] * place)
        if before.any() or after.any():
            pushed = (before + after) @ (rows @ place) + dt * after @ (rows @ middle)
            middle += compliance @ np.linalg.solve(np.eye(len(rows)) - dt * after @ delassus, pushed)
        place, speed = place + dt * middle, 2.0 * middle - speed
    return np.concatenate([place, speed])


def _responses(modal: ModalSystem, dt: float, columns: Array) -> Array:
    """Return A^-1 columns, (n, r)."""
    inverse: Array = np.asarray(1.0 / (2.0 / dt + modal.damping + 0.5 * dt * modal.squares))
    updates, factors = inverse_updates(inverse, modal.dashpots)
    return np.asarray(inverse[:, None] * columns - updates.T @ (factors[:, None] * (updates @ columns)))
