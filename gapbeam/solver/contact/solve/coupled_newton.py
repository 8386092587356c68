"""Newton's iteration on contact and friction at once: a start for the solution in turns, mostly the solution itself.

    d = d_free - s G A^-1 (H^T f + T^T h),    f = w P(d)
    v = v_free + c T A^-1 (H^T f + T^T h),    h = -mu <f> phi(v)

With the laws missed by r = f - w P and q = h + mu <f> phi, an update (df, dh) solves

    (w kappa)^-1 df + s G A^-1 (H^T df + T^T dh)                                   = -(w kappa)^-1 r
    (b J)^-1 dh + (b J)^-1 phi mu df + c T A^-1 (H^T df + T^T dh)                  = -(b J)^-1 q

on the points whose law has a slope kappa, or a limit b = mu <f> > 0; J is that of `solve.slip_solve`. Near the
solution this converges quadratically. Far from it nothing holds it: the problem has no potential, so what comes out is
judged by those who asked for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gapbeam.solver.contact.laws.contact_law import StagePressure
from gapbeam.solver.contact.laws.springs import at_points
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.contact.solve.slip_problem import Sliding
from gapbeam.solver.contact.solve.slip_solve import NEGLIGIBLE, law_compliance
from gapbeam.solver.system.operators import Array

ENOUGH = 1.0e-12  # of the largest pressure and friction force
ROUND_OFF = 1.0e-15  # of the free penetration and slip, which stiff laws turn into forces
MOST_UPDATES = 15


@dataclass(frozen=True)
class _Trial:
    """Forces, and by how much they miss the laws.

    Attributes:
        forces: f, (m,), N.
        friction: h, (m, k), N.
        slip: v, (m, k), m/s.
        stiffness: w kappa, (m,), N/m.
        limits: b = mu <f>, (m,), N.
        missed: f - w P(d), (m,), N.
        missed_friction: h + b phi(v), (m, k), N.
    """

    forces: Array
    friction: Array
    slip: Array
    stiffness: Array
    limits: Array
    missed: Array
    missed_friction: Array

    @property
    def missed_share(self) -> float:
        """By how much the laws are missed, relative to the largest force and limit."""
        return max(_share(self.missed, self.forces), _share(self.missed_friction, self.limits))


def coupled_newton(
    sliding: Sliding,
    condensed: CondensedOperator,
    scale: float,
    held_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    held: Array,
) -> tuple[Array, Array, int]:
    """Return the forces f (m,) and h (m, k), N, that missed the laws least, and the number of updates.

    Args:
        sliding: Slip before it is solved, and the h to start from.
        condensed: Holds the operators.
        scale: s > 0; the rest as in `gapbeam.solver.contact.solve.contact_solve.solve_contact`.
        held_depth: d_held, (m,), m.
        weights: w, (m,), m^2.
        law: P with its slope.
        held: f_held, which the penetration and the slip contain, and to start from, (m,), N.
    """

    def tried(forces: Array, friction: Array) -> _Trial:
        opened, moved = condensed.respond_all(forces - held, friction)
        stage, slip = law(held_depth - scale * opened), sliding.free_slip + sliding.scale * moved
        limits = sliding.law.limit(forces)
        missed, missed_friction = forces - weights * stage.pressure, friction - sliding.law.traction(forces, slip)
        return _Trial(forces, friction, slip, weights * stage.slope, limits, missed, missed_friction)

    best = last = tried(held, sliding.start)
    updates = 0
    while updates < MOST_UPDATES and best.missed_share > _resolved(best, sliding, held_depth):
        try:
            change, change_friction = _update(sliding, condensed, scale, last)
        except np.linalg.LinAlgError:
            break
        last = tried(last.forces + change, last.friction + change_friction)
        updates += 1
        if not np.isfinite(last.missed_share):
            break
        if last.missed_share < best.missed_share:
            best = last
    return best.forces, best.friction, updates


def _resolved(trial: _Trial, sliding: Sliding, held_depth: Array) -> float:
    """Return the share that round-off in penetration and slip alone can make."""
    largest = float(np.max(np.abs(trial.forces), initial=0.0))
    stiffest = float(np.max(trial.stiffness, initial=0.0)) * float(np.max(np.abs(held_depth), initial=0.0))
    fastest = float(np.max(np.abs(sliding.free_slip), initial=0.0)) / sliding.law.slip_velocity
    return max(ENOUGH, ROUND_OFF * max(fastest, stiffest / largest if largest > 0.0 else 0.0))


def _share(missed: Array, of: Array) -> float:
    """Return the largest entry relative to that of what it is a part of."""
    largest = float(np.max(np.abs(of), initial=0.0))
    most = float(np.max(np.abs(missed), initial=0.0))
    return most / largest if largest > 0.0 else most


def _update(sliding: Sliding, condensed: CondensedOperator, scale: float, trial: _Trial) -> tuple[Array, Array]:
    """Return (df, dh) of the linearized laws; those of points without slope or limit are known beforehand."""
    count, components = trial.friction.shape
    closed = np.flatnonzero(trial.stiffness > 0.0)
    rubbing = np.flatnonzero(trial.limits > NEGLIGIBLE * np.max(trial.limits, initial=0.0))
    change, change_friction = -trial.missed, -trial.missed_friction
    change[closed], change_friction[rubbing] = 0.0, 0.0
    if len(closed) + len(rubbing) == 0:
        return change, change_friction
    normal, softness, slip = len(closed), 1.0 / trial.stiffness[closed], trial.slip[rubbing]
    along = (count + components * rubbing[:, None] + np.arange(components)).reshape(-1)
    unknown = np.concatenate([closed, along])
    matrix = condensed.compliance[np.ix_(unknown, unknown)]
    matrix[:normal] *= scale
    matrix[normal:] *= sliding.scale
    blocks = law_compliance(sliding.law, trial.limits[rubbing], trial.friction[rubbing], slip)
    coefficients = at_points(sliding.law.coefficient, count)[rubbing, None]
    per_force = coefficients * np.einsum("mij,mj->mi", blocks, sliding.law.direction(slip))
    matrix[np.arange(normal), np.arange(normal)] += softness
    places = normal + np.arange(len(along)).reshape(-1, components)
    matrix[places[:, :, None], places[:, None, :]] += blocks
    column = np.full(count, -1)
    column[closed] = np.arange(normal)
    both = column[rubbing] >= 0
    matrix[places[both], column[rubbing][both][:, None]] += per_force[both]
    opened, moved = condensed.respond_all(change, change_friction)
    missed_gap = softness * trial.missed[closed] + scale * opened[closed]
    missed_slip = np.einsum("mij,mj->mi", blocks, trial.missed_friction[rubbing]) + sliding.scale * moved[rubbing]
    missed_slip += per_force * change[rubbing][:, None]
    solved = np.linalg.solve(matrix, -np.concatenate([missed_gap, missed_slip.reshape(-1)]))
    change[closed] = solved[:normal]
    change_friction[rubbing] = solved[normal:].reshape(-1, components)
    return change, change_friction
