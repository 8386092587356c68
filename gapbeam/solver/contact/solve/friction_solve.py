"""Contact with friction in one step: contact and slip in turn, until the friction forces settle.

    d = d_held - s G A^-1 (H^T (f - f_held) + T^T h),    f = w P(d)
    v = v_held + c T A^-1 (H^T (f - f_held) + T^T h),    h = -mu <f> v / sqrt(|v|^2 + v0^2)

Newton's iteration on both (`solve.coupled_newton`) gives a start. Given h, f then solves a contact problem,
and given f, h a slip problem; each has a potential and one solution. Mostly one turn h -> f -> h confirms the start.
Where it was none, turns contract by about mu times the coupling of both directions in A^-1, which vanishes with the
step, and Anderson's mixing of the last turns speeds them up.

Source: Panagiotopoulos (1975) for the turns; Walker and Ni (2011), SIAM J. Numer. Anal. 49, 1715-1735, for the mixing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gapbeam.solver.contact.laws.contact_law import StagePressure
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.contact.solve.contact_solve import ContactSolution, solve_contact
from gapbeam.solver.contact.solve.coupled_newton import coupled_newton
from gapbeam.solver.contact.solve.matrix_free_condensation import Condensed
from gapbeam.solver.contact.solve.slip_problem import Sliding
from gapbeam.solver.contact.solve.slip_solve import solve_slip
from gapbeam.solver.errors import NotConverged
from gapbeam.solver.system.operators import Array

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
