"""Damping and friction of a contact law, per area.

The damped pressure is p = c(d) d' for d > 0, with c(d) by the formula of a law. Each law writes c(d), its slope and its
integral C(d) = int_0^d c at one point, in its own file. Over a step in which the penetration moves from d0 to d1 the
time mean of c(d) d' is (C(d1) - C(d0)) / dt, whatever the path in between.

Coulomb friction is regularized: the traction along the face opposes the slip velocity v,

    t = -mu <p> v / sqrt(|v|^2 + v0^2)

It is minus the gradient in v of the convex pseudo-potential mu <p> sqrt(|v|^2 + v0^2), so that t . v <= 0 whatever the
pressure is: friction only takes energy. Where |v| is far above v0 the traction is mu p; below, the face creeps: under a
share q < 1 of the limit at v0 q / sqrt(1 - q^2), and comes to rest under none.

With a static coefficient mu_s > mu each point sticks or slides. The state is held during a step and changes when the
step is accepted, by the slip velocity v of its balance:

    slides   |v| > 10 v0 in the last two steps, and not in opposite directions
    sticks   otherwise

In every step the potential is thus convex, and friction only takes energy. While a point sticks, sqrt(1.01) mu_s stands
instead of mu: at |v| = 10 v0, where it breaks away, the traction is mu_s p. A single step does not count, since
what the midpoint schemes leave of a velocity at rest adds an alternating force to the traction.

Source: Kikuchi and Oden (1988), Contact Problems in Elasticity, ch. 10, for the regularization.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np

from gapbeam.solver.system.operators import Array

Parameters = tuple[float, float, float, float]
ROOM = 4  # parameters of a formula, those that it does not use are 0


class DampedPoint(NamedTuple):
    """Arguments of a damping formula at a contact point, besides the penetration.

    Attributes:
        stiffness: K of the spring, Pa/m^n.
        exponent: n of the spring.
        coefficient: Coefficient of the damper at this point; the law defines its meaning.
        parameters: Parameters of the damper that are the same at all points.
    """

    stiffness: float
    exponent: float
    coefficient: float
    parameters: Parameters


@dataclass(frozen=True)
class Damper:
    """A damper: the formula of a law with its numbers.

    Attributes:
        law: Name of the law in a case file, whose formula it is.
        coefficient: One number or one per contact point, (m,).
        parameters: Parameters that are the same at all points, at most `ROOM` numbers.
    """

    law: str
    coefficient: float | Array = 0.0
    parameters: tuple[float, ...] = ()


def padded(law: str, parameters: tuple[float, ...]) -> Parameters:
    """Return the `ROOM` parameters of a formula of a law.

    Raises:
        ValueError: The law has more than `ROOM` parameters.
    """
    if len(parameters) > ROOM:
        raise ValueError(f"{len(parameters)} parameters of the law {law}; expected at most {ROOM}")
    first, second, third, fourth = (*map(float, parameters), *(0.0,) * (ROOM - len(parameters)))
    return first, second, third, fourth


NO_DAMPER = Damper("kelvin-voigt")


def per_area(value: float | Array, areas: float | Array) -> float | Array:
    """Return the value per area of resultants at points, over areas, (m,), m^2; or over 1 where it is per area."""
    return cast("float | Array", value / areas)


NOTHING = 1.0e-250  # N or Pa; below it numbers lose their digits
BREAKS_AWAY = 10.0  # times v0: above it a point slides


@dataclass(frozen=True)
class CoulombFriction:
    """Coefficient and regularization.

    Attributes:
        coefficient: mu >= 0, one number or one of each point, (m,), no unit.
        slip_velocity: v0 > 0, m/s.
        static_coefficient: mu_s >= mu of points that stick, one number or one of each point, (m,); None: mu.
    """

    coefficient: float | Array
    slip_velocity: float
    static_coefficient: float | Array | None = None

    def of_points(self, slides: Array | None) -> CoulombFriction:
        """Return the law of points that stick or slide during a step; itself where that makes no difference.

        Args:
            slides: Amount of sliding, (m,), no unit: above 0 where a point slides; None: nothing is known.
        """
        if self.static_coefficient is None or slides is None:
            return self
        alike = (slides > 0.0) | (np.asarray(self.static_coefficient) <= self.coefficient)
        sticking = np.hypot(1.0, 1.0 / BREAKS_AWAY) * self.static_coefficient
        return replace(self, coefficient=np.where(alike, self.coefficient, sticking), static_coefficient=None)

    def sliding_after(self, slip: Array, before: Array | None = None) -> Array:
        """Return 1 for points that slide after a step and 0 for points that stick, (m,).

        Args:
            slip: Slip velocity in the balance of the step, (m, k), m/s.
            before: Slip velocity of the step before, (m, k), m/s; None: no step was before, and what moves fast slides.
        """
        before = slip if before is None else before
        slowest = (BREAKS_AWAY * self.slip_velocity) ** 2
        fast = (np.sum(slip * slip, axis=1) > slowest) & (np.sum(before * before, axis=1) > slowest)
        return np.where(fast & (np.sum(slip * before, axis=1) >= 0.0), 1.0, 0.0)

    def limit(self, normal: Array) -> Array:
        """Return mu <p>, (m,), the largest traction; or mu <f> for point forces f."""
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
