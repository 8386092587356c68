"""Places of the structures of a file in space: lines of beams, nodes of matrices, and nearest points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.scene.structure_geometry import ALONG, Pose
from gapbeam.solver.system.operators import Array

SAME = 1e-6  # of the distance: pairs of places that are as near


@dataclass(frozen=True)
class PlacedBody:
    """The extent of a structure in space.

    Attributes:
        names: Nodes of matrices; empty: a straight line from the first place to the second.
        places: Places of these nodes, or the ends of the line, (count, 3), m.
        ways: Directions in which points of the line move, (motions, 3); None: nodes move in any.
        half: Distance from the line to the surface, m; 0 for nodes; the largest of a frame.
        halves: Half of each of the names, m; empty: `half` of all.
        axes: Directions of the axis before and behind each of the names, (count, 2, 3); None: a straight line.
    """

    names: tuple[str, ...]
    places: Array
    ways: Array | None = None
    half: float = 0.0
    halves: tuple[float, ...] = ()
    axes: Array | None = None

    @property
    def extent(self) -> float:
        """Diagonal of the box around all places, m."""
        return float(np.linalg.norm(np.ptp(self.places, axis=0)))

    def at(self, x: float) -> Array:
        """Return the place at a length along the line, m."""
        return np.asarray(self.places[0] + x * self._unit)

    def half_at(self, name: str | float, way: Array) -> float:
        """Return the distance from a node, or a length along the line, to the surface along a way, m; 0 along the axis.

        Args:
            name: The node, or the length along the line, m.
            way: A unit vector, (3,): structures that butt touch with their ends.
        """
        number = self.names.index(str(name)) if self.names else 0
        axes = self._unit[None] if self.axes is None else self.axes[number]
        across = max(1.0 - float(np.min((axes @ way) ** 2)), 0.0)
        return (self.halves[number] if self.halves else self.half) * float(np.sqrt(across))

    def nearest(self, place: Array) -> tuple[str | float, Array]:
        """Return the node, or the length along the line, that is nearest to a place, and where it is."""
        if self.names:
            at = int(np.linalg.norm(self.places - place, axis=1).argmin())
            return self.names[at], self.places[at]
        x = self._along(place[None])[0]
        return float(x), self.at(x)

    @property
    def _unit(self) -> Array:
        way: Array = self.places[1] - self.places[0]
        size = float(np.linalg.norm(way))
        return np.asarray(way / (size or 1.0), dtype=float)

    def _along(self, places: Array) -> Array:
        size = float(np.linalg.norm(self.places[1] - self.places[0]))
        return np.asarray(np.clip((places - self.places[0]) @ self._unit, 0.0, size))


class NearestPlaces(NamedTuple):
    """The nearest places of two structures.

    Attributes:
        first: Node, or length along the line, m, of the first.
        second: The same of the second.
        direction: Direction of motion of both points, (3,).
        normal: 1 or -1: the second is ahead of the first along the direction, or behind.
        gap: Gap between their surfaces, m.
    """

    first: str | float
    second: str | float
    direction: Array
    normal: int
    gap: float


def nearest_places(first: PlacedBody, second: PlacedBody) -> NearestPlaces:
    """Return the nearest places of two structures, and the direction in which both can move toward each other.

    Raises:
        UserError: Several pairs are as near, the places are one, or a structure does not move along the line between.
    """
    if not first.names and not second.names:
        a, b = _between_lines(first, second)
    elif first.names and second.names:
        a, b = _between_nodes(first, second)
    elif first.names:
        b, a = _line_and_nodes(second, first)
    else:
        a, b = _line_and_nodes(first, second)
    apart: Array = b[1] - a[1]
    distance = float(np.linalg.norm(apart))
    if not distance > SAME * max(first.extent, second.extent):
        raise UserError("found structures that lie at one place, expected a distance; name their points")
    direction, normal = np.asarray(apart / distance, dtype=float), 1
    for body in (first, second):
        if body.ways is None:
            continue
        if len(body.ways) > 1 or abs(abs(body.ways[0] @ apart) - distance) > ALONG * distance:
            moves = " and ".join(str(np.round(way, 6).tolist()) for way in body.ways)
            raise UserError(
                f"found nearest places along {np.round(apart / distance, 6).tolist()}, expected the direction in which "
                f"the structure moves, {moves}; name points, or turn the structure by place.across"
            )
        direction = body.ways[0]
        normal = 1 if direction @ apart > 0.0 else -1
    return NearestPlaces(
        a[0], b[0], direction, normal, distance - first.half_at(a[0], direction) - second.half_at(b[0], direction)
    )


Found = tuple[str | float, Array]


def _between_lines(first: PlacedBody, second: PlacedBody) -> tuple[Found, Found]:
    ways = [body.places[1] - body.places[0] for body in (first, second)]
    sizes = [float(np.linalg.norm(way)) for way in ways]
    cross = np.linalg.norm(np.cross(*ways))
    if min(sizes) > 0.0 and cross <= ALONG * sizes[0] * sizes[1]:
        spans = sorted(float(x) for x in first._along(second.places))
        if spans[1] - spans[0] > SAME * min(sizes):
            raise UserError(
                f"found parallel structures, as near from {spans[0]:g} to {spans[1]:g} m of the first, expected one "
                "place; name points"
            )
    solved = scipy.optimize.lsq_linear(
        np.column_stack([ways[0], -ways[1]]), second.places[0] - first.places[0], (0.0, 1.0), tol=1e-14
    )
    b = second.nearest(first.places[0] + solved.x[0] * ways[0])
    a = first.nearest(b[1])
    return a, second.nearest(a[1])


def _between_nodes(first: PlacedBody, second: PlacedBody) -> tuple[Found, Found]:
    distances, others = scipy.spatial.KDTree(second.places).query(first.places)
    at = int(distances.argmin())
    _one(int(np.count_nonzero(distances <= (1.0 + SAME) * distances[at])), float(distances[at]))
    near = int(others[at])
    return (first.names[at], first.places[at]), (second.names[near], second.places[near])


def _line_and_nodes(line: PlacedBody, nodes: PlacedBody) -> tuple[Found, Found]:
    x = line._along(nodes.places)
    distances = np.linalg.norm(line.places[0] + x[:, None] * line._unit - nodes.places, axis=1)
    at = int(distances.argmin())
    _one(int(np.count_nonzero(distances <= (1.0 + SAME) * distances[at])), float(distances[at]))
    return line.nearest(nodes.places[at]), (nodes.names[at], nodes.places[at])


def _one(count: int, distance: float) -> None:
    """Refuse several places that are as near."""
    if count > 1:
        raise UserError(f"found {count} nodes that are as near, {distance:g} m, expected one; name points")


def in_space(one: Structure, ways: Array) -> Structure:
    """Return a structure whose motions are along directions of space, (motions, 3), as weight and base motions see it.

    Args:
        one: A beam, a rigid bar or a mass.
        ways: Directions of the motions of its points.
    """
    if one.inertia is not None:
        inertia = np.outer(one.inertia, ways[0])
        frame = {key: np.outer(moved, ways[0]) for key, moved in one.frame.items()}
    else:  # a mass in a section plane
        inertia = one.M @ ways
        frame = {key: point.rows @ ways for key, point in one.points.items()}
    points = {name: point.rows for name, point in one.points.items()}
    return Structure(one.M, one.K, one.C, points, one.rigid, one.name, inertia, frame).made_of(one)


def line_of(place: Pose, length: float, motions: int, half: float) -> PlacedBody:
    """Return the extent of a beam, a bar or a mass (of length 0) whose motions are across, along its own y, along."""
    ends = place.in_space(np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]]))
    return PlacedBody((), ends, place.turn.T[[2, 1, 0][:motions]], half)
