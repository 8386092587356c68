"""Linear contact stiffness with Kelvin-Voigt damping, per area.

With the penetration d = -g, the closed law is

    p = eps d + c d'   for d > 0,   p = 0 otherwise,

clipped at p >= 0 unless the face may pull (`adhesive`). Each time scheme asks for the law in the form that it
can trust; all forms are non-decreasing in the penetration at the end of the step when they are clipped, so that
the step has one solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solver.system import Array


class StagePressure(NamedTuple):
    """A law evaluated at m points: pressure (Pa), its slope in the penetration (Pa/m), and its elastic part (Pa)."""

    pressure: Array
    slope: Array
    elastic: Array


@dataclass(frozen=True)
class KelvinVoigt:
    """Stiffness eps (Pa/m), damping c (Pa s/m), and whether the damper may pull.

    Attributes:
        stiffness: eps > 0, Pa/m.
        damping: c >= 0, Pa s/m.
        adhesive: True: the damper pulls while the face separates; False: p is clipped at zero.
        touch_depth: Depth over which `endpoint` switches the damped law on, m.
    """

    stiffness: float
    damping: float = 0.0
    adhesive: bool = False
    touch_depth: float = 1.0e-8

    def potential(self, depth: Array) -> Array:
        """Return psi(d) = eps <d>^2 / 2, J/m^2."""
        closed = np.maximum(depth, 0.0)
        return np.asarray(0.5 * self.stiffness * closed * closed)

    def static(self, depth: Array) -> StagePressure:
        """Return p = eps <d>: the law at rest."""
        closed = depth > 0.0
        pressure = np.where(closed, self.stiffness * depth, 0.0)
        return StagePressure(pressure, np.where(closed, self.stiffness, 0.0), pressure)

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step that does exactly the work psi(d1) - psi(d0).

        p = (psi(d1) - psi(d0)) / (d1 - d0) + c (<d1> - <d0>) / dt,

        written without cancellation. The damping term is the exact time mean of c d' over the part of the step
        spent in contact, for a penetration that changes linearly.

        Args:
            old: d0 at the start of the step, (m,), m.
            new: d1 at its end, (m,), m.
            dt: Step, s.

        Source: Simo and Tarnow (1992); Gonzalez (1996) for the discrete gradient of a scalar potential.
        """
        start, end = np.maximum(old, 0.0), np.maximum(new, 0.0)
        half = 0.5 * self.stiffness
        apart = np.where((old > 0.0) != (new > 0.0), np.abs(new - old), 1.0)
        lands, leaves, stays = (
            (old <= 0.0) & (new > 0.0),
            (old > 0.0) & (new <= 0.0),
            (old > 0.0) & (new > 0.0),
        )
        elastic = np.where(stays, half * (end + start), half * (end * end + start * start) / apart)
        slope = np.select(
            [stays, lands, leaves],
            [
                half,
                half * (end * end - 2.0 * old * end) / (apart * apart),
                half * start * start / (apart * apart),
            ],
            0.0,
        )
        return self._with_damping(elastic, slope, start, end, dt)

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure p = eps <d1> + c (<d1> - <d0>) / dt: the elastic part at the end of the step."""
        start, end = np.maximum(old, 0.0), np.maximum(new, 0.0)
        slope = np.where(new > 0.0, self.stiffness, 0.0)
        return self._with_damping(self.stiffness * end, slope, start, end, dt)

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Return the law at one instant, p = chi(d) <eps d + c d'>.

        chi rises linearly from 0 to 1 over `touch_depth`: the jump of the damped law at touch is spread over a
        tiny depth, which keeps the clipped law non-decreasing in d.

        Args:
            depth: d, (m,), m.
            rate: d', (m,), m/s.
            rate_slope: Derivative of d' with respect to d in the scheme, 1/s.
        """
        if self.damping == 0.0:
            return self.static(depth)
        share = np.clip(depth / self.touch_depth, 0.0, 1.0)
        bracket = self.stiffness * depth + self.damping * rate
        bracket_slope = np.full_like(depth, self.stiffness + self.damping * rate_slope)
        if not self.adhesive:
            bracket_slope = np.where(bracket > 0.0, bracket_slope, 0.0)
            bracket = np.maximum(bracket, 0.0)
        share_slope = np.where((depth > 0.0) & (depth < self.touch_depth), 1.0 / self.touch_depth, 0.0)
        return StagePressure(
            share * bracket,
            share * bracket_slope + share_slope * bracket,
            self.stiffness * np.maximum(depth, 0.0),
        )

    def _with_damping(self, elastic: Array, slope: Array, start: Array, end: Array, dt: float) -> StagePressure:
        if self.damping == 0.0:
            return StagePressure(elastic, slope, elastic)
        pressure = elastic + (self.damping / dt) * (end - start)
        slope = slope + np.where(end > 0.0, self.damping / dt, 0.0)
        if not self.adhesive:
            slope = np.where(pressure > 0.0, slope, 0.0)
            pressure = np.maximum(pressure, 0.0)
        return StagePressure(pressure, slope, elastic)
