"""What a step knows about slip before contact and friction are solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.coulomb_friction import CoulombFriction
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
