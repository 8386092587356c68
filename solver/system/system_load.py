"""Loads of a semi-discrete system: patterns times functions of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class Load:
    """A spatial pattern times a function of time, with the motion of the frame where it is an inertia load.

    Attributes:
        name: Name in the case file.
        pattern: Nodal forces per unit factor, (n,), N.
        factor: s(t).
        static: Whether it acts on the seat before t = 0.
        frame_direction: Direction of a base motion with acceleration s(t), (3,), or None for other loads.
        frame_mean: Mean of s over intervals from starts, (times,), to ends, (times,), for base motion.
        of_arrays: Whether s also takes an array of times.
    """

    name: str
    pattern: Array
    factor: Callable[[float], float]
    static: bool = False
    frame_direction: Array | None = None
    frame_mean: Callable[[Array, Array], Array] | None = None
    of_arrays: bool = False

    def factors(self, times: Array) -> Array:
        """Return s at many times, (times,)."""
        if self.of_arrays:
            of_arrays: Callable[[Any], Any] = self.factor
            return np.asarray(np.broadcast_to(of_arrays(times), times.shape), dtype=float)
        return np.array([self.factor(float(time)) for time in times])
