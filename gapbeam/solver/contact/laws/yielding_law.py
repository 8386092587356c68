"""Laws that yield, and the law of a table with the elastic pressure that it asks for; formulas in `point_law`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.damper import per_area
from gapbeam.solver.contact.laws.law_choice import FORMULAS, HUNT_CROSSLEY
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.contact.laws.own_spring import check_spring
from gapbeam.solver.contact.laws.point_law import LawNumbers, LawTable
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class YieldingLaw(ContactLaw):
    """An elastic-plastic spring; midpoint rules march it.

    Attributes:
        yield_pressure: p_y of the spring without a set, Pa; number or (m,).
        hardening: h, slope of loading beyond it over K, 0 <= h < 1.
        plastic_set: s, (m,), m; 0: no point has yielded.
    """

    yield_pressure: float | Array = np.inf
    hardening: float = 0.0
    plastic_set: float | Array = 0.0

    @property
    def bends(self) -> bool:
        """Yes: it yields."""
        return True

    @property
    def keeps_set(self) -> bool:
        """Yes: it remembers where contact has yielded."""
        return True

    def yielded_by(self, plastic_set: Array | None) -> ContactLaw:
        """Return the law of points that have the sets s, (m,), m."""
        return self if plastic_set is None else replace(self, plastic_set=plastic_set)

    def softened(self, share: float) -> YieldingLaw:
        """Return the law with a share of its stiffness and its yield pressure."""
        spring = replace(self.spring, stiffness=share * self.spring.stiffness)
        return replace(self, spring=spring, yield_pressure=share * self.yield_pressure)

    def set_after(self, depth: Array) -> Array:
        """Return the sets that are left of penetrations d, (m,), m."""
        most = (1.0 - self.hardening) * (depth - self.yield_pressure / self.spring.stiffness)
        return np.maximum(most, self.plastic_set)

    def closed_slope(self, depth: Array) -> Array:
        """Return K where closed: small vibrations do not yield, Pa/m."""
        return np.where(depth > self.plastic_set, self.spring.stiffness, 0.0)

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Refuse: only the work of midpoint steps is known.

        Raises:
            ValueError: Always.
        """
        raise ValueError(
            f"a contact law that yields at one instant ({len(depth)} depths, {len(rate)} rates, d'/d of {rate_slope:g} "
            "1/s); expected a midpoint rule, which knows its work"
        )

    def _table(self, size: int) -> LawTable:
        yielding = np.empty((size, 2))
        yielding[:, 0], yielding[:, 1] = self.plastic_set, self.yield_pressure / self.spring.stiffness
        return super()._table(size)._replace(yielding=yielding)

    @property
    def numbers(self) -> LawNumbers:
        """Numbers of the law that are the same at all its points."""
        return super().numbers._replace(softer=1.0 - self.hardening)


def shaped_law(
    chosen: ChosenLaw, law: ContactLaw, areas: float | Array = 1.0, nominal: float | Array = 1.0
) -> ContactLaw:
    """Return a law with the elastic pressure of its table; the law itself for most.

    Args:
        chosen: The table.
        law: Its spring and its damper, of `contact_law.make_law`.
        areas: Areas that resultants at points are spread over, (m,), m^2; 1: figures are per area already.
        nominal: Nominal areas of whole supports, which a yield force is divided by, (m,) or one number, m^2.

    Raises:
        UserError: The spring is that of the law, and its functions do not belong together, or the damper is in
            proportion to K d^n.
    """
    if law.spring.law:
        _check_own(law)
    if chosen.yield_point is not None:
        pressure, hardening = chosen.yield_point
        plain = YieldingLaw(law.spring, law.damper, law.adhesive, law.touch_depth, hardening=hardening)
        return replace(plain, yield_pressure=per_area(pressure, nominal if chosen.yields_as_whole else areas))
    if not chosen.bends:
        return law
    factors = [1.0, *(factor for _, factor in chosen.bends)]
    ramps = tuple((float(rise), depth) for rise, (depth, _) in zip(np.diff(factors), chosen.bends, strict=True))
    return replace(law, ramps=ramps)


def _check_own(law: ContactLaw) -> None:
    name, shape = law.spring.law, ContactLaw(replace(law.spring, stiffness=1.0))
    if FORMULAS[law.damper.law] == HUNT_CROSSLEY and np.any(law.damper.coefficient):
        known = " or ".join(one for one, formula in FORMULAS.items() if formula != HUNT_CROSSLEY)
        raise UserError(
            f"the law {name}: found the damper {law.damper.law}, chi K d^n, beside a spring of its own; expected the "
            f"damper {known}, or one of its own"
        )
    check_spring(
        name, law.touch_depth, lambda d: shape.static(d).pressure, lambda d: shape.static(d).slope, shape.potential
    )
