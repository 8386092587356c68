"""From the table [contact] of a case to the law that is marched."""

from __future__ import annotations

from solver.case_tables.contact import (
    AdamsImpact,
    AugmentedLagrangian,
    Contact,
    HuntCrossley,
    LankaraniNikravesh,
)
from solver.contact.dampers import ConstantDamper, HuntCrossleyDamper, SmoothStepDamper
from solver.contact.law import ContactLaw
from solver.contact.restitution import hunt_crossley_product, lankarani_nikravesh_product
from solver.contact.springs import Spring
from solver.system import Array


def make_law(contact: Contact, stiffness: float | Array, touch_depth: float) -> ContactLaw:
    """Return the contact law.

    Args:
        contact: The table of the case.
        stiffness: K of the case or its computed value, or gamma of Nitsche's method at each point, (m,).
        touch_depth: Depth over which `ContactLaw.endpoint` switches a damper that jumps on, m.
    """
    adhesive, chosen = contact.tension == "adhesive", contact.law
    augmented = contact.formulation.penetration if isinstance(contact.formulation, AugmentedLagrangian) else None
    if isinstance(chosen, HuntCrossley | LankaraniNikravesh):
        product = hunt_crossley_product if isinstance(chosen, HuntCrossley) else lankarani_nikravesh_product
        spring = Spring(stiffness, chosen.exponent)
        return ContactLaw(spring, HuntCrossleyDamper(spring, 0.0), adhesive, touch_depth, product(chosen.restitution))
    if isinstance(chosen, AdamsImpact):
        damper = SmoothStepDamper(chosen.damping, chosen.full_depth)
        return ContactLaw(Spring(stiffness, chosen.exponent), damper, adhesive, touch_depth)
    return ContactLaw(Spring(stiffness), ConstantDamper(contact.damping), adhesive, touch_depth, augmented=augmented)
