"""Branches of periodic responses over a range of a parameter.

One branch goes through the response of the case, others through those that marches find at both ends of the range, and
in the middle of an interval that is not covered then. Where the system is symmetric, symmetric responses are followed
as such, and a branch leaves each of their pitchforks; so does one from each branch point. A branch ends where it meets
one that is known.

Symmetric systems have period maps that are odd under a change of sign and half a period. Where loads change their sign
after half a period, and what the structure may touch lies alike on both sides of its rest position, -x(t + T/2) is a
motion whenever x(t) is one. The period map is then the square of

    H(x) = -phi_(T/2)(x),    P = H o H

with the flow phi over half a period. Its fixed points are the symmetric periodic responses, x(t + T/2) = -x(t). Where a
multiplier of H passes -1, one of P passes +1: two responses that mirror each other branch off at a pitchfork. The curve
of symmetric responses is regular there for H, so that following H stays on it.

Source: Swift and Wiesenfeld, Phys. Rev. Lett. 52 (1984) 705, for half-wave symmetry and its bifurcations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.periodic.continuation import (
    END_OF_RANGE,
    CurvePoint,
    CurveSettings,
    ResponseCurve,
    branch_off,
    follow,
)
from gapbeam.solver.periodic.floquet import BRANCH_POINT, PITCHFORK, Stability
from gapbeam.solver.periodic.shooting import KnownOrbits, PeriodMap, relative_change, shoot
from gapbeam.solver.system.operators import Array

ALIKE = 1.0e-6  # relative difference of two ends that round-off leaves
PROBED = 1.5, 0.3  # sizes of the states that the symmetry is tried on, and of the random part added to them
MOST_DOUBLINGS = 40  # of these sizes, until all faces touch


@dataclass(frozen=True)
class HalfWaveMap:
    """H, as a period map: its fixed points are the symmetric periodic responses.

    Attributes:
        whole: P.
        half: The flow over the first half of the period.
    """

    whole: PeriodMap
    half: PeriodMap

    @property
    def scale(self) -> Array:
        """Scale of P, (2n,)."""
        return self.whole.scale

    def after(self, x: Array) -> Array:
        """Return H(x), (2n,)."""
        return -self.half.after(x)

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return H(x), (2n,), and H'(x), (2n, 2n)."""
        end, tangent = self.half.with_tangent(x)
        return -end, -tangent

    def stability(self, tangent: Array) -> Stability:
        """Return the multipliers of P, the squares of those of H."""
        return self.whole.stability(tangent @ tangent)

    def reach(self, x: Array) -> Array:
        """Return the largest penetration of each face over the whole period, (faces,), m."""
        return self.whole.reach(x)

    def part(self, count: int) -> PeriodMap | None:
        """Return the flow over the first of `count` equal parts of the whole period."""
        return self.whole.part(count)


def half_wave(period_map: PeriodMap, x: Array) -> HalfWaveMap | None:
    """Return H where the system has this symmetry: where P and H o H agree on a response, and where all faces touch.

    A motion that touches no face has the symmetry of linear motions, also before a single stop. States are doubled
    until every face touches in the half that H mirrors, and once more; where one never does, the symmetry is not known,
    and there is no H.

    Args:
        period_map: P.
        x: State on a periodic response, (2n,).
    """
    half = period_map.part(2)
    if half is None:
        return None
    found = HalfWaveMap(period_map, half)
    random = np.random.default_rng(0).standard_normal(len(x)) / period_map.scale
    size = np.linalg.norm(period_map.scale * x) / np.linalg.norm(period_map.scale * random)

    def agree(tried: Array) -> bool:
        return relative_change(period_map.scale, period_map.after(tried), found.after(found.after(tried))) <= ALIKE

    factor, share = PROBED
    tried = x + share * size * random
    touched = np.zeros_like(half.reach(x), dtype=bool)
    if not (agree(x) and agree(factor * x)):
        return None
    for _ in range(MOST_DOUBLINGS):
        enough = touched.all()
        for one in (tried, -tried):
            if not agree(one):
                return None
            touched |= half.reach(found.after(one)) > 0.0
        if enough:
            return found
        tried = 2.0 * tried
    return None


def is_symmetric(half: HalfWaveMap, x: Array) -> bool:
    """Return whether a state lies on a symmetric response: H(x) = x."""
    return relative_change(half.scale, x, half.after(x)) <= ALIKE


