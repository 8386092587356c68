"""Contact with friction in one step: Newton's iteration on both, then contact and slip by turns until they agree.

    d = d_held - s G A^-1 (H^T (f - f_held) + T^T h),    f = w P(d)
    v = v_held + c T A^-1 (H^T (f - f_held) + T^T h),    h = -mu <f> v / sqrt(|v|^2 + v0^2)

Newton's iteration on both gives a start. Given h, f then solves a contact problem,
and given f, h a slip problem; each has a potential and one solution. Mostly one turn h -> f -> h confirms the start.
Where it was none, turns contract by about mu times the coupling of both directions in A^-1, which vanishes with the
step, and Anderson's mixing of the last turns speeds them up.

Source: Panagiotopoulos (1975) for the turns; Walker and Ni (2011), SIAM J. Numer. Anal. 49, 1715-1735, for the mixing.

Newton's iteration on contact and friction at once starts the solution in turns, and mostly is the solution itself:

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
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import at_points
from gapbeam.solver.contact.solve.condensation import Condensed, CondensedOperator
from gapbeam.solver.contact.solve.contact_solve import ContactSolution, solve_contact
from gapbeam.solver.contact.solve.slip_solve import NEGLIGIBLE, law_compliance, solve_slip
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator, State


@dataclass(frozen=True)
class Sliding:
    """The slip velocity of a step, v = v_free + c T A^-1 (H^T (f - f_held) + T^T h).

    Attributes:
        law: The law of friction.
        scale: c > 0, what a unit of T A^-1 (H^T f + T^T h) adds to the slip velocity.
        free_slip: v_free, (m, k), m/s.
        start: Friction forces to start from, (m, k), N.
    """

    law: CoulombFriction
    scale: float
    free_slip: Array
    start: Array

    @classmethod
    def of(
        cls, law: ContactLaw, contact: ContactOperator, scale: float, free_velocity: Array, old: State
    ) -> Sliding | None:
        """Return the slip of a step whose velocity is free_velocity + c A^-1 (...), or None without friction.

        Args:
            law: The contact law.
            contact: The contact operator.
            scale: c.
            free_velocity: Interface values of the velocity that slip is measured in, (interface.size,), m/s.
            old: State at the start of the step.
        """
        if law.friction is None:
            return None
        free_slip = contact.slip(free_velocity)
        start = np.zeros_like(free_slip) if old.traction is None else contact.weights[:, None] * old.traction
        return cls(law.friction.of_points(old.slides), scale, free_slip, start)


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
        """Share by which the laws are missed, relative to the largest force and limit."""
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


RELATIVE_TOLERANCE = 1.0e-11  # of the largest friction force
SETTLED = 1.0e-8  # of it, when round-off keeps the turns from getting closer
DEPTH = 5  # turns that are mixed
NEARLY_DEPENDENT = 1.0e-10  # of the largest singular value of their differences


def solve_contact_and_friction(
    sliding: Sliding | None,
    condensed: Condensed,
    scale: float,
    held_depth: Array,
    weights: Array,
    law: Callable[[Array], StagePressure],
    held: Array,
    max_iterations: int = 60,
    augmented: float | None = None,
) -> ContactSolution:
    """Solve the contact problem of a step, with friction where there is some.

    Args:
        sliding: Slip before it is solved; None: without friction, this is `solve_contact`.
        condensed: Holds the Delassus operators.
        scale: s > 0, as in `solve_contact`; the other arguments as well.
        held_depth: d_held, under the contact forces that acted last and without friction, (m,), m.
        weights: w, (m,), m^2.
        law: P with its slope, at m penetrations.
        held: f_held, which the penetration and the slip contain, and to start from, (m,), N.
        max_iterations: Limit, of each solution and of the turns.
        augmented: Relative penetration to reach by multipliers, or None.

    Returns:
        The solution: f satisfies its law for the very h that is returned; h to `RELATIVE_TOLERANCE` of the largest.

    Raises:
        NotConverged: With the history of what a turn still changed, N.
    """
    if sliding is None:
        return solve_contact(condensed, scale, held_depth, weights, law, held, max_iterations, augmented)
    assert isinstance(condensed, CondensedOperator)  # friction is solved for with a factor
    along_faces = condensed.compliance[len(weights) :, len(weights) :]
    forces, friction, iterations = coupled_newton(sliding, condensed, scale, held_depth, weights, law, held)
    mixing, changes, nothing = _Mixing(), list[float](), np.zeros_like(held)
    for _ in range(max_iterations + 1):
        shifted = held_depth - scale * condensed.respond_all(nothing, friction)[0]
        contact = solve_contact(condensed, scale, shifted, weights, law, held, max_iterations, augmented, forces)
        forces, limits = contact.forces, sliding.law.limit(contact.forces)
        pressed_slip = (
            sliding.free_slip + sliding.scale * condensed.respond_all(forces - held, np.zeros_like(friction))[1]
        )
        turned = solve_slip(sliding.law, limits, pressed_slip, along_faces, sliding.scale, friction, max_iterations)
        iterations += contact.iterations + turned.iterations
        change = turned.friction - friction
        changes.append(float(np.max(np.abs(change), initial=0.0)))
        largest = float(np.max(limits, initial=0.0))
        stalled = len(changes) > 2 and changes[-1] >= 0.5 * min(changes[-3:-1])
        if changes[-1] <= RELATIVE_TOLERANCE * largest or (stalled and changes[-1] <= SETTLED * largest):
            return replace(contact, iterations=iterations, friction=friction)
        friction = mixing.mixed(friction, change) if largest > 0.0 else turned.friction
    raise NotConverged(
        f"contact and friction did not settle in {max_iterations} turns: the last one changed the friction forces by "
        f"{changes[-1]:.3e} N; a larger contact.friction.slip_velocity makes it easier",
        tuple(changes),
        int(np.argmax(np.max(np.abs(change), axis=1))),
    )


class _Mixing:
    """Anderson's mixing: the combination of the last turns that would change least, were they linear."""

    def __init__(self) -> None:
        self._values: list[Array] = []
        self._changes: list[Array] = []

    def mixed(self, value: Array, change: Array) -> Array:
        """Return the next value after a turn from `value` to `value + change`."""
        self._values = [*self._values, value][-DEPTH - 1 :]
        self._changes = [*self._changes, change][-DEPTH - 1 :]
        if len(self._values) == 1:
            return value + change
        steps = np.stack([(b - a).reshape(-1) for a, b in pairwise(self._changes)], axis=1)
        moves = np.stack([(b - a).reshape(-1) for a, b in pairwise(self._values)], axis=1)
        shares = np.linalg.lstsq(steps, change.reshape(-1), rcond=NEARLY_DEPENDENT)[0]
        return value + change - ((moves + steps) @ shares).reshape(value.shape)
