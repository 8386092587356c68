"""Connors' formula: a linear check of fluidelastic stability without gaps, in addition to eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.flow_span import FlowSpan
from gapbeam.solver.scene.given_numbers import finite, positive


@dataclass(frozen=True)
class ConnorsMargin:
    """Critical velocity by Connors' formula.

    Attributes:
        critical: Velocity at which the formula expects instability, m/s.
        effective: Velocity of the flow, weighted with the shape of the mode, m/s; NaN without a velocity.
        ratio: effective / critical: below 1 is stable, by this formula.
    """

    critical: float
    effective: float
    ratio: float


@checked
def connors(
    *, K: float, frequency: float, mass: float, decrement: float, diameter: float, density: float,
    velocity: float | None = None, span: FlowSpan | None = None, shape: ArrayLike | None = None,
) -> ConnorsMargin:  # fmt: skip
    """Return the critical velocity U = K f D sqrt(m delta / (rho D^2)), and the ratio of a velocity to it.

    With a span and the shape phi of a mode at its points, the effective velocity is

        U_e^2 = int rho(x)/rho U(x)^2 phi^2 dx / int phi^2 dx

    over this span, which is on the safe side where the flow covers a part of the tube. A check beside
    `critical_velocity`: the formula knows neither gaps nor phases.

    Args:
        K: Connors' constant, of the bundle; 3.0 is usual in design.
        frequency: f, angular, rad/s.
        mass: m, with the added mass, per length, kg/m.
        decrement: delta, logarithmic, 2 pi zeta; in two-phase flow with its two-phase part, an input with a source.
        diameter: D, m.
        density: rho, kg/m^3.
        velocity: Reference velocity, m/s.
        span: Where the profiles are.
        shape: phi at the points of the span, (points,); default 1.

    Raises:
        UserError: A value is out of range, or a shape does not fit.

    Source: Connors (1970), ASME Flow-Induced Vibration in Heat Exchangers, 42; Pettigrew and Taylor (2003), J. Fluids
    Struct. 18, 61.
    """
    given: dict[str, Any] = {
        "K": K, "frequency": frequency, "mass": mass, "decrement": decrement, "diameter": diameter, "density": density,
    }  # fmt: skip
    k, w, m, delta, D, rho = (float(positive(value, f"connors: {name}")) for name, value in given.items())
    critical = k * w / (2.0 * pi) * D * sqrt(m * delta / (rho * D * D))
    if velocity is None:
        return ConnorsMargin(critical, float("nan"), float("nan"))
    effective = float(positive(velocity, "connors: velocity"))
    if span is not None:
        phi = np.ones(len(span.points)) if shape is None else finite(shape, "connors: shape")
        if phi.shape != (len(span.points),):
            raise UserError(f"connors: found a shape of {phi.size} values, expected one for each of {len(span.points)}")
        weight = span.lengths * phi**2
        effective *= sqrt(float(weight @ (span.density * span.velocity**2)) / float(weight.sum()))
    return ConnorsMargin(critical, effective, effective / critical)
