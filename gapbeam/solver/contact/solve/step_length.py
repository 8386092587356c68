"""Length of a step at which a slope along it crosses zero: scipy.optimize takes longer to load than most seats."""

from __future__ import annotations

import sys
from collections.abc import Callable

WITHIN = 1.0e-12  # of the whole step
ROUND_OFF = sys.float_info.epsilon


def root_of_slope(slope: Callable[[float], float]) -> float:
    """Return the length in [0, 1] at which a continuous slope crosses zero.

    By the method of Chandrupatla (1997): inverse quadratic interpolation where it is safe, bisection elsewhere.

    Args:
        slope: Slope, with different signs at 0 and at 1.

    Raises:
        ValueError: The slope has the same sign at both ends.
    """
    a, b, part = 1.0, 0.0, 0.5  # the last point, the one beyond the root, and where to look between them
    at_a, at_b = slope(a), slope(b)
    if not at_a * at_b <= 0.0:
        raise ValueError(f"no root between the slopes {at_b:.6g} and {at_a:.6g}")
    while True:
        x = a + part * (b - a)
        at_x = slope(x)
        if (at_x > 0.0) == (at_a > 0.0):
            c, at_c = a, at_a
        else:
            c, at_c, b, at_b = b, at_b, a, at_a
        a, at_a = x, at_x
        best, at_best = (a, at_a) if abs(at_a) < abs(at_b) else (b, at_b)
        least = (2.0 * ROUND_OFF * best + 0.5 * WITHIN) / abs(b - a)
        if at_best == 0.0 or least > 0.5:
            return best
        xi, phi = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
        part = 0.5
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            part = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            part += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
        part = min(max(part, least), 1.0 - least)
