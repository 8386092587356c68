"""A contact law, per area: an elastic pressure, a damped one, and whether they may pull.

With the penetration d = -g, the closed law is

    p = e(d) + c(d) d'   for d > 0,   p = 0 otherwise,

clipped at p >= 0 unless the face may pull (`adhesive`). Each time scheme asks for the law in the form that it can
trust; clipped, all forms are non-decreasing in the penetration at the end of the step, so that the step has one
solution.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from solver.contact.dampers import ConstantDamper, Damper, HuntCrossleyDamper
from solver.contact.friction import CoulombFriction
from solver.contact.springs import Spring
from solver.operators import Array

UNDAMPED = ConstantDamper()
SLOWEST_TOUCH = 1.0e-4  # m/s; slower touches are damped as if they came with this speed


class StagePressure(NamedTuple):
    """A law evaluated at m points: pressure (Pa), its slope in the penetration (Pa/m), and its elastic part (Pa)."""

    pressure: Array
    slope: Array
    elastic: Array


@dataclass(frozen=True)
class ContactLaw:
    """Spring, damper and clipping.

    Attributes:
        spring: e(d).
        damper: c(d).
        adhesive: True: the damper pulls while the face separates; False: p is clipped at zero.
        touch_depth: Depth over which `endpoint` switches a damper that jumps at touch on, m.
        touch_product: p = chi v0 of a damper whose chi follows from the speed v0 at touch of each point; None: chi is
            given.
        stores_energy: False where the scheme puts impulses in the place of the spring.
        friction: Traction along the face; None: none.
        augmented: Penetration that multipliers shall leave, relative to that of the penalty alone; None: none are used.
    """

    spring: Spring
    damper: Damper = UNDAMPED
    adhesive: bool = False
    touch_depth: float = 1.0e-8
    touch_product: float | None = None
    augmented: float | None = None
    stores_energy: bool = True
    friction: CoulombFriction | None = None

    @property
    def stiffness(self) -> float:
        """K of the spring; the largest where points differ."""
        return float(np.max(self.spring.stiffness))

    def touched_at(self, speed: Array | None) -> ContactLaw:
        """Return the law for contacts that began at these speeds, (m,), m/s; itself where that makes no difference."""
        if self.touch_product is None or speed is None:
            return self
        factor = self.touch_product / np.maximum(speed, SLOWEST_TOUCH)
        return replace(self, damper=HuntCrossleyDamper(self.spring, factor))

    def potential(self, depth: Array) -> Array:
        """Return psi(d), J/m^2."""
        return self.spring.potential(depth) if self.stores_energy else np.zeros_like(depth)

    def static(self, depth: Array) -> StagePressure:
        """Return p = e(d): the law at rest."""
        pressure = self.spring.pressure(depth)
        return StagePressure(pressure, self.spring.slope(depth), pressure)

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step whose elastic part does exactly the work psi(d1) - psi(d0).

        p = (psi(d1) - psi(d0)) / (d1 - d0) + (C(d1) - C(d0)) / dt,  C' = c.

        Args:
            old: d0 at the start of the step, (m,), m.
            new: d1 at its end, (m,), m.
            dt: Step, s.

        Source: Simo and Tarnow (1992); Gonzalez (1996) for the discrete gradient of a scalar potential.
        """
        return self._with_damping(*self.spring.mean(old, new), old, new, dt)

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure with the elastic part at the end of the step, p = e(d1) + (C(d1) - C(d0)) / dt."""
        return self._with_damping(self.spring.pressure(new), self.spring.slope(new), old, new, dt)

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Return the law at one instant, p = chi(d) <e(d) + c(d) d'>.

        For a damper that jumps at touch, chi rises linearly from 0 to 1 over `touch_depth`: that keeps the clipped
        law non-decreasing in d. For others chi = 1.

        Args:
            depth: d, (m,), m.
            rate: d', (m,), m/s.
            rate_slope: Derivative of d' with respect to d in the scheme, 1/s.
        """
        if not self._damped:
            return self.static(depth)
        elastic, damping = self.spring.pressure(depth), self.damper.value(depth)
        bracket = elastic + damping * rate
        slope = self.spring.slope(depth) + damping * rate_slope + self.damper.slope(depth) * rate
        slope = np.maximum(slope, 0.0)
        if not self.adhesive:
            slope = np.where(bracket > 0.0, slope, 0.0)
            bracket = np.maximum(bracket, 0.0)
        if not self.damper.jumps:
            return StagePressure(bracket, slope, elastic)
        share = np.clip(depth / self.touch_depth, 0.0, 1.0)
        share_slope = np.where((depth > 0.0) & (depth < self.touch_depth), 1.0 / self.touch_depth, 0.0)
        return StagePressure(share * bracket, share * slope + share_slope * bracket, elastic)

    @property
    def _damped(self) -> bool:
        return not (isinstance(self.damper, ConstantDamper) and not np.any(self.damper.coefficient))

    def _with_damping(self, elastic: Array, slope: Array, old: Array, new: Array, dt: float) -> StagePressure:
        if not self._damped:
            return StagePressure(elastic, slope, elastic)
        pressure = elastic + (self.damper.integral(new) - self.damper.integral(old)) / dt
        slope = slope + self.damper.value(new) / dt
        if not self.adhesive:
            slope = np.where(pressure > 0.0, slope, 0.0)
            pressure = np.maximum(pressure, 0.0)
        return StagePressure(pressure, slope, elastic)


def kelvin_voigt(
    stiffness: float, damping: float = 0.0, adhesive: bool = False, touch_depth: float = 1.0e-8
) -> ContactLaw:
    """Return p = eps d + c d', with eps in Pa/m and c in Pa s/m."""
    return ContactLaw(Spring(stiffness), ConstantDamper(damping), adhesive, touch_depth)
