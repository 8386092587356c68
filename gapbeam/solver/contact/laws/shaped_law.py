"""A contact law whose elastic pressure is not K d^n: made from the spring, the damper and the traits of its table."""

from __future__ import annotations

from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import per_area
from gapbeam.solver.contact.laws.own_spring_law import own_spring_law
from gapbeam.solver.contact.laws.ramp_law import Ramp, RampLaw
from gapbeam.solver.contact.laws.yielding_law import yielding
from gapbeam.solver.system.operators import Array


def shaped_law(
    chosen: ChosenLaw, law: ContactLaw, areas: float | Array = 1.0, nominal: float | Array = 1.0
) -> ContactLaw:
    """Return a law with the elastic pressure of its table; the law itself for most.

    Args:
        chosen: The table.
        law: Its spring and its damper, of `contact_law.make_law`.
        areas: Areas that resultants at points are spread over, (m,), m^2; 1: figures are per area already.
        nominal: Nominal areas of whole supports, which a yield force is divided by, (m,) or one number, m^2.
    """
    own = chosen.own_spring(law.spring.stiffness)
    if own is not None:
        return own_spring_law(chosen.type, law, own)
    if chosen.yield_point is not None:
        pressure, hardening = chosen.yield_point
        return yielding(law, per_area(pressure, nominal if chosen.yields_as_whole else areas), hardening, 1)
    if not chosen.bends:
        return law
    stiffness = law.spring.stiffness
    ramps, before = [Ramp(stiffness, 0.0)], 1.0
    for depth, factor in chosen.bends:
        ramps.append(Ramp((factor - before) * stiffness, depth))
        before = factor
    return RampLaw(law.spring, law.damper, law.adhesive, law.touch_depth, ramps=tuple(ramps))
