"""Routes in space: straight legs and bends, places along them by length, and where the routes of a frame meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError, check_near, finite, positive
from gapbeam.solver.system.operators import Array

SAME = 1e-9  # of the length: places that are one
MEETING = 1e-6  # of the longest route: how close ends of members come to what they meet
STRAIGHT = 1e-9  # sine of the angle of legs that continue each other


@dataclass(frozen=True)
class RoutePart:
    """A straight leg, or a bend.

    Attributes:
        begin: Length along the axis where it begins, m.
        length: m.
        start: Length at which it begins, m.
        along: Direction there.
        inward: Direction toward the center of a bend; None: straight.
        radius: Radius of a bend, m.
    """

    begin: float
    length: float
    start: Array
    along: Array
    inward: Array | None = None
    radius: float = 0.0

    def at(self, s: float) -> Array:
        """Return the place at a length along the axis of the whole route, m."""
        x = s - self.begin
        if self.inward is None:
            return np.asarray(self.start + x * self.along)
        angle = x / self.radius
        moved = np.sin(angle) * self.along + (1.0 - np.cos(angle)) * self.inward
        return np.asarray(self.start + self.radius * moved)

    def direction(self, s: float) -> Array:
        """Return the direction at a length along the axis of the whole route."""
        if self.inward is None:
            return self.along
        angle = (s - self.begin) / self.radius
        return np.asarray(np.cos(angle) * self.along + np.sin(angle) * self.inward)

    def nearest(self, place: Array) -> float:
        """Return the length along the axis of the whole route that is nearest to a place within the part, m."""
        if self.inward is None:
            x = float((place - self.start) @ self.along)
        else:
            arm = place - self.start - self.radius * self.inward
            angle = float(np.arctan2(arm @ self.along, -(arm @ self.inward)))
            middle = 0.5 * self.length / self.radius  # the other end is nearer beyond half a turn from the middle
            x = self.radius * (middle + (angle - middle + np.pi) % (2.0 * np.pi) - np.pi)
        return self.begin + min(max(x, 0.0), self.length)


class FrameRoute:
    """The axis of a frame.

    Args:
        corners: Its ends and corners, (count, 3), m.
        radius: Radius of the bend at each corner: a number for all, or one for each corner between the ends; 0: sharp.
        where: Name of its structure in messages.

    Raises:
        UserError: There are fewer than two corners, two are one, a leg is shorter than its bends, or a leg turns back.
    """

    def __init__(self, corners: Sequence[Sequence[float]], radius: float | Sequence[float], where: str) -> None:
        places = finite(corners, f"{where}: route")
        if places.ndim != 2 or places.shape[1] != 3 or len(places) < 2:
            raise ArgumentError(
                f"{where}: found a route of shape {places.shape}, expected two corners (x, y, z) or more", "route"
            )
        count = len(places) - 2
        given = positive(radius, f"{where}: bend radius", zero=True)
        if given.shape not in ((), (count,)):
            raise ArgumentError(
                f"{where}: found {given.size} bend radii, expected one, or one for each of {counted(count, 'corner')}",
                "bend_radius",
            )
        radii = np.broadcast_to(given, (count,))
        legs = np.diff(places, axis=0)
        sizes = np.linalg.norm(legs, axis=1)
        if not np.all(sizes > SAME * sizes.max()):
            raise ArgumentError(f"{where}: found a leg of length 0, expected corners that differ", "route")
        ways = legs / sizes[:, None]
        cosines = np.clip((ways[:-1] * ways[1:]).sum(axis=1), -1.0, 1.0)
        sines = np.linalg.norm(np.cross(ways[:-1], ways[1:]), axis=1)
        if np.any((sines < STRAIGHT) & (cosines < 0.0)):
            raise ArgumentError(f"{where}: found a leg that turns back, expected legs that meet at an angle", "route")
        angles = np.arctan2(sines, cosines)
        cut = np.where(sines > STRAIGHT, radii * np.tan(0.5 * angles), 0.0)  # what a bend takes of both legs
        left = sizes - np.concatenate([[0.0], cut]) - np.concatenate([cut, [0.0]])
        if np.any(left < -SAME * sizes):
            short = int(left.argmin())
            raise ArgumentError(
                f"{where}: found leg {short + 1} of {sizes[short]:g} m, expected at least "
                f"{sizes[short] - left[short]:g} m for the bends at its ends",
                "bend_radius",
            )
        self.parts: list[RoutePart] = []
        s, start = 0.0, places[0]
        for k, (way, size) in enumerate(zip(ways, np.maximum(left, 0.0), strict=True)):
            if size > SAME * sizes[k]:
                self.parts.append(RoutePart(s, float(size), start, way))
                s += float(size)
            if k < count and cut[k] > 0.0:
                start = places[k + 1] - cut[k] * way
                inward = ways[k + 1] - cosines[k] * way
                bend = RoutePart(
                    s, float(radii[k] * angles[k]), start, way, inward / np.linalg.norm(inward), float(radii[k])
                )
                self.parts.append(bend)
                s += bend.length
                start = places[k + 1] + cut[k] * ways[k + 1]
            elif k < count:
                start = places[k + 1]
        self.length = s

    def part_at(self, s: float) -> RoutePart:
        """Return the part at a length along the axis."""
        return next((one for one in self.parts if s < one.begin + one.length), self.parts[-1])

    def at(self, s: float) -> Array:
        """Return the place at a length along the axis, m."""
        return self.part_at(s).at(s)

    def stations(self, places: Sequence[float], element: float, angle: float) -> Array:
        """Return lengths along the axis of nodes: at the ends of all parts, at all places, and between them.

        Args:
            places: Places that need nodes, m.
            element: Longest element, m.
            angle: Largest angle of a bend that an element spans, rad.
        """
        ends = [part.begin for part in self.parts]
        stops = np.unique([*ends, self.length, *places])
        stops = stops[np.concatenate([[True], np.diff(stops) > SAME * self.length])]
        found = []
        for a, b in pairwise(stops):
            part = self.part_at(0.5 * (a + b))
            most = element if part.inward is None else min(element, angle * part.radius)
            found.append(np.linspace(a, b, max(1, int(np.ceil((b - a) / most * (1.0 - 1e-9)))) + 1)[:-1])
        return np.concatenate([*found, [self.length]])

    def nearest(self, place: Array) -> float:
        """Return the length along the axis that is nearest to a place, m."""
        return min(
            (part.nearest(place) for part in self.parts), key=lambda s: float(np.linalg.norm(self.at(s) - place))
        )


Station = float | Sequence[float]
"""Length along the first route, m, or coordinates (x, y, z), m, whose nearest place on any route is meant."""
Along = tuple[int, float]
"""Number of a route, and a length along it, m."""


class FrameAxes:
    """Routes of a frame, which meet where the end of one lies on another.

    Args:
        routes: The first, and its branches.
        where: Name of their structure in messages.

    Raises:
        UserError: A branch meets no other route.
    """

    def __init__(self, routes: Sequence[FrameRoute], where: str) -> None:
        self.routes = tuple(routes)
        self.length = sum(one.length for one in self.routes)
        near = MEETING * max(one.length for one in self.routes)
        self.meetings: list[tuple[Along, Along]] = []
        nearest = np.full(len(self.routes), np.inf)
        for k, route in enumerate(self.routes):
            for s in (0.0, route.length):
                for j, other in enumerate(self.routes):
                    if j == k:
                        continue
                    t = other.nearest(route.at(s))
                    distance = float(np.linalg.norm(other.at(t) - route.at(s)))
                    nearest[k] = min(nearest[k], distance)
                    if distance <= near:
                        self.meetings.append(((k, s), (j, t)))
        piece = _pieces(len(self.routes), [(a[0], b[0]) for a, b in self.meetings])
        apart = np.flatnonzero(piece != piece[0])
        if len(apart):
            k = int(apart[0])
            raise ArgumentError(
                f"{where}: found member {k} whose nearest end is {nearest[k]:.4g} m from the others, expected an end "
                "on their axes",
                f"members.{k - 1}.route",
            )

    def at(self, along: Along) -> Array:
        """Return a place, m."""
        return self.routes[along[0]].at(along[1])

    def nearest(self, place: Array) -> Along:
        """Return the place on any route that is nearest to a place."""
        found = [(k, route.nearest(place)) for k, route in enumerate(self.routes)]
        return min(found, key=lambda along: float(np.linalg.norm(self.at(along) - place)))

    def along(self, at: Station, where: str, argument: str = "clamped") -> Along:
        """Return the route of a station, and the length along it.

        Raises:
            UserError: The station is off the first route, or coordinates are far from all.
        """
        given, length = finite(at, where), self.routes[0].length
        if given.shape == (3,):
            found = self.nearest(given)
            ends = [route.at(s) for route in self.routes for s in (*(one.begin for one in route.parts), route.length)]
            apart, size = (float(np.linalg.norm(one)) for one in (self.at(found) - given, np.ptp(ends, axis=0)))
            check_near(where, argument, apart, size)
            return found
        if given.shape != () or not 0.0 <= given <= length * (1.0 + 1e-12):
            raise ArgumentError(
                f"{where}: found {at!r}, expected a length along the axis from 0 to {length:.6g} m, or (x, y, z)",
                argument,
            )
        return 0, min(float(given), length)

    def stations(self, places: Sequence[Along], element: float, angle: float) -> list[Array]:
        """Return lengths of nodes along each route: as `FrameRoute.stations`, and where routes meet."""
        every = [*places, *(along for both in self.meetings for along in both)]
        return [route.stations([s for j, s in every if j == k], element, angle) for k, route in enumerate(self.routes)]

    def nodes(self, stations: Sequence[Array]) -> list[Array]:
        """Return the numbers of the nodes along each route, from 0 on; routes that meet share one."""
        first = np.cumsum([0, *map(len, stations)])
        links = [[first[k] + int(np.abs(stations[k] - s).argmin()) for k, s in both] for both in self.meetings]
        return np.split(_pieces(int(first[-1]), links), first[1:-1])


def _pieces(count: int, links: Sequence[Sequence[int]]) -> Array:
    """Return the number of the connected piece of each of `count` things, in their order."""
    rows, columns = np.array(links, dtype=int).reshape(-1, 2).T
    joined = sp.coo_array((np.ones(len(rows)), (rows, columns)), (count, count))
    _, labels = connected_components(joined, directed=False)
    _, firsts, found = np.unique(labels, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(firsts))[found])
