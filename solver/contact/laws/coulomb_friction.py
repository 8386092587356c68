"""Coulomb friction, regularized: the traction along the face opposes the slip velocity v.

    t = -mu <p> v / sqrt(|v|^2 + v0^2)

It is minus the gradient in v of the convex pseudo-potential mu <p> sqrt(|v|^2 + v0^2), so that t . v <= 0 whatever the
pressure is: friction only takes energy. Where |v| is far above v0 the traction is mu p; below, the face creeps: under a
share q < 1 of the limit at v0 q / sqrt(1 - q^2), and comes to rest under none.

Source: Kikuchi and Oden (1988), Contact Problems in Elasticity, ch. 10, for the regularization.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.system.operators import Array

NOTHING = 1.0e-250  # N or Pa; below it numbers lose their digits


@dataclass(frozen=True)
class CoulombFriction:
    """Coefficient and regularization.

    Attributes:
        coefficient: mu >= 0, one number or one of each point, (m,), no unit.
        slip_velocity: v0 > 0, m/s.
    """

    coefficient: float | Array
    slip_velocity: float

    def limit(self, normal: Array) -> Array:
        """Return mu <p>, (m,), what the traction cannot exceed; or mu <f> for point forces f."""
        return np.where(normal > NOTHING, self.coefficient * normal, 0.0)

    def speed(self, slip: Array) -> Array:
        """Return sqrt(|v|^2 + v0^2), (m,), m/s."""
        return np.asarray(np.sqrt(np.sum(slip * slip, axis=1) + self.slip_velocity**2))

    def direction(self, slip: Array) -> Array:
        """Return v / sqrt(|v|^2 + v0^2), (m, k): the gradient of `speed`, shorter than 1."""
        return np.asarray(slip / self.speed(slip)[:, None])

    def traction(self, normal: Array, slip: Array) -> Array:
        """Return t, (m, k), in the unit of the first argument.

        Args:
            normal: Pressure or normal force at each point, (m,).
            slip: Slip velocity v, (m, k), m/s.
        """
        return -self.limit(normal)[:, None] * self.direction(slip)
