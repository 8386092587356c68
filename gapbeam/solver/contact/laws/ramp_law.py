"""Laws whose elastic pressure is piecewise linear in the penetration: a sum of ramps, p = sum_j k_j <d - b_j>.

Each ramp is a linear spring that begins at a depth. Its potential and its discrete gradient are known in closed form
(`springs`), and so are those of the sum: a midpoint step conserves the energy of such a contact at any step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
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
