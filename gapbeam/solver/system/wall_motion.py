"""Walls of supports that move as given functions of time.

    g(t) = g0 + G u + W(t),    W(t) = sum_k (w_k(t) - w_k(0)) S_k

S_k (m) is by how much a unit of the motion w_k opens the gap at each contact point; g0 is the gap at t = 0. Under point
forces f the walls do the work -f . (W(t1) - W(t0)) on the body over a step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class WallMotion:
    """One motion of the walls of a support.

    Attributes:
        load: Number of the load of the system that it is, under which its work is entered.
        place: w of a time or an array of times.
        speed: Its derivative.
    """

    load: int
    place: Callable[[Any], Any]
    speed: Callable[[Any], Any]


@dataclass(frozen=True)
class Walls:
    """All motions of walls.

    Attributes:
        motions: k of them.
        growths: S, by how much a unit of each opens the gaps, (k, m); without motions (0, 1), for any m.
    """

    motions: tuple[WallMotion, ...]
    growths: Array

    def places(self, times: Array) -> Array:
        """Return w(t) - w(0), (times, k)."""
        return _columns([motion.place(times) - motion.place(0.0) for motion in self.motions], times)

    def speeds(self, times: Array) -> Array:
        """Return w'(t), (times, k)."""
        return _columns([motion.speed(times) for motion in self.motions], times)

    def opened(self, time: float) -> Array:
        """Return W at a time, (m,), m; one zero without motions."""
        return self._gaps(motion.place(time) - motion.place(0.0) for motion in self.motions)

    def opening_speed(self, time: float) -> Array:
        """Return W' at a time, (m,), m/s; one zero without motions."""
        return self._gaps(motion.speed(time) for motion in self.motions)

    def grown(self, start: float, end: float) -> Array:
        """Return W(end) - W(start), (m,), m; one zero without motions."""
        return self._gaps(motion.place(end) - motion.place(start) for motion in self.motions)

    def works(self, forces: Array, start: float, end: float, loads: int) -> Array:
        """Return the work of the walls on the body between two times, entered by load, (loads,), J.

        Args:
            forces: Point forces meanwhile, (m,), N.
            start: s.
            end: s.
            loads: Number of loads.
        """
        found = np.zeros(loads)
        for motion, growth in zip(self.motions, self.growths, strict=True):
            found[motion.load] -= float(growth @ forces) * float(motion.place(end) - motion.place(start))
        return found

    def _gaps(self, factors: Any) -> Array:
        total = np.zeros(self.growths.shape[1])
        for factor, growth in zip(factors, self.growths, strict=True):
            total += float(factor) * growth
        return total


def _columns(values: list[Any], times: Array) -> Array:
    columns = [np.broadcast_to(value, times.shape) for value in values]
    return np.array(columns, dtype=float).reshape(len(columns), len(times)).T


NO_WALLS = Walls((), np.zeros((0, 1)))
