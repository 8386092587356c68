"""The monodromy matrix of midpoint steps in modal coordinates, by linearizing one step after the other.

A step takes  A vm = (2/dt) v0 - s q0 + f_ext + Phi^T (w p),  q1 = q0 + dt vm,  v1 = 2 vm - v0,  A = 2/dt + c + dt s/2,
with p = P(d0, d1) and d = -(g0 + Phi q). Its derivative needs the penetrations only.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from solver.contact.law import ContactLaw
from solver.modal import ModalSystem
from solver.operators import Array
from solver.periodic.step_slopes import step_slopes


def monodromy(modal: ModalSystem, law: ContactLaw, implicit: bool, dt: float, depths: Array) -> Array:
    """Return d(q1, v1) / d(q0, v0), (2n, 2n), over steps between given penetrations.

    Args:
        modal: The system.
        law: Its contact law.
        implicit: Whether the scheme takes the law at the end of the step, or its discrete gradient.
        dt: Step, s.
        depths: Penetrations at the start of the first step and at the end of each, (steps + 1, m), m.
    """
    n, gaps, weights = len(modal.squares), modal.gaps, modal.system.contact.weights
    compliance = 1.0 / (2.0 / dt + modal.damping + 0.5 * dt * modal.squares)
    place, speed = np.eye(n, 2 * n), np.eye(n, 2 * n, n)
    for old, new in pairwise(depths):
        middle = compliance[:, None] * ((2.0 / dt) * speed - modal.squares[:, None] * place)
        before, after = step_slopes(law, implicit, old, new, dt)
        active = np.flatnonzero((before != 0.0) | (after != 0.0))
        if len(active):
            phi = gaps[active]
            before, after = (weights * before)[active, None], (weights * after)[active, None]
            start = -phi @ place
            matrix = np.eye(len(active)) + after * dt * ((phi * compliance) @ phi.T)
            forces = np.linalg.solve(matrix, before * start + after * (start - dt * (phi @ middle)))
            middle += compliance[:, None] * (phi.T @ forces)
        place = place + dt * middle
        speed = 2.0 * middle - speed
    return np.concatenate([place, speed])
