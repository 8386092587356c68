"""The contact problem of one step: a small semi-smooth Newton in force form with an exact line search.

Find the point forces f = w p (m,) with

    d = d_free - s D f,    f = w P(d),

for a pointwise non-decreasing law P, a symmetric positive semi-definite Delassus operator D and a scale s > 0.
Linearizing P at d_k, P = P_k + kappa (d - d_k), gives on the points with kappa > 0

    (diag(1 / (w kappa)) + s D) f = d_free - d_k + P_k / kappa,

in which the stiffness enters as a compliance: kappa to infinity is harmless. The forces that solve the step
minimize the convex potential  f^T s D f / 2 + sum w psi(d_free - s D f)  over the line of each update, which is
searched exactly by bisection on its derivative; without that the iteration can cycle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from solver.condensation import CondensedOperator
from solver.contact.law import StagePressure
from solver.errors import NotConverged
from solver.system import Array

RELATIVE_TOLERANCE = 1.0e-11
ROUND_OFF = 1.0e-14  # of the terms that cancel in d_free - s D f
FULL_STEPS = 3


@dataclass(frozen=True)
class ContactSolution:
    """Forces f = w p (m,), N, the penetration (m,), m, the law there, and the number of iterations."""

    forces: Array
    depth: Array
    law: StagePressure
    iterations: int


def solve_contact(
    condensed: CondensedOperator,
    scale: float,
    free_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    start: Array,
    max_iterations: int = 60,
) -> ContactSolution:
    """Solve d = d_free - s D f, f = w P(d).

    Args:
        condensed: Holds the Delassus operator D.
        scale: s > 0, what a unit of A^-1 G^T f adds to the penetration.
        free_depth: d_free, (m,), m.
        weights: w, (m,), m^2.
        law: P with its slope, at m penetrations.
        start: Point forces to start from, (m,), N.
        max_iterations: Limit.

    Returns:
        The solution; its forces satisfy the law to `RELATIVE_TOLERANCE` of the largest pressure.

    Raises:
        NotConverged: With the history of the residual (Pa), after `max_iterations`.
    """
    forces = start
    depth = free_depth - scale * condensed.respond(forces) if np.any(forces) else free_depth
    size = float(np.max(np.abs(free_depth), initial=0.0))
    residuals: list[float] = []
    for iteration in range(max_iterations + 1):
        stage = law(depth)
        mismatch = forces / weights - stage.pressure
        residual = float(np.max(np.abs(mismatch), initial=0.0))
        if not np.isfinite(residual):
            break
        residuals.append(residual)
        wanted = RELATIVE_TOLERANCE * float(np.max(np.abs(stage.pressure), initial=0.0))
        cancelled = scale * condensed.largest_compliance * float(np.sum(np.abs(forces)))
        floor = ROUND_OFF * float(np.max(stage.slope, initial=0.0)) * max(size, cancelled)
        stalled = len(residuals) > 1 and residual >= 0.5 * residuals[-2]
        if residual <= wanted or (stalled and residual <= floor):
            return ContactSolution(forces, depth, stage, iteration)
        update = _newton_forces(condensed, scale, free_depth, weights, depth, stage) - forces
        change = -scale * condensed.respond(update)
        length = 1.0
        if iteration >= FULL_STEPS:
            length = _exact_step(weights, forces, update, depth, change, law)
        forces = forces + length * update
        depth = depth + length * change if length < 1.0 else free_depth - scale * condensed.respond(forces)
    raise NotConverged(
        f"the contact solve did not converge in {max_iterations} iterations: the law is missed by "
        f"{residuals[-1] if residuals else float('nan'):.3e} Pa",
        tuple(residuals),
        int(np.argmax(np.abs(mismatch))),
    )


def _newton_forces(
    condensed: CondensedOperator,
    scale: float,
    free_depth: Array,
    weights: Array,
    depth: Array,
    stage: StagePressure,
) -> Array:
    """Solve the linearized law with the balance on the points whose pressure depends on the penetration."""
    active = np.flatnonzero(stage.slope > 0.0)
    forces = np.asarray(weights * stage.pressure)
    if len(active) == 0:
        return forces
    fixed = forces.copy()
    fixed[active] = 0.0
    target = free_depth[active] - depth[active] + stage.pressure[active] / stage.slope[active]
    if np.any(fixed):
        target -= scale * condensed.respond(fixed)[active]
    matrix = scale * condensed.delassus[np.ix_(active, active)]
    matrix[np.diag_indices_from(matrix)] += 1.0 / (weights[active] * stage.slope[active])
    try:
        forces[active] = cho_solve(cho_factor(matrix, overwrite_a=True, check_finite=False), target)
    except LinAlgError:
        # Compliances of nearly rigid laws vanish against round-off in D: take the smallest solution.
        matrix = scale * condensed.delassus[np.ix_(active, active)]
        matrix[np.diag_indices_from(matrix)] += 1.0 / (weights[active] * stage.slope[active])
        forces[active] = np.linalg.lstsq(matrix, target, rcond=1.0e-14)[0]
    return forces


def _exact_step(
    weights: Array,
    forces: Array,
    update: Array,
    depth: Array,
    change: Array,
    law: Callable[[Array], StagePressure],
) -> float:
    """Return the length in (0, 1] that minimizes the step potential along the update, by bisection."""

    def slope(length: float) -> float:
        pressure = law(depth + length * change).pressure
        return float(-change @ (forces + length * update - weights * pressure))

    if slope(1.0) <= 0.0 or slope(0.0) >= 0.0:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if slope(middle) > 0.0:
            high = middle
        else:
            low = middle
    return high
