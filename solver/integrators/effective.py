"""What every implicit scheme does with its effective operator."""

from __future__ import annotations

import numpy as np

from solver.condensation import CondensedOperator
from solver.operators import Array
from solver.system import Imaged, SemiDiscreteSystem


def image_of_solution(
    system: SemiDiscreteSystem,
    condensed: CondensedOperator,
    free: Array,
    right_side: Array,
    forces: Array,
    friction: Array | None = None,
) -> Imaged:
    """Return x = A^-1 (r + H^T f + T^T h) with its images M x and K x, (3, n).

    M x costs one product with the (small) mass matrix; K x then follows from A x = c_m M x + c_k K x, the right side,
    which spares the product with K in every step.

    Args:
        system: The system.
        condensed: A, factored.
        free: A^-1 r, (n,).
        right_side: r, (n,), overwritten.
        forces: Point forces f = w p, (m,), N.
        friction: Those of friction, h = w t, (m, k), N; None: without friction.

    Collective.
    """
    x = condensed.correct(free, forces, friction)
    system.contact.interface.add(right_side, system.contact.resultant(forces, friction))
    mass_image = system.operators.apply_mass(x)
    stiffness_image = (right_side - condensed.mass * mass_image) / condensed.stiffness
    return np.stack([x, mass_image, stiffness_image])
