"""Shooting: Newton's method on the period map x -> P(x), the state after p forcing periods.

    (I - P'(x)) dx = P(x) - x

The time scheme gives the map, by a whole number of steps: the result is a periodic response of the discrete system to
the last digits, and approximates one of the continuous system as well as the step allows.

A curve that runs into a known one is followed no further. Responses are the same if their states at the start of a
period agree, or agree after the time is shifted by whole forcing periods, or after both halves of the period are
exchanged with the sign changed, where the system has that symmetry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np

from gapbeam.solver.errors import NotConverged
from gapbeam.solver.periodic.floquet import Stability, stability_of
from gapbeam.solver.system.operators import Array

SHORTEST_UPDATE = 2.0**-6  # of Newton's update
SLACK = 1.2  # a residual may grow so much before the update is shortened: impacts make the map uneven


class PeriodMap(Protocol):
    """The state after a period as a function of the state at its start."""

    @property
    def scale(self) -> Array:
        """Factors that make the entries of x comparable, (2n,)."""

    def after(self, x: Array) -> Array:
        """Return P(x), (2n,)."""

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return P(x), (2n,), and P'(x), (2n, 2n)."""

    def stability(self, tangent: Array) -> Stability:
        """Return the multipliers of a response from the derivative of this map there, (2n, 2n)."""

    def reach(self, x: Array) -> Array:
        """Return the largest penetration of each face over the period, (faces,), m; negative where it stays open."""

    def part(self, count: int) -> PeriodMap | None:
        """Return the flow over the first of `count` equal parts of the period; None where these have no whole steps."""


@dataclass(frozen=True)
class Orbit:
    """A periodic response, by its state at the start of a period.

    Attributes:
        x: The state, (2n,).
        monodromy: P'(x), (2n, 2n).
        stability: Its multipliers.
        residuals: |P(x) - x| / |x| of every iteration, scaled norms.
    """

    x: Array
    monodromy: Array
    stability: Stability
    residuals: tuple[float, ...]

    @property
    def residual(self) -> float:
        """Change of the state over a period, relative."""
        return self.residuals[-1]

    @property
    def iterations(self) -> int:
        """Newton iterations."""
        return len(self.residuals) - 1


def no_pause() -> None:
    """Go on: what a search calls between two iterations, where nothing can stop it."""


def shoot(
    period_map: PeriodMap,
    start: Array,
    tolerance: float = 1.0e-9,
    max_iterations: int = 20,
    pause: Callable[[], None] = no_pause,
) -> Orbit:
    """Find a periodic response near a state.

    Args:
        period_map: P.
        start: State to start from, (2n,).
        tolerance: Largest |P(x) - x| / |x|.
        max_iterations: Limit of Newton iterations.
        pause: Called before every iteration; what it raises ends the search.

    Raises:
        NotConverged: With the residual of every iteration.
    """
    x, length, residuals = start, 1.0, list[float]()
    kept: tuple[Array, Array] | None = None  # where the last update started from, and the update
    for _ in range(max_iterations + 1):
        pause()
        end, tangent = period_map.with_tangent(x)
        residual = relative_change(period_map.scale, x, end)
        shortened = kept is not None and length > SHORTEST_UPDATE and not residual <= SLACK * residuals[-1]
        if kept is not None and shortened:
            length *= 0.5
            x = kept[0] + length * kept[1]
            continue
        residuals.append(residual)
        if not np.isfinite(residual):
            break
        if residual <= tolerance:
            return Orbit(x, tangent, stability_of(tangent), tuple(residuals))
        try:
            update = np.asarray(np.linalg.solve(np.eye(len(x)) - tangent, end - x), dtype=float)
        except np.linalg.LinAlgError:
            break
        kept, length = (x, update), 1.0
        x = x + update
    raise no_orbit(max_iterations, residuals, tolerance)


def no_orbit(max_iterations: int, residuals: Sequence[float], tolerance: float) -> NotConverged:
    """Return the error of a search that ended without a periodic response."""
    return NotConverged(
        f"shooting found no periodic response in {max_iterations} iterations: the state still changes by "
        f"{residuals[-1]:.2e} over a period, relative (allowed: {tolerance:.1e}); start nearer, by a longer march, "
        "try another number of periods, or more steps per period",
        tuple(residuals),
    )


def relative_change(scale: Array, x: Array, end: Array) -> float:
    """Return |end - x| / max(|x|, |end|) in the scaled norm."""
    size = max(np.linalg.norm(scale * x), np.linalg.norm(scale * end))
    change = np.linalg.norm(scale * (end - x))
    return float(change / size) if size > 0.0 else float(change)


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
