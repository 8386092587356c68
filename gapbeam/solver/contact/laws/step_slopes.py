"""How the pressure over a midpoint step depends on the penetrations at its start and its end."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.system.operators import Array


def step_slopes(law: ContactLaw, implicit: bool, old: Array, new: Array, dt: float) -> tuple[Array, Array]:
    """Return the derivatives of the pressure of a step by the penetrations at its start and end, (m,) each, Pa/m.

    The discrete gradient of a step reversed in time is the same pressure, so its slope in the start is that of the
    reversed step in its end. At touch the law has a kink; the slope on one side of it is returned.

    Args:
        law: The contact law.
        implicit: Whether the pressure is the law at the end of the step, or its discrete gradient.
        old: Penetrations at the start, (m,), m.
        new: Penetrations at the end, (m,), m.
        dt: Step, s.
    """
    if not implicit:
        return law.discrete_gradient(new, old, -dt).slope, law.discrete_gradient(old, new, dt).slope
    stage = law.implicit(old, new, dt)
    pressed = (stage.pressure > 0.0) | law.adhesive
    return np.where(pressed, -law.damping(old) / dt, 0.0), stage.slope
