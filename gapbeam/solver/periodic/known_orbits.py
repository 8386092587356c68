"""Periodic responses that curves have passed, and whether a point of a new curve is one of them.

A response is the same as another if their states at the start of a period agree, or agree after the time is shifted by
whole forcing periods, or after both halves of the period are exchanged with the sign changed, where the system has that
symmetry. A curve that runs into a known one is followed no further.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np

from gapbeam.solver.errors import NotConverged
from gapbeam.solver.periodic.shooting import PeriodMap, relative_change, shoot
from gapbeam.solver.system.operators import Array

SAME = 100.0  # tolerances of the search: relative difference of two states of one response
NEAR = 1.0  # of the distance of two neighbors on a curve; a state farther from their chord is not between them
RECENT = 3  # chords of a curve behind its last point that this point may lie near to without being known


class Passed(Protocol):
    """A point of a curve."""

    @property
    def value(self) -> float:
        """The parameter."""

    @property
    def x(self) -> Array:
        """State at the start of a period, (2n,)."""


@dataclass
class KnownOrbits:
    """The points of all curves so far.

    Attributes:
        map_at: The period map for a value of the parameter.
        images_at: The states of the same response, and of its mirror image, for a value and a state; without the state.
        tolerance: Of the change over a period, relative.
        curves: Points of each curve, in order.
    """

    map_at: Callable[[float], PeriodMap]
    images_at: Callable[[float, Array], Sequence[Array]]
    tolerance: float
    curves: list[Sequence[Passed]] = field(default_factory=list)

    @property
    def same(self) -> float:
        """Relative difference of two states of one response."""
        return SAME * self.tolerance

    def holds(self, value: float, x: Array, behind: Sequence[Passed] = ()) -> bool:
        """Return whether a response lies on a known curve, or its curve has come back to where it has been.

        Args:
            value: The parameter.
            x: State at the start of a period, (2n,).
            behind: The points of its own curve so far.
        """
        for own, state in [(True, x), *((False, image) for image in self.images_at(value, x))]:
            chords = [chord for curve in self.curves for chord in pairwise(curve)]
            chords += list(pairwise(behind[: len(behind) - RECENT] if own else behind))
            if any(self._is_same(value, state, near) for near in self._between(value, state, chords)):
                return True
        return False

    def _between(self, value: float, x: Array, chords: Sequence[tuple[Passed, Passed]]) -> Iterator[Array]:
        """Yield the states on chords at a value that are near enough to be the state."""
        for first, last in chords:
            low, high = sorted((first.value, last.value))
            if not low <= value <= high:
                continue
            share = (value - first.value) / (last.value - first.value) if last.value != first.value else 0.0
            near = first.x + share * (last.x - first.x)
            scale = self.map_at(value).scale
            length = np.linalg.norm(scale * (last.x - first.x))
            if np.linalg.norm(scale * (x - near)) <= NEAR * length + self.same * np.linalg.norm(scale * x):
                yield near

    def _is_same(self, value: float, x: Array, near: Array) -> bool:
        """Return whether the response next to a known one is a given one."""
        period_map = self.map_at(value)
        try:
            found = shoot(period_map, near, self.tolerance).x
        except NotConverged:
            found = near
        return relative_change(period_map.scale, x, found) <= self.same
