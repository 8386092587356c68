"""The law of a stop that yields: an elastic-plastic spring whose plastic set s stays.

    p = K <d - s>,    p <= p_y(s),    s grows so that p = p_y(s) where more would be needed

From a set s0, pressing goes up the elastic line K (d - s0), bends at the depth d_y = s0 / (1 - h) + p_y / K and goes on
with the slope h K; it returns along K (d - s). Over a step that starts with s0 the pressure is therefore a sum of two
ramps, K <d - s0> - (1 - h) K <d - d_y>, whose discrete gradient does exactly the work of pressing: elastic energy
K <d - s>^2 / 2 and plastic work. The set changes when a step is accepted: s1 = max(s0, (1 - h) (d1 - p_y / K)).

Source: Simo and Hughes (1998), Computational Inelasticity, ch. 1, for the return in one dimension.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.ramp_law import Ramp, RampLaw
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class YieldingLaw(RampLaw):
    """An elastic-plastic spring; midpoint rules march it.

    Attributes:
        yield_pressure: p_y of the spring without a set, Pa; number or (m,).
        hardening: h, slope of loading beyond it over K, 0 <= h < 1.
        plastic_set: s, (m,), m; None: no point has yielded.
    """

    yield_pressure: float | Array = np.inf
    hardening: float = 0.0
    plastic_set: Array | None = None

    @property
    def keeps_set(self) -> bool:
        """Yes: it remembers where contact has yielded."""
        return True

    @property
    def why_not_compiled(self) -> str | None:
        """Kernels do not carry sets."""
        return "a contact law that yields"

    @property
    def touches_at(self) -> float | Array:
        """The set: from there on the stop presses."""
        return 0.0 if self.plastic_set is None else self.plastic_set

    def yielded_by(self, plastic_set: Array | None) -> ContactLaw:
        """Return the law of points that have the sets s, (m,), m."""
        if plastic_set is None:
            return self
        stiffness, rest = self.spring.stiffness, 1.0 - self.hardening
        bends = plastic_set / rest + self.yield_pressure / stiffness
        ramps = (Ramp(stiffness, plastic_set), Ramp(-rest * stiffness, bends))
        return replace(self, ramps=ramps, plastic_set=plastic_set)

    def softened(self, share: float) -> YieldingLaw:
        """Return the law with a share of its stiffness and its yield pressure."""
        spring = Spring(share * self.spring.stiffness)
        return replace(self, spring=spring, yield_pressure=share * self.yield_pressure)

    def set_after(self, depth: Array) -> Array:
        """Return the sets that are left of penetrations d, (m,), m."""
        most = (1.0 - self.hardening) * (depth - self.yield_pressure / self.spring.stiffness)
        return np.maximum(most, self.touches_at)

    def closed_slope(self, depth: Array) -> Array:
        """Return K where closed: small vibrations do not yield, Pa/m."""
        return self.spring.slope(depth - self.touches_at)

    def potential(self, depth: Array) -> Array:
        """Return the elastic energy K <d - s>^2 / 2, J/m^2, with the set that the penetration leaves."""
        return self.spring.potential(depth - np.maximum(self.set_after(depth), 0.0))

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step; its elastic part does the work of the elastic energy alone."""
        stage, before = super().discrete_gradient(old, new, dt), self.touches_at
        after = np.maximum(self.set_after(new), before)
        mean, _ = self.spring.mean(old - before, new - before)
        first, last = np.maximum(old - before, 0.0), np.maximum(new - after, 0.0)
        deeper = np.where(after > before, new - old, 1.0)
        yields = 0.5 * self.spring.stiffness * (last + first) * ((last - first) / deeper)
        return stage._replace(elastic=np.where(after > before, yields, mean))

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure at the end of the step; what the set takes of its work is not elastic."""
        stage, before = super().implicit(old, new, dt), self.touches_at
        after = np.maximum(self.set_after(new), before)
        share = np.where(after > before, (after - before) / np.where(after > before, new - old, 1.0), 0.0)
        return stage._replace(elastic=stage.elastic * (1.0 - share))

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Refuse: only the work of midpoint steps is known.

        Raises:
            ValueError: Always.
        """
        raise ValueError(
            f"a contact law that yields at one instant ({len(depth)} depths, {len(rate)} rates, d'/d of {rate_slope:g} "
            "1/s); expected a midpoint rule, which knows its work"
        )


def yielding(law: ContactLaw, yield_pressure: float | Array, hardening: float, size: int) -> YieldingLaw:
    """Return a law whose spring yields, without a set yet.

    Args:
        law: Spring and damper.
        yield_pressure: p_y, Pa.
        hardening: h.
        size: Number of contact points, or 1 where all are the same.
    """
    plain = YieldingLaw(law.spring, law.damper, law.adhesive, law.touch_depth)
    plain = replace(plain, yield_pressure=yield_pressure, hardening=hardening)
    made = plain.yielded_by(np.zeros(size))
    assert isinstance(made, YieldingLaw)
    return made
