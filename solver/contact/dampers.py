"""The damped part of a contact law, per area: p = c(d) d' for d > 0.

Each damper has c(d), its slope and its integral C(d) = int_0^d c: over a step in which the penetration moves from
d0 to d1 the time mean of c(d) d' is (C(d1) - C(d0)) / dt, whatever the path in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.contact.springs import Spring
from solver.operators import Array


@dataclass(frozen=True)
class ConstantDamper:
    """Kelvin-Voigt: c(d) = c. Its pressure jumps at touch.

    Attributes:
        coefficient: c, Pa s/m, one number or one per contact point, (m,).
    """

    coefficient: float | Array = 0.0
    jumps = True

    def value(self, depth: Array) -> Array:
        """Return c(d)."""
        return np.where(depth > 0.0, self.coefficient, 0.0)

    def slope(self, depth: Array) -> Array:
        """Return dc/dd."""
        return np.zeros_like(depth)

    def integral(self, depth: Array) -> Array:
        """Return C(d) = c <d>."""
        return np.asarray(self.coefficient * np.maximum(depth, 0.0))


@dataclass(frozen=True)
class HuntCrossleyDamper:
    """c(d) = chi K d^n, in proportion to the elastic pressure (Hunt and Crossley 1975).

    Attributes:
        spring: K and n.
        factor: chi, s/m; one number or one per contact point.
    """

    spring: Spring
    factor: float | Array
    jumps = False

    def value(self, depth: Array) -> Array:
        """Return c(d)."""
        return np.asarray(self.factor * self.spring.pressure(depth))

    def slope(self, depth: Array) -> Array:
        """Return dc/dd."""
        return np.asarray(self.factor * self.spring.slope(depth))

    def integral(self, depth: Array) -> Array:
        """Return C(d) = chi psi(d)."""
        return np.asarray(self.factor * self.spring.potential(depth))


@dataclass(frozen=True)
class SmoothStepDamper:
    """c(d) = c_max q^2 (3 - 2 q), q = d / d_max clipped to [0, 1]: the damping of ADAMS's IMPACT function.

    Attributes:
        coefficient: c_max, Pa s/m, one number or one per contact point, (m,).
        full_depth: d_max, m.
    """

    coefficient: float | Array
    full_depth: float
    jumps = False

    def value(self, depth: Array) -> Array:
        """Return c(d)."""
        q = np.clip(depth / self.full_depth, 0.0, 1.0)
        return np.asarray(self.coefficient * q * q * (3.0 - 2.0 * q))

    def slope(self, depth: Array) -> Array:
        """Return dc/dd."""
        q = np.clip(depth / self.full_depth, 0.0, 1.0)
        return np.asarray(self.coefficient * 6.0 * q * (1.0 - q) / self.full_depth)

    def integral(self, depth: Array) -> Array:
        """Return C(d) = c_max d_max (q^3 - q^4 / 2) up to d_max, then linear."""
        q = np.clip(depth / self.full_depth, 0.0, 1.0)
        beyond = np.maximum(depth - self.full_depth, 0.0)
        return np.asarray(self.coefficient * (self.full_depth * q**3 * (1.0 - 0.5 * q) + beyond))


Damper = ConstantDamper | HuntCrossleyDamper | SmoothStepDamper
