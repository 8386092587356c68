"""Loads of a semi-discrete system: patterns times functions of time."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gapbeam.solver.system.operators import Array

AT_ONCE = 8192  # times, so that what is made of them stays in the cache


class Alike(Protocol):
    """A function of time that costs little beside others of its kind."""

    @property
    def kind(self) -> Hashable:
        """What functions have in common that are computed together."""

    def rows(self, signals: Sequence[Any], times: Array) -> Array:
        """Return s of some functions of this kind at many times, (times, functions)."""


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
        signal: Computes s together with other loads of its kind; None: s is computed by itself.
    """

    name: str
    pattern: Array
    factor: Callable[[float], float]
    static: bool = False
    frame_direction: Array | None = None
    frame_mean: Callable[[Array, Array], Array] | None = None
    of_arrays: bool = False
    signal: Alike | None = None

    def factors(self, times: Array) -> Array:
        """Return s at many times, (times,)."""
        if self.of_arrays:
            of_arrays: Callable[[Any], Any] = self.factor
            return np.asarray(np.broadcast_to(of_arrays(times), times.shape), dtype=float)
        return np.array([self.factor(float(time)) for time in times])


def factor_rows_of(loads: Sequence[Load], times: Array) -> Array:
    """Return s_k(t) of loads at many times, (times, loads); loads of one kind together."""
    rows, alike = np.empty((len(times), len(loads))), dict[Hashable, list[int]]()
    for place, load in enumerate(loads):
        if load.signal is None:
            rows[:, place] = load.factors(times)
        else:
            alike.setdefault(load.signal.kind, []).append(place)
    for places in alike.values():
        signals = [loads[place].signal for place in places]
        if (first := signals[0]) is not None:
            together = places[-1] - places[0] == len(places) - 1
            columns = slice(places[0], places[-1] + 1) if together else places
            for begin in range(0, len(times), AT_ONCE):
                here = slice(begin, begin + AT_ONCE)
                rows[here, columns] = first.rows(signals, times[here])
    return rows
