"""The contact problem of one step: a small semi-smooth Newton in force form with an exact line search.

Find the point forces f = w p (m,) with

    d = d_held - s D (f - f_held),    f = w P(d),

for a pointwise non-decreasing law P, a symmetric positive semi-definite Delassus operator D and a scale s > 0.
Linearizing P at d_k, P = P_k + kappa (d - d_k), gives on the points with kappa > 0

    (diag(1 / (w kappa)) + s D) (f - f_held) = d_held - d_k + (P_k - f_held / w) / kappa,

in which the stiffness enters as a compliance: kappa to infinity is harmless. The forces that solve the step
minimize the convex potential  f^T s D f / 2 + sum w psi(d)  over the line of each update, which is
searched exactly for the root of its derivative; without that the iteration can cycle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.contact.laws.contact_law import StagePressure
from gapbeam.solver.contact.solve.condensation import Condensed, ForceResponse
from gapbeam.solver.contact.solve.step_length import root_of_slope
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.operators import Array

RELATIVE_TOLERANCE = 1.0e-11
NOTHING = 1.0e-290  # Pa; below it numbers lose their digits
ROUND_OFF = 1.0e-12  # of what cancels in the penetration; in Nitsche's method stresses of rigid motions cancel as well
UNRESOLVED = 1.0e-14  # of d_held, as work of the forces
EPSILON = 1.0e-15  # of the pressure before: what a pressure cannot be resolved to
SETTLED = 1.0e-7  # of the largest force: what round-off of the penetration leaves of an update
PATIENCE = 10  # iterations, after which a solution that stands still is one although the law is missed by a little more
NEARLY = 100.0  # of the tolerance or the floor
FULL_STEPS = 3
FULL_STEPS_NOT_SYMMETRIC = 20  # there is no potential to search along
SOFTENED = (1.0e-4, 1.0e-3, 1.0e-2, 0.1, 1.0)  # shares of the law on the way to a hard solution
MOST_UPDATES = 100  # of the multipliers


@dataclass(frozen=True)
class ContactSolution:
    """Forces f = w p (m,), N, the penetration (m,), m, the law there, and the number of iterations.

    And the change f - f_held, which has more digits than f; the work, J, that round-off in the penetration hides; with
    friction also its forces h = w t (m, k), N; what the change does to the body, where that is known.
    """

    forces: Array
    change: Array
    depth: Array
    law: StagePressure
    iterations: int
    unresolved: float = 0.0
    friction: Array | None = None
    response: ForceResponse | None = None

    def traction(self, weights: Array) -> Array | None:
        """Return the tangential traction h / w, (m, k), Pa; None without friction."""
        return None if self.friction is None else self.friction / weights[:, None]


def solve_contact(
    condensed: Condensed,
    scale: float,
    held_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    held: Array,
    max_iterations: int = 60,
    augmented: float | None = None,
    patience: int | None = None,
) -> ContactSolution:
    """Solve d = d_held - s D (f - f_held), f = w P(d), or the same with multipliers: f = w P(d + shift).

    d_held is the penetration under the forces f_held that acted last. Were it that of a free flight, it and D f would
    be large and cancel: base and gland press against each other on a body that hardly anything else holds.

    The shift, a multiplier over the stiffness, grows by the penetration (Uzawa) until that is below `augmented` times
    the penetration without it.

    Args:
        condensed: Holds the Delassus operator D.
        scale: s > 0, what a unit of A^-1 G^T f adds to the penetration.
        held_depth: d_held, (m,), m.
        weights: w, (m,), m^2.
        law: P with its slope, at m penetrations.
        held: f_held, (m,), N.
        max_iterations: Limit, of each solution.
        augmented: Relative penetration to reach by multipliers, or None.
        patience: Iterations before softer laws lead to the solution; None: `max_iterations`.

    Returns:
        The solution; its forces satisfy the law to `RELATIVE_TOLERANCE` of the largest pressure, or as well as
        round-off of the penetration allows.

    Raises:
        NotConverged: The iterations did not converge within `max_iterations`; the error has the history of the
            residual, Pa.
    """
    first = held
    patience = max_iterations if patience is None else patience

    def solve(shift: Array | float) -> ContactSolution:
        nonlocal first
        shifted = held_depth if augmented is None else held_depth + shift
        found = _solve_by_softening(condensed, scale, shifted, weights, law, held, first, patience, max_iterations)
        first = found.forces
        return found

    return with_multipliers(solve, held_depth, augmented)


def with_multipliers(
    solve: Callable[[Array | float], ContactSolution], held_depth: Array, augmented: float | None
) -> ContactSolution:
    """Return the solution of a step, with multipliers where they are asked for.

    Args:
        solve: Solves for the penetration d + shift of a shift, m, whose law is the one given; from its last solution.
        held_depth: d_held, (m,), m.
        augmented: Relative penetration to reach by multipliers, or None.
    """
    solution = solve(0.0)
    if augmented is None:
        return solution
    shift, allowed = np.zeros_like(held_depth), augmented * _deepest(solution)
    for _ in range(MOST_UPDATES):
        if _deepest(solution) <= allowed:
            return solution
        shift = np.maximum(shift + solution.depth, 0.0)
        shifted = solve(shift)
        iterations = solution.iterations + shifted.iterations
        solution = replace(shifted, depth=shifted.depth - shift, iterations=iterations)
    raise NotConverged(
        f"the multipliers did not settle in {MOST_UPDATES} updates: {_deepest(solution):.3e} m of penetration are "
        "left, and a stiffer contact needs fewer",
        (_deepest(solution),),
        int(np.argmax(solution.depth)),
    )


def _deepest(solution: ContactSolution) -> float:
    return float(np.max(solution.depth, initial=0.0))


def _solve_by_softening(
    condensed: Condensed,
    scale: float,
    held_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    held: Array,
    start: Array,
    patience: int,
    max_iterations: int,
) -> ContactSolution:
    """Solve, and where that fails solve softer laws first, each from the solution of the softer one."""
    try:
        return _solve(condensed, scale, held_depth, weights, law, held, start, patience)
    except NotConverged:
        forces, iterations = start, patience
    for share in SOFTENED:

        def softened(depth: Array, share: float = share) -> StagePressure:
            return StagePressure(*(share * value for value in law(depth)))

        solution = _solve(condensed, scale, held_depth, weights, softened, held, forces, max_iterations)
        forces, iterations = solution.forces, iterations + solution.iterations
    return replace(solution, iterations=iterations)


def _solve(
    condensed: Condensed,
    scale: float,
    held_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    held: Array,
    start: Array,
    max_iterations: int,
) -> ContactSolution:
    change = start - held
    response = condensed.respond(change) if start is not held else None
    depth = held_depth if response is None else held_depth - scale * response.gaps
    size = largest(held_depth)
    least = max(NOTHING, EPSILON * largest(held / weights))
    residuals: list[float] = []
    for iteration in range(max_iterations + 1):
        stage, forces = law(depth), held + change
        mismatch = forces / weights - stage.pressure
        residual = largest(mismatch)
        if not np.isfinite(residual * residual):  # products in a search would overflow before the residual does
            break
        residuals.append(residual)
        wanted = max(RELATIVE_TOLERANCE * largest(stage.pressure), least)
        cancelled = scale * condensed.largest_compliance * float(np.abs(change).sum())
        floor = ROUND_OFF * float(stage.slope.max(initial=0.0)) * max(size, cancelled)
        stalled = len(residuals) > 1 and residual >= 0.5 * residuals[-2]
        if residual <= wanted:
            return settled_solution(held, change, depth, stage, iteration, held_depth, response)
        newton, newton_response = _newton_change(
            condensed, scale, held_depth, weights, depth, stage, held, not stalled, response
        )
        update = newton - change
        if stalled:
            moves, most = largest(update), largest(forces)
            # a nearly rigid law turns round-off in depths into pressures, but the forces no longer move
            at_floor = residual <= floor and moves <= SETTLED * most
            # or nothing moves but by round-off: which sums a processor takes side by side decides what is missed
            stands = residual <= NEARLY * max(wanted, floor) and moves <= RELATIVE_TOLERANCE * most
            if at_floor or (stands and iteration > PATIENCE):
                return settled_solution(held, change, depth, stage, iteration, held_depth, response)
        # iterations leave an error in depths that a search would take for a slope
        exhausted = condensed.iterative and largest(update) <= SETTLED * largest(forces)
        if not exhausted and iteration >= (FULL_STEPS if condensed.symmetric else FULL_STEPS_NOT_SYMMETRIC):
            # a product with D is a solve there, and both responses are known as well as it would be
            known = response if condensed.iterative else None
            further = condensed.respond(update) if known is None else newton_response.further(-1.0, known)
            search = _exact_step if condensed.symmetric else _shorter_step
            length = search(weights, forces, update, depth, -scale * further.gaps, law)
            if length < 1.0:
                change, depth = change + length * update, depth - length * scale * further.gaps
                assert response is not None  # the full steps before left one
                response = response.further(length, further)
                continue
        change, response = newton, newton_response
        depth = held_depth - scale * response.gaps
    raise NotConverged(
        f"the contact solve did not converge in {max_iterations} iterations: the law is missed by "
        f"{residuals[-1] if residuals else float('nan'):.3e} Pa",
        tuple(residuals),
        int(np.argmax(np.abs(mismatch))),
    )


def largest(values: Array) -> float:
    """Return the largest absolute value; 0 where there is none."""
    return float(np.abs(values).max()) if values.size else 0.0


def settled_solution(
    held: Array,
    change: Array,
    depth: Array,
    stage: StagePressure,
    iterations: int,
    held_depth: Array,
    response: ForceResponse | None = None,
) -> ContactSolution:
    """Return the solution, without the round-off that is left of forces where the law knows none.

    The change keeps it: the penetration follows the change, and nearly free bodies move far under round-off.
    """
    forces = np.where(stage.pressure == 0.0, 0.0, held + change)
    unresolved = UNRESOLVED * largest(held_depth) * float(np.abs(forces).sum())
    return ContactSolution(forces, change, depth, stage, iterations, unresolved, response=response)


def _newton_change(
    condensed: Condensed,
    scale: float,
    held_depth: Array,
    weights: Array,
    depth: Array,
    stage: StagePressure,
    held: Array,
    detour: bool,
    response: ForceResponse | None,
) -> tuple[Array, ForceResponse]:
    """Solve the linearized law with the balance for f - f_held and its response.

    Where the law has no slope f is known. The detour by the interface DOFs is quicker and costs digits: without it
    where they are missing. Iterations start from the response so far.
    """
    (active,) = (stage.slope > 0.0).nonzero()
    change = np.asarray(weights * stage.pressure - held)
    compliance: Array = np.asarray(1.0 / (weights[active] * stage.slope[active]), dtype=float)
    target = held_depth[active] - depth[active] + compliance * change[active]
    change[active] = 0.0
    return condensed.solve_linearized(scale, active, compliance, target, change, response, detour)


def _exact_step(
    weights: Array,
    forces: Array,
    update: Array,
    depth: Array,
    change: Array,
    law: Callable[[Array], StagePressure],
) -> float:
    """Return the length in (0, 1] that minimizes the step potential along the update: the root of its derivative."""

    def slope(length: float) -> float:
        pressure = law(depth + length * change).pressure
        return float(-change @ (forces + length * update - weights * pressure))

    return root_of_slope(slope) if slope(0.0) < 0.0 < slope(1.0) else 1.0


def _shorter_step(
    weights: Array,
    forces: Array,
    update: Array,
    depth: Array,
    change: Array,
    law: Callable[[Array], StagePressure],
) -> float:
    """Return the length in (0, 1] at which the law is missed least: without a potential (D not symmetric)."""

    def missed(length: float) -> float:
        pressure = law(depth + length * change).pressure
        return float(np.max(np.abs((forces + length * update) / weights - pressure)))

    return min((0.5**halvings for halvings in range(8)), key=missed)
