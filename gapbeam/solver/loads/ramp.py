"""Smooth start of loads that do not act at once.

    r(t) = 10 s^3 - 15 s^4 + 6 s^5,   s = t / ramp in [0, 1]

It is twice continuously differentiable, so that an acceleration derived from a displacement is continuous.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def ramps_at(time: Any, ramp: float) -> tuple[Any, Any, Any]:
    """Return r and its first and second derivative at a time, or at each of an array of times, 1, 1/s and 1/s^2.

    Args:
        time: s.
        ramp: Duration of the start, s; 0 for none.
    """
    if ramp == 0.0 or np.min(time, initial=np.inf) >= ramp:
        return 1.0, 0.0, 0.0
    s = np.clip(time / ramp, 0.0, 1.0)
    return (
        s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
        30.0 * s * s * (1.0 - s) ** 2 / ramp,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / ramp**2,
    )


def ramped(time: Any, ramp: float, derivatives: Sequence[Any]) -> Any:
    """Return the last derivative of r x from those of x, by the product rule.

    Args:
        time: A time or an array of times, s.
        ramp: Duration of the start, s; 0 for none.
        derivatives: x, or x and x', or x, x' and x'' at the times.
    """
    ramps, last = ramps_at(time, ramp), len(derivatives) - 1
    return sum(factor * ramps[last - k] * derivatives[k] for k, factor in enumerate(BINOMIAL[last]))


BINOMIAL = ((1,), (1, 1), (1, 2, 1))
