"""Newton stage of the seat: active sets with the true tangent and an exact line search on the potential energy.

    E(u) = u^T K u / 2 - f^T u + sum w psi(d(u)),    d = -(g0 + G u),  |r(u)| - c in round holes

is convex, as all laws rise. Each iteration solves

    (K + G^T (w kappa) G + N + r G0^T w G0) du = f + G^T (w p) - K u

with the slopes kappa of the law where it presses, N what contact in round holes adds as it turns, and springs r that
fade from iteration to iteration: they hold what no contact holds yet. A line search along du finds the least energy, so
that the energy falls in each iteration, from any start. Softer laws lead to the law itself: their active sets are found
in a few iterations each.

Pressures of a nearly rigid law are lost in the round-off of depths. Such a law is followed as far as depths resolve the
mean pressure; the proximal iteration of `seat.static_seat`, which knows forces, takes over from there.

Source: Christensen (2002) and Qi and Sun (1993) for semi-smooth Newton methods with a line search.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.errors import NotConverged
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Springs
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem

SOFTENED = (1.0e-6, 1.0e-4, 1.0e-2, 1.0)  # shares of the law on the way to it
MOST = 40  # iterations with each
FADES = 0.1  # springs over those of the iteration before
FAINTEST = 1.0e-12  # springs over those of the first iteration
FIRMER = 1.0e4  # springs over those that round-off in the operator hid
RESOLVED = 1.0e-4  # of the mean pressure: what round-off of depths may hide
DONE, ROUGH = 1.0e-16, 1.0e-8  # of the energy: work that an iteration can still do, and that with softer laws
STALLED = 1.0e-10  # likewise, where it no longer falls
WHOLE = 0.1  # slope of the energy at the end of a step over that at its start: the whole step is taken


def takes_newton(system: SemiDiscreteSystem) -> bool:
    """Return whether the tangent of a system can be made: contact has a potential, and K has room for its entries."""
    contact = system.contact
    gathered = isinstance(contact, ResultantOperator)
    return contact.symmetric and (isinstance(system.operators, DenseOperators) or not gathered)


def newton_stage(
    system: SemiDiscreteSystem, law: ContactLaw, springs: float, force: Array, u: Array, forces: Array
) -> tuple[Array, Array]:
    """Return the displacement of the least energy, (n,), m, and the contact forces there, (m,), N, or close to them.

    Args:
        system: The system, without tangents.
        law: The contact law; its damping plays no part.
        springs: r of the first iteration, Pa/m.
        force: The static loads f, (n,), N.
        u: Where to start, (n,), m.
        forces: About the contact forces there, (m,), N.

    Collective.
    """
    operators, contact = system.operators, system.contact
    hardest = _resolved_share(system, law, float(np.sum(forces)), u)
    for share in SOFTENED:
        softened = law.softened(hardest * share) if hardest * share < 1.0 else law
        fading, last = springs, np.inf
        for _ in range(MOST):
            values = contact.interface.trace(u, operators)
            here, depth = contact.at(values), contact.depth(values)
            stage = softened.static(depth)
            forces = contact.weights * stage.pressure
            unbalanced = force - operators.apply_stiffness(u)
            contact.interface.add(unbalanced, here.resultant(forces))
            gaps = here.gap_matrix
            matrix = gaps.T @ gaps.multiply((contact.weights * stage.slope)[:, None]) + here.holding(forces, values)
            try:
                held = Springs(contact.interface, (matrix + contact.springs(fading).matrix).tocsr())
                update = operators.factor(0.0, 1.0, held).solve(unbalanced)
            except NotConverged:
                if fading >= springs:
                    return u, forces
                fading = min(FIRMER * fading, springs)
                continue
            first, second, energy, done = system.dots(
                [
                    (update, unbalanced),
                    (update, operators.apply_stiffness(update)),
                    (u, operators.apply_stiffness(u)),
                    (u, force),
                ]
            )
            potential = float(contact.weights @ softened.potential(depth))
            scale = abs(energy) + 2.0 * potential + abs(done)
            if first <= (DONE if share == 1.0 else ROUGH) * scale or (first >= 0.5 * last and first <= STALLED * scale):
                break
            last = first
            u = u + _length(system, softened, force, u, update, float(second)) * update
            fading = max(FADES * fading, FAINTEST * springs)
    return u, forces


def _length(system: SemiDiscreteSystem, law: ContactLaw, force: Array, u: Array, update: Array, second: float) -> float:
    """Return the length in (0, 1] of an update that minimizes the energy. Collective."""
    contact, operators = system.contact, system.operators
    [first] = system.dots([(update, operators.apply_stiffness(u) - force)])
    values, change = (contact.interface.trace(x, operators) for x in (u, update))

    def slope(length: float) -> float:
        there = values + length * change
        forces = contact.weights * law.static(contact.depth(there)).pressure
        return float(first + length * second - forces @ (contact.at(there).gap_matrix @ change))

    if slope(1.0) <= -WHOLE * slope(0.0):
        return 1.0
    return float(brentq(slope, 0.0, 1.0, xtol=1.0e-12)) if slope(0.0) < 0.0 else 1.0


def _resolved_share(system: SemiDiscreteSystem, law: ContactLaw, total: float, u: Array) -> float:
    """Return the share of a law whose mean pressure is not hidden by round-off of depths. Collective."""
    contact, operators = system.contact, system.operators
    if law.spring.exponent != 1.0 or total <= 0.0:
        return 1.0
    depth = contact.depth(contact.interface.trace(u, operators))
    hidden = law.stiffness * np.finfo(float).eps * float(np.max(np.abs(depth)))
    return min(1.0, RESOLVED * total / contact.area / hidden) if hidden > 0.0 else 1.0
