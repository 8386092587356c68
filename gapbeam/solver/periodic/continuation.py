"""Pseudo-arc-length continuation of periodic responses in one parameter.

A point is y = (x, lambda) with P(x; lambda) = x. From a point and the tangent t there, the next one satisfies

    P(x; lambda) - x = 0,    t . (y - y_0) = ds

in scaled unknowns, so that the curve is followed around folds, where lambda turns back. Steps grow where Newton's
method is quick and shrink where it fails.

Where an impact begins to graze, the curve has a corner, and may turn sharply. The tangent then points ahead if the
Jacobian, bordered by it, has a determinant of the same sign as before.

Events are located by test functions: the tangent turns at a fold; prod(1 + mu) changes its sign at a period doubling; a
pair of multipliers leaves the unit circle at a Neimark-Sacker bifurcation; the bordered determinant changes its sign at
a branch point, where another curve crosses; a face begins to touch at a grazing. Where a multiplier jumps across the
circle instead of passing it, an impact begins to graze there, too.

Source: Keller (1977) for the arc-length condition; Allgower and Georg (1990) for the orientation; Kuznetsov, Elements
of Applied Bifurcation Theory (2004), section 10.3, for the test functions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy

from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.periodic.floquet import (
    BRANCH_POINT,
    FOLD,
    GRAZING,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    PITCHFORK,
    Stability,
    stability_of,
)
from gapbeam.solver.periodic.shooting import PeriodMap, relative_change, shoot
from gapbeam.solver.system.operators import Array

DIFFERENCE = 1.0e-6  # of the range of the parameter, for the derivative by it
MOST_ITERATIONS = 8
QUICK = 3  # iterations; then the next step is longer
GROWTH = 1.5
FAR = 3.0  # arc lengths; a point further away is on another curve
BACK = 0.9  # cosine between the way to a point and the tangent there; beyond it, the way leads back
SHARP = 0.5  # cosine of the turn between two tangents; sharper ones are at corners
END_OF_RANGE = "the end of the range"
LARGEST_NUMBER = "points, the largest number"
KNOWN = "a response that is known"
MIRRORED = "a pitchfork, where it meets its mirror image"
LOCATED = 1.0e-3  # of a step: how well events are located
MIRRORING = 0.05  # of how far the point before a pitchfork is from its mirror image
PAIR = 2  # multipliers that leave the circle together
AT_CIRCLE = 0.1  # distance of the critical multiplier at a located event; a larger one has jumped


@dataclass(frozen=True)
class CurveSettings:
    """Settings of a continuation.

    Attributes:
        low: Least value of the parameter.
        high: Largest value.
        first_step: First arc length, as a share of the range.
        longest_step: Longest arc length, likewise.
        shortest_step: Shortest arc length, likewise; where it fails the curve ends.
        max_points: Largest number of points in one direction.
        tolerance: Tolerance of the change over a period, relative.
    """

    low: float
    high: float
    first_step: float = 0.01
    longest_step: float = 0.1
    shortest_step: float = 1.0e-5
    max_points: int = 400
    tolerance: float = 1.0e-8

    @property
    def range(self) -> float:
        """Length of the range, high - low."""
        return self.high - self.low


@dataclass(frozen=True)
class CurvePoint:
    """One periodic response on a curve.

    Attributes:
        value: The parameter.
        x: State at the start of a period, (2n,).
        stability: Its multipliers.
        own: The multipliers of the map that the curve follows: those of the response, or for a curve of symmetric
            responses those over half a period.
        reach: The largest depth of each face over a period, (faces,), m; negative where it stays open.
        direction: Share of the parameter in the tangent, positive where it grows along the curve.
        iterations: Newton iterations.
        residual: Change over a period, relative.
        event: "fold", "pitchfork", "branch point", "period doubling", "Neimark-Sacker" or "grazing" where the curve
            passes one, or "".
    """

    value: float
    x: Array
    stability: Stability
    own: Stability
    reach: Array
    direction: float
    iterations: int
    residual: float
    event: str = ""


@dataclass(frozen=True)
class ResponseCurve:
    """Points from one end to the other.

    Attributes:
        points: The points in order.
        endings: Why the curve ends, at its first point and at its last.
        symmetric: Whether its responses are symmetric and were followed over half a period.
    """

    points: tuple[CurvePoint, ...]
    endings: tuple[str, str]
    symmetric: bool = False

    @property
    def events(self) -> list[CurvePoint]:
        """The points where stability changes or the parameter turns back."""
        return [point for point in self.points if point.event]


Known = Callable[[float, Array, Sequence[CurvePoint]], bool]
Mirror = Callable[[float, Array], Array | None]


def unknown(value: float, x: Array, behind: Sequence[CurvePoint]) -> bool:  # noqa: ARG001
    """Return False: a first curve has no known responses to compare with."""
    return False


def no_mirror(value: float, x: Array) -> None:
    """Return no mirror image: the system has no symmetry."""


def follow(
    map_at: Callable[[float], PeriodMap],
    value: float,
    start: Array,
    settings: CurveSettings,
    known: Known = unknown,
    mirror: Mirror = no_mirror,
    symmetric: bool = False,
) -> ResponseCurve:
    """Follow the curve through a periodic response in both directions.

    Args:
        map_at: The period map for a value of the parameter.
        value: Value to start from.
        start: State near the periodic response there, (2n,).
        settings: Range and steps.
        known: Whether a response with the points behind it is known already, so that the curve ends there.
        mirror: The mirror image of a response for a value and a state; None where the system has no symmetry.
        symmetric: Whether the maps are those over half a period, whose curve is one of symmetric responses.

    Raises:
        NotConverged: There is no periodic response near the start.
    """
    orbit = shoot(map_at(value), start, settings.tolerance)
    walk = _Walk(map_at, settings, known, mirror, symmetric)
    first = walk.point(value, orbit.x, orbit.monodromy, orbit.iterations, orbit.residual)
    up, upper = walk.along(walk.first(first, orbit.monodromy, 1.0))
    walk = replace(walk, passed=(*reversed(up), first))
    down, lower = walk.along(walk.first(first, orbit.monodromy, -1.0))
    between = replace(first, direction=up[0].direction if up else 1.0)
    return ResponseCurve((*_turned(down), between, *up), (lower, upper), symmetric)


def branch_off(
    map_at: Callable[[float], PeriodMap],
    crossing: CurvePoint,
    settings: CurveSettings,
    known: Known = unknown,
    mirror: Mirror = no_mirror,
    sign: float = 1.0,
) -> ResponseCurve:
    """Follow the other curve from where it crosses one, in the direction of the multiplier that is +1 there.

    Args:
        map_at: The period map for a value of the parameter.
        crossing: The pitchfork or branch point.
        settings: Range and steps.
        known: As in `follow`.
        mirror: As in `follow`.
        sign: 1 or -1: to which side.

    Returns:
        The curve, without points where it could not be followed or is known.
    """
    walk = _Walk(map_at, settings, known, mirror)
    period_map = map_at(crossing.value)
    _, monodromy = period_map.with_tangent(crossing.x)
    values, vectors = np.linalg.eig(monodromy)
    vector = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    size = float(np.linalg.norm(period_map.scale * crossing.x)) or 1.0
    weights = np.asarray(period_map.scale / size)
    tangent = sign * np.append(weights * vector, 0.0) / np.linalg.norm(weights * vector)
    start = replace(crossing, own=crossing.stability, direction=0.0, event="")
    points, ending = walk.along(_Found(start, weights, tangent, 0.0))
    return ResponseCurve((start, *points) if points else (), (f"a {crossing.event}", ending))


def _turned(points: list[CurvePoint]) -> Iterator[CurvePoint]:
    """Yield the points of a walk in the other direction."""
    for point in reversed(points):
        yield replace(point, direction=-point.direction)


@dataclass(frozen=True)
class _Found:
    """A corrected point with the tangent for the next one.

    Attributes:
        point: The point.
        weights: Factors that make its scaled state a vector of length 1, (2n,).
        tangent: Unit tangent of (weights x, value / range), (2n + 1,).
        sign: Sign of the determinant of the Jacobian bordered by it.
    """

    point: CurvePoint
    weights: Array
    tangent: Array
    sign: float


@dataclass(frozen=True)
class _Walk:
    """One direction along a curve.

    Attributes:
        map_at: The period map for a value of the parameter.
        settings: Range and steps.
        known: Whether a response is known.
        mirror: Mirror images of responses.
        symmetric: Whether the curve is one of symmetric responses, followed over half a period.
        passed: Points of the curve in the other direction, from its far end to the start.
    """

    map_at: Callable[[float], PeriodMap]
    settings: CurveSettings
    known: Known
    mirror: Mirror
    symmetric: bool = False
    passed: tuple[CurvePoint, ...] = ()

    @property
    def range(self) -> float:
        """Length of the range of the parameter."""
        return self.settings.range

    def point(self, value: float, x: Array, monodromy: Array, iterations: int, residual: float) -> CurvePoint:
        """Return a point with its multipliers; the direction comes with its tangent."""
        period_map = self.map_at(value)
        stability, own = period_map.stability(monodromy), stability_of(monodromy)
        return CurvePoint(value, x, stability, own, period_map.reach(x), 1.0, iterations, residual)

    def first(self, point: CurvePoint, monodromy: Array, sign: float) -> _Found:
        """Return a point with the tangent along which the parameter grows (1) or falls (-1)."""
        return self._found(point, monodromy, np.append(np.zeros(len(point.x)), sign), None)

    def along(self, last: _Found) -> tuple[list[CurvePoint], str]:
        """Return the points behind one, and why they end."""
        points: list[CurvePoint] = []
        behind = [*(self.passed or (last.point,))]
        length = self.settings.first_step
        met: int | None = None  # the number of points before the last, where that is known
        for _ in range(self.settings.max_points):
            found = self._next(last, length)
            while found is None:
                length *= 0.5
                if length < self.settings.shortest_step:
                    return points, f"steps below {self.settings.shortest_step:g} of the range fail"
                found = self._next(last, length)
            if not self.known(found.point.value, found.point.x, behind):
                met = None
            elif met is None:
                met = len(points)
            else:  # two in turn: one alone may be where curves cross
                return points[:met], KNOWN
            points += self._events(last, found, length)
            if points and points[-1].event == PITCHFORK and not self.symmetric:
                return points, MIRRORED
            if not self.settings.low <= found.point.value <= self.settings.high:
                points += self._at_limit(last, found)
                return points, END_OF_RANGE
            points.append(found.point)
            behind.append(found.point)
            if found.point.iterations <= QUICK:
                length = min(GROWTH * length, self.settings.longest_step)
            last = found
        return points, f"{self.settings.max_points} {LARGEST_NUMBER}"

    def _next(self, last: _Found, length: float) -> _Found | None:
        """Return the point at an arc length from the last, or None where Newton's method fails."""
        weights, tangent = last.weights, last.tangent
        start = np.append(weights * last.point.x, last.point.value / self.range)
        y = start + length * tangent
        residuals: list[float] = []
        for iteration in range(MOST_ITERATIONS + 1):
            x, value = y[:-1] / weights, float(y[-1] * self.range)
            if value <= 0.0 < self.settings.low:
                return None
            try:
                period_map = self.map_at(value)
                end, monodromy = period_map.with_tangent(x)
                residuals.append(relative_change(period_map.scale, x, end))
                if not np.isfinite(residuals[-1]) or (iteration > 2 and residuals[-1] > residuals[0]):
                    return None
                if residuals[-1] <= self.settings.tolerance:
                    if np.linalg.norm(y - start) > FAR * length:
                        return None  # on another curve
                    point = self.point(value, x, monodromy, iteration, residuals[-1])
                    return self._found(point, monodromy, tangent, last)
                matrix = self._bordered(x, value, monodromy, weights, tangent)
                missed = np.append(weights * (end - x), tangent @ (y - start) - length)
                y = y - np.linalg.solve(matrix, missed)
            except (NotConverged, np.linalg.LinAlgError):
                return None
        return None

    def _found(self, point: CurvePoint, monodromy: Array, towards: Array, last: _Found | None) -> _Found:
        """Return a point with the unit tangent that points where `towards`, in the weights of the last point, does."""
        scale = self.map_at(point.value).scale
        size = float(np.linalg.norm(scale * point.x))
        weights: Array = np.asarray(scale / size) if size > 0.0 else scale
        along = towards if last is None else np.append(weights / last.weights * towards[:-1], towards[-1])
        matrix = self._bordered(point.x, point.value, monodromy, weights, along)
        tangent = np.linalg.solve(matrix, np.append(np.zeros(len(point.x)), 1.0))
        tangent = np.asarray(tangent / np.linalg.norm(tangent), dtype=float)
        matrix[-1] = tangent
        sign = float(np.linalg.slogdet(matrix)[0])
        if last is not None and sign != last.sign and tangent @ along < SHARP * np.linalg.norm(along):
            way = np.append(weights * (point.x - last.point.x), (point.value - last.point.value) / self.range)
            if tangent @ way < BACK * np.linalg.norm(way):  # else it would go back where it came from
                tangent, sign = -tangent, -sign
        return _Found(replace(point, direction=float(tangent[-1])), weights, tangent, sign)

    def _bordered(self, x: Array, value: float, monodromy: Array, weights: Array, row: Array) -> Array:
        """Return the Jacobian of the residual and of the arc-length condition, (2n + 1, 2n + 1)."""
        step = DIFFERENCE * self.range
        ends = [self.map_at(value + shift).after(x) for shift in (-step, step)]
        by_value = weights * (ends[1] - ends[0]) / (2.0 * step) * self.range
        by_state = weights[:, None] * monodromy / weights - np.eye(len(x))
        return np.block([[by_state, by_value[:, None]], [row[None, :]]])

    def _events(self, last: _Found, found: _Found, length: float) -> list[CurvePoint]:
        """Return the events of the curve between two points, located and in order."""
        before, after = last.point, found.point
        tests: list[tuple[str, Callable[[CurvePoint], float]]] = []
        turns = before.direction * after.direction < 0.0
        if turns:
            tests.append((FOLD, lambda point: point.direction))
        if before.own.doubling_test * after.own.doubling_test < 0.0:
            tests.append((PITCHFORK if self.symmetric else PERIOD_DOUBLING, lambda point: point.own.doubling_test))
        if (
            before.own.unstable_pairs != after.own.unstable_pairs
            and abs(before.own.unstable - after.own.unstable) >= PAIR
        ):
            tests.append((NEIMARK_SACKER, _pair_test))
        if not turns and last.sign * found.sign < 0.0 and before.own.unit_test * after.own.unit_test < 0.0:
            tests.append((BRANCH_POINT, lambda point: point.own.unit_test))
        for face in np.flatnonzero((before.reach > 0.0) != (after.reach > 0.0)):
            tests.append((GRAZING, partial(_depth, int(face))))
        located = sorted((self._locate(last, length, name, test) for name, test in tests), key=lambda entry: entry[0])
        inside = [event for _, event in located if self.settings.low <= event.value <= self.settings.high]
        events = [self._named(event, before) for event in inside]
        return [event for number, event in enumerate(events) if event.event not in _names(events[:number])]

    def _named(self, event: CurvePoint, before: CurvePoint) -> CurvePoint:
        """Return an event with the name that the point at its place deserves.

        A fold or branch point where a response has become symmetric is a pitchfork. Where the critical multiplier is
        not at the circle, it has jumped across.
        """
        name, own = event.event, event.own
        if name in (FOLD, BRANCH_POINT):
            here, there = self._asymmetry(event), self._asymmetry(before)
            if here is not None and there is not None and here < MIRRORING * there:
                return replace(event, event=PITCHFORK)
        far = {
            PERIOD_DOUBLING: own.distance(-1.0),
            PITCHFORK: own.distance(-1.0),
            BRANCH_POINT: own.distance(1.0),
            NEIMARK_SACKER: abs(_pair_test(event)),
        }
        return replace(event, event=GRAZING) if far.get(name, 0.0) > AT_CIRCLE else event

    def _asymmetry(self, point: CurvePoint) -> float | None:
        """Return the relative distance of a response from its mirror image; None where there is no symmetry."""
        image = self.mirror(point.value, point.x)
        return None if image is None else relative_change(self.map_at(point.value).scale, point.x, image)

    def _locate(
        self, last: _Found, length: float, name: str, test: Callable[[CurvePoint], float]
    ) -> tuple[float, CurvePoint]:
        """Return arc length and point where a test function vanishes; on the way, only converged points count."""
        known = {0.0: last.point}

        def at(share: float) -> float:
            found = self._next(last, share * length) if share > 0.0 else last
            if found is None:
                raise NotConverged("a point between two of the curve was not found")
            known[share] = found.point
            return test(found.point)

        try:
            root = float(scipy.optimize.brentq(at, 0.0, 1.0, xtol=LOCATED))
        except (NotConverged, ValueError):
            root = max(known)
        share = min(known, key=lambda tried: abs(tried - root))
        return share * length, replace(known[share], event=name)

    def _at_limit(self, last: _Found, found: _Found) -> list[CurvePoint]:
        """Return the point at the end of the range, where the curve crosses it."""
        before, after = last.point, found.point
        limit = self.settings.high if after.value > self.settings.high else self.settings.low
        if before.value == limit:
            return []
        share = (limit - before.value) / (after.value - before.value)
        try:
            orbit = shoot(self.map_at(limit), before.x + share * (after.x - before.x), self.settings.tolerance)
        except NotConverged:
            return []
        point = self.point(limit, orbit.x, orbit.monodromy, orbit.iterations, orbit.residual)
        return [replace(point, direction=after.direction)]


def _depth(face: int, point: CurvePoint) -> float:
    return float(point.reach[face])


def _names(points: Sequence[CurvePoint]) -> set[str]:
    return {point.event for point in points}


def _pair_test(point: CurvePoint) -> float:
    """Return |mu| - 1 of the largest complex multiplier."""
    pairs = [abs(one) for one in point.own.multipliers if one.imag > 0.0]
    return max(pairs, default=0.0) - 1.0
