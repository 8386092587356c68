"""Stable responses of an atlas followed over its parameter, from value to value, and to where they end.

The orbit x = P(x, p) of a response moves by

    dx/dp = (1 - P')^-1 dP/dp.

Shooting begins there. Where it ends far from the prediction, or nowhere, the step of the parameter is halved: so a
branch stays one response, goes on where no start came to it, and its end is known to a 4096th of the distance between
two values. A response ends, too, where it comes to one of a shorter order.

Source: Parker and Chua (1989), Practical Numerical Algorithms for Chaotic Systems, sec. 5.3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.periodic.floquet import FOLD, GRAZING, PERIOD_DOUBLING, STABLE, ordered
from gapbeam.solver.scene.argument_checks import checked, period_at
from gapbeam.solver.scene.limit_cycle import after_steps, change_of_orbit, repeating_orbit
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.response_atlas import Atlas, AtlasPoint

SHORTEST, BENT, WITHIN = 2.0**-12, 0.5, 1e-6
"""Shortest part of a step of the parameter; distance of an orbit from its prediction, over its move and its size."""
PASSES = 12
SHIFT = 1e-4
"""Shift of the parameter for dP/dp, over the step to the next value."""
SAME, NEAR = 1e-5, 0.3
"""Difference of two states over their size: of one response, and of a response and a shorter one that it comes to."""
END_OF_RANGE = "end of range"


class Shaken(NamedTuple):
    """A scene at a value of the parameter, with period of its loads, s, steps in it, and a time at which one begins."""

    scene: Scene
    period: float
    steps: int
    t: float


SceneAt = Callable[[float], Shaken]


@dataclass(frozen=True, eq=False)
class FollowedResponse:
    """A stable response over a parameter.

    Attributes:
        order: Periods of the load after which it repeats.
        values: Values of the parameter, increasing.
        numbers: Its number among the responses of the atlas at each value; None: no start came to it.
        states: States at the start of a period, (values, 2 n + states).
        ends: Reasons for the ends below and above: "end of range", "fold", "period doubling", "Neimark-Sacker" or
            "grazing".
        limits: Values below and above at which it is gone, unstable or another one; NaN at the end of the range.
    """

    __repr__ = result_words

    order: int
    values: Array
    numbers: tuple[int | None, ...]
    states: Array
    ends: tuple[str, str]
    limits: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Place:
    """An orbit at a value of the parameter, with the derivative of the map over its periods, and its eigenvalues."""

    value: float
    x: Any
    slope: Any
    multipliers: Any


@dataclass(frozen=True)
class _End:
    """The end of a branch: its kind, and the first value where it is not."""

    kind: str
    value: float


@dataclass(frozen=True)
class _Follower:
    """Moves orbits of one order along the parameter."""

    at: SceneAt
    order: int
    size: int
    scheme: LinearScheme

    def shot(self, value: float, x: Any) -> _Place | None:
        """Return the orbit near a state; None where shooting does not converge."""
        scene, period, steps, t = self.at(value)
        try:
            orbit, P = repeating_orbit(scene, x, t, period / steps, self.order * steps, self.scheme, PASSES)
        except NotConverged:
            return None
        return _Place(value, orbit.state.x[:, 0], P, orbit.multipliers)

    def after(self, value: float, x: Any, periods: int) -> Any:
        """Return the state after some periods of the load."""
        scene, period, steps, t = self.at(value)
        return after_steps(scene, x, t, period / steps, periods * steps, self.scheme)

    def apart(self, x: Any, y: Any, of: Any = None) -> float:
        """Return the distance of two states over the size of one, the larger of displacements and velocities.

        Args:
            x: A state.
            y: Another one.
            of: State whose size counts, by default the second one.
        """
        n, size = self.size, np.abs(y if of is None else of)
        sizes = ((x - y)[part] / (size[part].max() or 1.0) for part in (slice(n), slice(n, 2 * n)))
        return max(float(np.abs(one).max()) for one in sizes)

    def fault(self, found: _Place | None, guess: Any, before: _Place) -> str | None:
        """Return the kind of the end where an orbit is not the next one of a branch; None where it is.

        Args:
            found: The orbit that shooting from the prediction has come to.
            guess: The prediction.
            before: The last orbit of the branch.
        """
        leading = ordered(before.multipliers).multipliers[0]
        gone = FOLD if abs(leading - 1.0) < 0.5 else GRAZING
        if found is None:
            return gone
        parts = [d for d in range(1, self.order) if self.order % d == 0]
        shorter = any(self.apart(self.after(found.value, found.x, d), found.x) <= SAME for d in parts)
        if shorter and self.apart(found.x, before.x) <= NEAR:
            return PERIOD_DOUBLING
        if shorter or self.apart(found.x, guess, before.x) > BENT * self.apart(guess, before.x, before.x) + WITHIN:
            return gone
        kind = ordered(found.multipliers).kind
        return None if kind == STABLE else kind

    def to(self, place: _Place, value: float) -> _Place | _End:
        """Return the orbit at another value, or where the branch ends on the way."""
        begin, done, part = place.value, 0.0, 1.0
        e = SHIFT * (value - begin)
        while done < 1.0:
            part = min(part, 1.0 - done)
            there = value if done + part == 1.0 else begin + (done + part) * (value - begin)
            ends = [self.after(place.value + s * e, place.x, self.order) for s in (-1.0, 1.0)]
            grown = (ends[1] - ends[0]) / (2.0 * e)
            guess = place.x + (there - place.value) * change_of_orbit(place.slope, grown)
            found = self.shot(there, guess)
            fault = self.fault(found, guess, place)
            if fault is None and found is not None:
                place, done, part = found, done + part, 2.0 * part
            elif part <= SHORTEST:
                return _End(fault or GRAZING, there)
            else:
                part *= 0.5
        return place


@checked
def follow(
    scene: Scene, found: Atlas, *, period: float | Callable[[dict[str, float]], float], steps: int = 400,
    scheme: LinearScheme = MIDPOINT,
) -> list[FollowedResponse]:  # fmt: skip
    """Follow all stable responses of an atlas over its parameter, from value to value, and to where they end.

    Args:
        scene: Scene of the atlas.
        found: Result of `atlas`, over one parameter whose values increase.
        period: As of the atlas.
        steps: As of the atlas.
        scheme: As of the atlas.

    Returns:
        Branches in the order of their lowest value; each periodic response of the atlas is on one.

    Raises:
        UserError: The atlas has no parameter or two, its values do not increase, or it has another period, other steps
            or another scheme.
    """
    (path,) = found.over if len(found.over) == 1 else ("",)

    def at(value: float) -> Shaken:
        values = {path: value}
        return Shaken(scene.with_(values), period_at(period, values, "follow"), steps, found.starts.t)

    return follow_responses(found.points, at, scheme)


def follow_responses(
    points: Sequence[AtlasPoint], at: SceneAt, scheme: LinearScheme = MIDPOINT
) -> list[FollowedResponse]:  # fmt: skip
    """Follow all stable responses of an atlas over its parameter.

    Args:
        points: Points of an atlas over one parameter whose values increase, under loads that repeat.
        at: Scene at a value of the parameter.
        scheme: As of the atlas.

    Returns:
        Branches in the order of their lowest value; each periodic response of the atlas is on one.

    Raises:
        UserError: The atlas has no parameter or two, its values do not increase, or it has another period, other steps
            or another scheme.
    """
    values = [float(next(iter(one.values.values()), np.nan)) for one in points]
    if any(len(one.values) != 1 for one in points) or not np.all(np.diff(values) > 0.0):
        raise UserError("follow: expected an atlas over one parameter whose values increase")
    left = {(i, k) for i, one in enumerate(points) for k, each in enumerate(one.responses) if each.order >= 1}
    found = []
    while left:
        i, k = min(left)
        one = points[i].responses[k]
        follower = _Follower(at, one.order, at(values[i]).scene.size, scheme)
        first = follower.shot(values[i], one.state.x[:, 0])
        left.discard((i, k))
        if first is None:
            continue
        if follower.apart(first.x, one.state.x[:, 0]) > SAME:
            raise UserError(
                f"follow: found a response at {values[i]:.6g} that repeats from another state than in the atlas, "
                "expected period, steps and scheme of the atlas"
            )
        ways = [_way(follower, first, i, sign, values, points, left) for sign in (-1, 1)]
        (back, below), (front, above) = ways
        chain = [*reversed(back), (first, k), *front]
        found.append(
            FollowedResponse(
                one.order, np.array([place.value for place, _ in chain]), tuple(number for _, number in chain),
                np.array([place.x for place, _ in chain]), (below.kind, above.kind), (below.value, above.value),
            )
        )  # fmt: skip
    return sorted(found, key=lambda one: (float(one.values[0]), one.order))


def _way(
    follower: _Follower, first: _Place, i: int, sign: int, values: Sequence[float],
    points: Sequence[AtlasPoint], left: set[tuple[int, int]],
) -> tuple[list[tuple[_Place, int | None]], _End]:  # fmt: skip
    """Follow a response to one side; take those of the atlas that it meets off the list of those that are left."""
    chain, place = list[tuple[_Place, int | None]](), first
    for j in range(i + sign, len(values) if sign > 0 else -1, sign):
        there = follower.to(place, values[j])
        if isinstance(there, _End):
            return chain, there
        place, number = there, None
        for other, one in enumerate(points[j].responses):
            if one.order != follower.order:
                continue
            x = np.hstack([one.strobes, np.tile(place.x[len(one.strobes[0]) :], (one.order, 1))])
            if min(follower.apart(y, place.x) for y in x) <= SAME:
                number = other
                left.discard((j, other))
        chain.append((place, number))
    return chain, _End(END_OF_RANGE, float("nan"))