NOT_COVERED = 1.0e-3  # of the range; smaller gaps are the length of a step
TWINS = 0.1  # relative difference of the first steps to both sides of a pitchfork
NEARBY = 4.0  # steps of a branch from where it met a known one to the pitchfork there
ENDS = 2  # of an interval


@dataclass(frozen=True)
class Branches:
    """Periodic responses that were found over a range.

    Attributes:
        curves: The branches; the first goes through the response of the case.
        missing: Intervals of the range where no branch was found, and why, in the order of the parameter.
        unstable: Intervals where branches were found, but no stable response.
    """

    curves: tuple[ResponseCurve, ...]
    missing: tuple[tuple[float, float, str], ...]
    unstable: tuple[tuple[float, float], ...]


def follow_branches(
    map_at: Callable[[float], PeriodMap],
    value: float,
    start: Array,
    settings: CurveSettings,
    start_at: Callable[[float], Array],
    periods: int = 1,
) -> Branches:
    """Follow the branches of periodic responses over a range.

    Args:
        map_at: The period map for a value of the parameter.
        value: Value to start from.
        start: State near the periodic response there, (2n,).
        settings: Range and steps.
        start_at: Returns a state near a periodic response for a value of the parameter, (2n,), by a march.
        periods: Forcing periods in a period of the response.

    Raises:
        NotConverged: There is no periodic response near the start.
    """
    search = _Search(map_at, settings, half_wave(map_at(value), start), periods)
    search.through(value, start)
    failed = {end: not search.from_march(end, start_at) for end in (settings.low, settings.high)}
    for low, high in search.gaps():
        search.from_march(0.5 * (low + high), start_at)
    missing = [(low, high, search.reason(low, high, failed)) for low, high in search.gaps()]
    pairs = (pair for curve in search.curves for pair in pairwise(curve.points))  # of neighbors on a branch
    stable = [_span(pair) for pair in pairs if any(point.stability.stable is not False for point in pair)]
    unstable = _gaps([*stable, *((low, high) for low, high, _ in missing)], settings)
    return Branches(tuple(search.curves), tuple(missing), tuple(unstable))


