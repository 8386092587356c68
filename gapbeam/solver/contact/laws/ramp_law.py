"""Laws whose elastic pressure is piecewise linear in the penetration: a sum of ramps, p = sum_j k_j <d - b_j>.

Each ramp is a linear spring that begins at a depth. Its potential and its discrete gradient are known in closed form
(`springs`), and so are those of the sum: a midpoint step conserves the energy of such a contact at any step.

A stop that yields is an elastic-plastic spring whose plastic set s stays:

    p = K <d - s>,    p <= p_y(s),    s grows so that p = p_y(s) where more would be needed

From a set s0, pressing goes up the elastic line K (d - s0), bends at the depth d_y = s0 / (1 - h) + p_y / K and goes on
with the slope h K; it returns along K (d - s). Over a step that starts with s0 the pressure is therefore a sum of two
ramps, K <d - s0> - (1 - h) K <d - d_y>, whose discrete gradient does exactly the work of pressing: elastic energy
K <d - s>^2 / 2 and plastic work. The set changes when a step is accepted: s1 = max(s0, (1 - h) (d1 - p_y / K)).

Source: Simo and Hughes (1998), Computational Inelasticity, ch. 1, for the return in one dimension.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.damper import per_area
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.contact.laws.own_spring_law import own_spring_law
from gapbeam.solver.contact.laws.point_law import LawTable
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.system.operators import Array


class Ramp(NamedTuple):
    """A spring k <d - b>: its stiffness k, Pa/m, of any sign, and the depth b where it begins, m; numbers or (m,)."""

    stiffness: float | Array
    begins: float | Array


@dataclass(frozen=True)
class RampLaw(ContactLaw):
    """A sum of ramps with a constant damper; `spring` is the first of them.

    Attributes:
        ramps: The ramps. Their sum does not fall.
    """

    ramps: tuple[Ramp, ...] = ()

    @property
    def linear(self) -> bool:
        """No: its stiffness depends on the penetration."""
        return False

    @property
    def why_not_compiled(self) -> str | None:
        """Kernels take springs K d^n."""
        return "a contact law that is piecewise linear"

    @property
    def touches_at(self) -> float | Array:
        """Depth from which the law presses and its damper acts, m; number or (m,)."""
        return 0.0

    def softened(self, share: float) -> RampLaw:
        """Return the law with a share of its stiffness."""
        ramps = tuple(Ramp(share * one.stiffness, one.begins) for one in self.ramps)
        return replace(self, spring=Spring(share * self.spring.stiffness), ramps=ramps)

    def potential(self, depth: Array) -> Array:
        """Return psi(d) = sum_j k_j <d - b_j>^2 / 2, J/m^2."""
        return np.asarray(sum(Spring(one.stiffness).potential(depth - one.begins) for one in self.ramps))

    def damping(self, depth: Array) -> Array:
        """Return c(d), Pa s/m."""
        return np.where(depth > self.touches_at, self.damper.coefficient, 0.0)

    def static(self, depth: Array) -> StagePressure:
        """Return p = e(d): the law at rest."""
        parts = [Spring(one.stiffness).pressure_and_slope(depth - one.begins) for one in self.ramps]
        pressure = np.asarray(sum(part[0] for part in parts))
        return StagePressure(pressure, np.maximum(sum(part[1] for part in parts), 0.0), pressure)

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step whose elastic part does exactly the work psi(d1) - psi(d0)."""
        parts = [Spring(one.stiffness).mean(old - one.begins, new - one.begins) for one in self.ramps]
        mean, slope = np.asarray(sum(part[0] for part in parts)), np.asarray(sum(part[1] for part in parts))
        return self._damped(StagePressure(mean, np.maximum(slope, 0.0), mean), old, new, dt)

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure with the elastic part at the end of the step."""
        return self._damped(self.static(new), old, new, dt)

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Return the law at one instant, p = chi(d) <e(d) + c d'>; see `ContactLaw.endpoint`."""
        elastic, damping = self.static(depth), self.damping(depth)
        bracket = elastic.pressure + damping * rate
        slope = np.maximum(elastic.slope + damping * rate_slope, 0.0)
        if not self.adhesive:
            pressed = bracket > 0.0
            bracket, slope = np.where(pressed, bracket, 0.0), np.where(pressed, slope, 0.0)
        if not np.any(self.damper.coefficient):
            return StagePressure(bracket, slope, elastic.pressure)
        share = np.clip((depth - self.touches_at) / self.touch_depth, 0.0, 1.0)
        rising = np.where((share > 0.0) & (share < 1.0), 1.0 / self.touch_depth, 0.0)
        return StagePressure(share * bracket, share * slope + rising * bracket, elastic.pressure)

    def table(self, size: int) -> LawTable:
        """Refuse: kernels take springs K d^n.

        Raises:
            ValueError: Always.
        """
        raise ValueError(f"{self.why_not_compiled} at {size} points has no table; expected a spring K d^n")

    def _damped(self, elastic: StagePressure, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure of a step with (C(d1) - C(d0)) / dt added, clipped unless the damper may pull."""
        coefficient = self.damper.coefficient
        if not np.any(coefficient):
            return elastic
        before, after = np.maximum(old - self.touches_at, 0.0), np.maximum(new - self.touches_at, 0.0)
        pressure = elastic.pressure + coefficient * (after - before) / dt
        slope = elastic.slope + np.where(after > 0.0, coefficient / dt, 0.0)
        if not self.adhesive:
            pressed = pressure > 0.0
            pressure, slope = np.where(pressed, pressure, 0.0), np.where(pressed, slope, 0.0)
        return StagePressure(pressure, slope, elastic.elastic)


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
