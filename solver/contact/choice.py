"""From the table [contact] of a case to the law that is marched."""

from __future__ import annotations

import numpy as np

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
from solver.operators import Array


def make_law(
    contact: Contact,
    stiffness: float | Array,
    touch_depth: float,
    damping: float = 0.0,
    areas: Array | None = None,
) -> ContactLaw:
    """Return the contact law, per area.

    Args:
        contact: The table of the case.
        stiffness: K of the case or its computed value, or gamma of Nitsche's method at each point, (m,).
        touch_depth: Depth over which `ContactLaw.endpoint` switches a damper that jumps on, m.
        damping: c of the law kelvin-voigt, given or computed.
        areas: Areas that resultants at points are spread over, (m,), m^2: K in N/m^n and c in N s/m are divided by
            them. None: K and c are per area already.
    """
    adhesive, chosen = contact.tension == "adhesive", contact.law
    augmented = contact.formulation.penetration if isinstance(contact.formulation, AugmentedLagrangian) else None
    spring = Spring(_per_area(stiffness, areas), getattr(chosen, "exponent", 1.0))
    if isinstance(chosen, HuntCrossley | LankaraniNikravesh):
        product = hunt_crossley_product if isinstance(chosen, HuntCrossley) else lankarani_nikravesh_product
        return ContactLaw(spring, HuntCrossleyDamper(spring, 0.0), adhesive, touch_depth, product(chosen.restitution))
    if isinstance(chosen, AdamsImpact):
        stepped = SmoothStepDamper(_per_area(chosen.damping, areas), chosen.full_depth)
        return ContactLaw(spring, stepped, adhesive, touch_depth)
    damper = ConstantDamper(_per_area(damping, areas))
    return ContactLaw(spring, damper, adhesive, touch_depth, augmented=augmented)


def _per_area(value: float | Array, areas: Array | None) -> float | Array:
    return value if areas is None else np.asarray(value / areas)