@dataclass
class _Search:
    """Branches as they are found.

    Attributes:
        map_at: The period map for a value of the parameter.
        settings: Range and steps.
        half: The map over half a period where the system is symmetric, or None.
        periods: Forcing periods in a period of the response.
        curves: The branches.
    """

    map_at: Callable[[float], PeriodMap]
    settings: CurveSettings
    half: HalfWaveMap | None
    periods: int
    curves: list[ResponseCurve] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.known = KnownOrbits(self.map_at, self.images, self.settings.tolerance)

    def half_at(self, value: float) -> HalfWaveMap:
        """Return the map over half a period for a value of the parameter."""
        whole = self.map_at(value)
        half = whole.part(2)
        assert half is not None
        return HalfWaveMap(whole, half)

    def mirror(self, value: float, x: Array) -> Array | None:
        """Return the mirror image of a response, (2n,); None where the system has none."""
        return None if self.half is None else self.half_at(value).after(x)

    def images(self, value: float, x: Array) -> Sequence[Array]:
        """Return the states of a response after whole forcing periods, and those of its mirror image."""
        mirrored = self.mirror(value, x)
        part = self.map_at(value).part(self.periods)
        assert part is not None
        found = list[Array]()
        for start in (x,) if mirrored is None else (x, mirrored):
            found.append(start)
            for _ in range(self.periods - 1):
                found.append(part.after(found[-1]))
        return found[1:]

    def through(self, value: float, start: Array) -> None:
        """Follow the branch through a response, and those that leave its pitchforks and branch points.

        Raises:
            NotConverged: There is no periodic response near the start.
        """
        x = shoot(self.map_at(value), start, self.settings.tolerance).x
        symmetric = self.half is not None and is_symmetric(self.half_at(value), x)
        maps = self.half_at if symmetric else self.map_at
        first = follow(maps, value, x, self.settings, self.known.holds, self.mirror, symmetric)
        found = [self._kept(first)]
        while found:
            curve = found.pop(0)
            for place, event in enumerate(curve.points):
                if event.event == PITCHFORK and not curve.symmetric:  # a branch ends there
                    found += self._symmetric(event)
                elif event.event in (PITCHFORK, BRANCH_POINT):
                    found += self._crossing(curve, place)

    def from_march(self, value: float, start_at: Callable[[float], Array]) -> bool:
        """Follow the branch through the response that a march leads to, if it is new; return whether one exists."""
        try:
            x = shoot(self.map_at(value), start_at(value), self.settings.tolerance).x
            if not self.known.holds(value, x):
                self.through(value, x)
        except NotConverged:
            return False
        return True

    def gaps(self) -> list[tuple[float, float]]:
        """Return the intervals of the range that no branch covers."""
        return _gaps([_span(curve.points) for curve in self.curves], self.settings)

    def reason(self, low: float, high: float, failed: dict[float, bool]) -> str:
        """Return the reason for which no branch covers an interval."""
        reasons = list[str]()
        for curve in self.curves:
            near = self.settings.range * NOT_COVERED
            for point, ending in zip((curve.points[0], curve.points[-1]), curve.endings, strict=True):
                if ending != END_OF_RANGE and min(abs(point.value - low), abs(point.value - high)) <= near:
                    reasons.append(ending)
        why = reasons[0] if reasons else "the branches turn back"
        if failed.get(low) or failed.get(high):
            return f"{why}, and no periodic response was found at the end of the range"
        return f"{why}, from both sides" if len(reasons) >= ENDS else why

    def _kept(self, curve: ResponseCurve) -> ResponseCurve:
        self.curves.append(curve)
        self.known.curves.append(curve.points)
        return curve

    def _symmetric(self, event: CurvePoint) -> list[ResponseCurve]:
        """Return the curve of symmetric responses through a pitchfork that another branch has come to, if it is new."""
        try:
            x = shoot(self.half_at(event.value), event.x, self.settings.tolerance).x
            if self.known.holds(event.value, x):
                return []
            curve = follow(self.half_at, event.value, x, self.settings, self.known.holds, self.mirror, symmetric=True)
        except NotConverged:
            return []
        return [self._kept(curve)]

    def _crossing(self, curve: ResponseCurve, place: int) -> list[ResponseCurve]:
        """Return the new branches from a pitchfork or a branch point, one of two that mirror each other.

        A branch point whose branches both lie at the same side of it, alike, is named a pitchfork.
        """
        event = curve.points[place]
        if self._is_reached(event):
            return []
        found = [
            branch_off(self.map_at, event, self.settings, self.known.holds, self.mirror, sign)
            for sign in ((1.0,) if event.event == PITCHFORK else (1.0, -1.0))
        ]
        found = [branch for branch in found if branch.points]
        if len(found) == ENDS and event.event == BRANCH_POINT:
            first, second = (branch.points[1].value - event.value for branch in found)
            if abs(first - second) <= TWINS * max(abs(first), abs(second)):
                found.pop()
                self._rename(curve, place)
        return [self._kept(branch) for branch in found]

    def _is_reached(self, event: CurvePoint) -> bool:
        """Return whether another branch has come as near to a pitchfork as some of its own steps, or begins there."""
        scale = self.map_at(event.value).scale
        for curve in self.curves:
            for end, before in ((curve.points[0], curve.points[1:2]), (curve.points[-1], curve.points[-2:-1])):
                step = sum(float(np.linalg.norm(scale * (end.x - point.x))) for point in before)
                images = (event.x, *self.images(event.value, event.x))
                if not curve.symmetric and any(np.linalg.norm(scale * (end.x - x)) <= NEARBY * step for x in images):
                    return True
        return False

    def _rename(self, curve: ResponseCurve, place: int) -> None:
        points = list(curve.points)
        points[place] = replace(points[place], event=PITCHFORK)
        number = next(number for number, one in enumerate(self.curves) if one is curve)
        self.curves[number] = replace(curve, points=tuple(points))


def _span(points: Sequence[CurvePoint]) -> tuple[float, float]:
    values = [point.value for point in points]
    return min(values), max(values)


def _gaps(spans: Sequence[tuple[float, float]], settings: CurveSettings) -> list[tuple[float, float]]:
    """Return the intervals of the range outside of all spans, except for the smallest."""
    reached, gaps = settings.low, list[tuple[float, float]]()
    for low, high in [*sorted(spans), (settings.high, settings.high)]:
        if low - reached > NOT_COVERED * settings.range:
            gaps.append((reached, low))
        reached = max(reached, high)
    return gaps
