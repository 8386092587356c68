"""An elastic pressure that a law brings, with its slope and its potential, where it is not K d^n."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gapbeam.solver.contact.laws.integral_check import SHARES, compared
from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array

AGREES = 1.0e-6  # of the largest value: how well potential, pressure and slope belong together


@dataclass(frozen=True)
class OwnSpring:
    """An elastic pressure, per area, for penetrations d > 0; each function takes depths (..., m) of m points.

    Attributes:
        pressure: e(d), Pa; 0 at d = 0, and it does not fall.
        slope: e'(d), Pa/m.
        potential: psi(d) = int_0^d e, J/m^2.
    """

    pressure: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    potential: Callable[[Array], Array]

    def scaled(self, share: float) -> OwnSpring:
        """Return a spring with a share of the pressure."""
        return OwnSpring(
            lambda d: share * self.pressure(d), lambda d: share * self.slope(d), lambda d: share * self.potential(d)
        )

    def check(self, name: str, depth: float) -> None:
        """Refuse functions that do not belong together, about a depth, m.

        Args:
            name: Of the law.
            depth: Touch depth of the law, m.

        Raises:
            UserError: The potential is not the integral of the pressure, or the slope not its derivative, or the
                pressure falls, is negative, or is not 0 at touch.
        """
        high = depth * 2.0 ** np.arange(-8.0, 16.0)[:, None]
        low = 0.75 * high
        pressure = self.pressure(low + SHARES[:, None, None] * (high - low))
        largest = np.abs(pressure).max(axis=0)
        stored = compared(self.pressure, self.potential, high, AGREES)
        risen = compared(self.slope, self.pressure, high, AGREES)
        at_touch = np.abs(self.pressure(1.0e-12 * high[:1])) + np.zeros_like(largest)
        wrong = {
            "a potential that is not the integral of the pressure": stored.differ | ~np.any(stored.judged, axis=0),
            "a slope that is not the derivative of the pressure": risen.differ | ~np.any(risen.judged, axis=0),
            "a pressure that falls, or is negative": (pressure.min(axis=0) < 0.0) | (self.slope(high) < 0.0),
            "a pressure at touch": at_touch > AGREES * largest[-1],
        }
        for found, where in wrong.items():
            if np.any(where):
                place = float(high[int(np.argmax(np.any(where, axis=1))), 0])
                raise UserError(
                    f"the law {name}: found {found}, near a penetration of {place:.3g} m; expected e(d) >= 0 that does "
                    "not fall from e(0) = 0, e'(d), and psi(d) with psi' = e, for d > 0"
                )
