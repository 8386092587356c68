"""Operations that every implicit scheme performs with its effective operator."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.contact.solve.condensation import Condensed, ForceResponse
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import Imaged, SemiDiscreteSystem


def hold(system: SemiDiscreteSystem, right_side: Array, pressure: Array) -> Array:
    """Add H^T f for the pressure that acted last to a right side, and return f = w p, (m,), N.

    The step then solves for the change of the contact forces: what holds the body is in the right side, and nothing
    large cancels (`gapbeam.solver.contact.solve.contact_solve`).
    """
    held = np.asarray(system.contact.weights * pressure)
    if held.any():
        system.contact.interface.add(right_side, system.contact.resultant(held))
    return held


def image_of_solution(
    system: SemiDiscreteSystem,
    condensed: Condensed,
    free: Array,
    right_side: Array,
    forces: Array,
    friction: Array | None = None,
    response: ForceResponse | None = None,
) -> Imaged:
    """Return x = A^-1 (r + H^T f + T^T h) with its images M x and K x, (3, n).

    M x costs one product with the (small) mass matrix; K x then follows from the right side,
    A x = c_m M x + c_k K x + c_d dashpots, which spares the product with K in every step. Iterations miss the equation
    by what they leave: K x is then a product, and what they leave shows in the energy ledger.

    Args:
        system: The system.
        condensed: A.
        free: A^-1 r, (n,).
        right_side: r, with what `hold` added, (n,), overwritten.
        forces: Change of the point forces f = w p from those held, (m,), N.
        friction: Change of the friction forces, h = w t, (m, k), N; None: without friction.
        response: Response of the body to the change, where known.

    Collective.
    """
    x = condensed.correct(free, forces, friction, response)
    mass_image = system.operators.apply_mass(x)
    if condensed.iterative:
        return np.stack([x, mass_image, system.operators.apply_stiffness(x)])
    system.contact.interface.add(right_side, system.contact.resultant(forces, friction))
    elastic = right_side - condensed.mass * mass_image
    if condensed.dashpots is not None:
        elastic -= condensed.dashpots.apply(x, system.operators)
    stiffness_image = elastic / condensed.stiffness
    return np.stack([x, mass_image, stiffness_image])
