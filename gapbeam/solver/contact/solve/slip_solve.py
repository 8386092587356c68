"""The slip problem of one step, for given contact forces: a small Newton in force form with an exact line search.

Find the friction forces h (m, k) with

    v = v_free + S h,    h = -b phi(v),    phi(v) = v / sqrt(|v|^2 + v0^2),

for limits b >= 0 and a symmetric positive semi-definite S. With R = h + b phi(v), each update dh solves

    ((b J)^-1 + S) dh = -(b J)^-1 R,    J = (1 - sym(q phi^T)) / sqrt(|v|^2 + v0^2),    q = -h / b, |q| <= 1,

on the points with b > 0. With q = phi this is the tangent of the law, which hardly sees friction once the point slips;
with the q that the forces tell, it is as positive, and the iteration does not suffer from a small v0. The forces
minimize the convex potential  h^T S h / 2 + sum b sqrt(|v|^2 + v0^2)  over the line of each update.

Source: Chan, Golub and Mulet (1999), SIAM J. Sci. Comput. 20, 1964-1977, for the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.operators import Array

RELATIVE_TOLERANCE = 1.0e-12  # of the largest limit
ROUND_OFF = 1.0e-14  # of what cancels in v_free + S h
NEGLIGIBLE = 1.0e-14  # of the largest limit: points that carry nothing
FLATTEST = 1.0e-14  # least slope of the law, relative to 1 / sqrt(|v|^2 + v0^2)
FULL_STEPS = 3


@dataclass(frozen=True)
class SlipSolution:
    """Friction forces h (m, k), N, and the number of iterations."""

    friction: Array
    iterations: int


def solve_slip(
    law: CoulombFriction,
    limits: Array,
    free_slip: Array,
    compliance: Array,
    scale: float,
    start: Array,
    max_iterations: int = 60,
) -> SlipSolution:
    """Solve v = v_free + S h, h = -b phi(v).

    Args:
        law: Gives phi.
        limits: b = mu <f>, (m,), N.
        free_slip: v_free, (m, k), m/s.
        compliance: S / scale, (m k, m k).
        scale: Factor to m/s per N.
        start: Friction forces to start from, (m, k), N.
        max_iterations: Limit.

    Returns:
        Forces that satisfy the law to `RELATIVE_TOLERANCE` of the largest limit, or as well as round-off of the slip
        velocity allows.

    Raises:
        NotConverged: With the history of the residual, N.
    """
    friction = np.zeros_like(free_slip)
    largest = float(np.max(limits, initial=0.0))
    active = np.flatnonzero(limits > NEGLIGIBLE * largest)
    if len(active) == 0:
        return SlipSolution(friction, 0)
    components = free_slip.shape[1]
    rows = (components * active[:, None] + np.arange(components)).reshape(-1)
    inner = scale * compliance[np.ix_(rows, rows)]
    bound, free = limits[active], free_slip[active]
    forces = _within(start[active], bound)
    size = float(np.max(np.abs(free)))
    floor = ROUND_OFF * largest * size / law.slip_velocity
    residuals: list[float] = []
    for iteration in range(max_iterations + 1):
        slip = free + _times(inner, forces)
        mismatch = forces + bound[:, None] * law.direction(slip)
        residual = float(np.max(np.abs(mismatch)))
        stalled = len(residuals) > 1 and residual >= 0.5 * residuals[-1]
        residuals.append(residual)
        if residual <= RELATIVE_TOLERANCE * largest or (stalled and residual <= floor):
            friction[active] = forces
            return SlipSolution(friction, iteration)
        if not np.isfinite(residual):
            break
        update = _newton_update(law, bound, inner, forces, slip, mismatch)
        length = 1.0
        if iteration >= FULL_STEPS:
            length = _exact_step(law, bound, forces, update, slip, _times(inner, update))
        forces = forces + length * update
    raise NotConverged(
        f"the friction solve did not converge in {max_iterations} iterations: the law is missed by "
        f"{residuals[-1] / largest:.3e} of the largest friction force",
        tuple(residuals),
        int(active[np.argmax(np.max(np.abs(mismatch), axis=1))]),
    )


def law_compliance(law: CoulombFriction, bound: Array, forces: Array, slip: Array) -> Array:
    """Return (b J)^-1, (m, k, k), m/s per N, at points with b > 0."""
    direction, traction = law.direction(slip), -_within(forces, bound) / bound[:, None]
    outer = traction[:, :, None] * direction[:, None, :]
    components = np.arange(slip.shape[1])
    slope = -0.5 * (outer + outer.transpose(0, 2, 1))
    slope[:, components, components] += 1.0 + FLATTEST
    inverse = 1.0 / slope if slip.shape[1] == 1 else np.linalg.inv(slope)
    return np.asarray(inverse * (law.speed(slip) / bound)[:, None, None])


def _times(matrix: Array, values: Array) -> Array:
    return np.asarray(matrix @ values.reshape(-1)).reshape(values.shape)


def _within(forces: Array, bound: Array) -> Array:
    """Return forces that are not longer than their bounds."""
    length = np.sqrt(np.sum(forces * forces, axis=1))
    return np.asarray(forces * (bound / np.maximum(length, bound))[:, None])


def _newton_update(
    law: CoulombFriction, bound: Array, inner: Array, forces: Array, slip: Array, mismatch: Array
) -> Array:
    """Solve the linearized law with the balance."""
    blocks = law_compliance(law, bound, forces, slip)
    matrix = inner.copy()
    places = np.arange(slip.size).reshape(slip.shape)
    matrix[places[:, :, None], places[:, None, :]] += blocks
    target = -np.einsum("mij,mj->mi", blocks, mismatch).reshape(-1)
    solved = scipy.linalg.cho_solve(scipy.linalg.cho_factor(matrix, overwrite_a=True, check_finite=False), target)
    return np.asarray(solved).reshape(slip.shape)


def _exact_step(law: CoulombFriction, bound: Array, forces: Array, update: Array, slip: Array, change: Array) -> float:
    """Return the length in (0, 1] that minimizes the slip potential along the update, by bisection."""

    def slope(length: float) -> float:
        missed = forces + length * update + bound[:, None] * law.direction(slip + length * change)
        return float(np.sum(change * missed))

    if slope(1.0) <= 0.0 or slope(0.0) >= 0.0:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slope(middle) > 0.0 else (middle, high)
    return high
