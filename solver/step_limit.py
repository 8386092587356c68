"""What the explicit scheme makes of the time step of a case."""

from __future__ import annotations

from solver.case import Case
from solver.contact.law import ContactLaw
from solver.defaults import Default
from solver.errors import UserError
from solver.stable_step import SAFETY, stable_step
from solver.system import SemiDiscreteSystem

MUCH_SHORTER = 0.5  # a stable step that damping makes so much shorter is told


def step_limit(case: Case, system: SemiDiscreteSystem, law: ContactLaw) -> Default:
    """Return the largest step of an explicit scheme, with its reason.

    Raises:
        UserError: The step of the case is longer.

    Collective.
    """
    limit = stable_step(system, law)
    damped = limit.step < MUCH_SHORTER * limit.undamped
    words = f"; without damping {limit.undamped:g} s, and damping by mass alone costs nothing" if damped else ""
    if case.time.step > limit.step:
        raise UserError(
            f"time.step: {case.time.step:g} s, which the scheme {case.time.scheme.type} cannot march; expected at "
            f"most {limit.step:g} s on this mesh{words}; try time.step = {limit.step:g}, larger cells, or an implicit "
            'scheme: time.scheme = "discrete-gradient"'
        )
    reason = f"{SAFETY:g} of the stable step; the highest frequency is {limit.frequency:.3g} rad/s{words}"
    return Default("limit of time.step", limit.step, "s", reason, "half: half the cells, or a contact 4 times stiffer")
