"""Numerical damping ratio and period error of a time scheme, on a linear oscillator.

A step of a scheme takes the undamped oscillator u'' + w^2 u = 0 from y0 to y1 = A(w dt) y0. The pair of
eigenvalues of A with the largest modulus, exp((-z +- i) W dt), is the motion that the scheme marches: of damping
ratio z and frequency W instead of 0 and w. Its period is too long by w / W - 1.

Source: Hughes (1987), The Finite Element Method, section 9.3; Hilber and Hughes (1978).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gapbeam.solver.system.operators import Array

if TYPE_CHECKING:
    from gapbeam.solver.integrators.time_scheme import TimeScheme

LARGEST_ERROR = 1.0  # of a period; a motion without a period, or beyond stability, counts as this much off


class SchemeError(NamedTuple):
    """Numerical damping and period error of a scheme at given frequencies.

    Attributes:
        damping_ratio: z, no unit; negative where the motion grows, infinite where one step ends it.
        period_error: w / W - 1, no unit; infinite where there is no oscillation.
    """

    damping_ratio: Array
    period_error: Array


def scheme_error(scheme: TimeScheme, angles: Array) -> SchemeError:
    """Return damping ratio and period error of a scheme.

    Args:
        scheme: The time scheme.
        angles: w dt of each motion, (k,), > 0.
    """
    damping, error = np.empty(len(angles)), np.empty(len(angles))
    for place, angle in enumerate(angles):
        values = np.linalg.eigvals(scheme.amplification(float(angle)))
        swinging = values[np.imag(values) > 0.0]
        if not len(swinging):
            largest = float(np.max(np.abs(values)))
            damping[place], error[place] = np.inf if largest < 1.0 else -np.inf, np.inf
            continue
        pair = swinging[np.argmax(np.abs(swinging))]
        turned = float(np.angle(pair))
        damping[place] = -float(np.log(np.abs(pair))) / turned
        error[place] = float(angle) / turned - 1.0
    return SchemeError(damping, error)


def carried_error(scheme: TimeScheme, angles: Array, power: Array) -> tuple[float, float]:
    """Return the mean damping ratio and the mean size of the period error over a spectrum of kinetic energy.

        sum_j P_j z(w_j dt) / sum_j P_j,    sum_j P_j |w_j / W_j - 1| / sum_j P_j

    Args:
        scheme: The time scheme.
        angles: w dt of each line of the spectrum, (k,).
        power: P, its energy in any unit, (k,), >= 0.

    Returns:
        Both, each line counted up to 1; 0 where nothing moves.
    """
    total = float(np.sum(power))
    if total <= 0.0:
        return 0.0, 0.0
    found = scheme_error(scheme, angles)
    ratios, errors = (
        np.clip(x, -LARGEST_ERROR, LARGEST_ERROR) for x in (found.damping_ratio, np.abs(found.period_error))
    )
    return float(power @ ratios) / total, float(power @ errors) / total
