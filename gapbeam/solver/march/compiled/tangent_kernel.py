"""The monodromy matrix of midpoint steps in modal coordinates, by linearizing one step after the other.

A step takes  A vm = (2/dt) v0 - s q0 + f_ext + Phi^T (w p),  q1 = q0 + dt vm,  v1 = 2 vm - v0,  A = 2/dt + c + dt s/2,
with dashpots in A besides, p = P(d0, d1) and d = -(g0 + Phi q). Its derivative needs the penetrations only.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, step_slopes
from gapbeam.solver.jit import allocating, allocating_entry
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
        updates: What dashpots change in it, `gapbeam.solver.march.compiled.plan_arrays.inverse_updates`, (k, n).
        factors: Of these, (k,).
        gaps: Phi, (m, n).
        before: Derivatives of the point forces of each step by the penetrations at its start, (steps, m), N/m.
        after: By those at its end, (steps, m), N/m.
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
