"""Points, clamped DOFs, rigid motions and units of imported matrices: rows by node and direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.scene.given_numbers import ArgumentError, finite
from gapbeam.solver.scene.node_files import Nodes
from gapbeam.solver.scene.structure_pose import Pose
from gapbeam.solver.system.operators import Array

DIRECTIONS = {"0": 0, "1": 0, "2": 1, "3": 2, "4": 3, "5": 4, "6": 5}  # 0: a scalar point
WHERE = ("node", "set", "nearest")
TURNED = 1e-12  # components of unit vectors that a turn leaves as round-off

Label = str | int
PointGiven = Label | Sequence[Label] | Mapping[str, Any]


@dataclass(frozen=True)
class Rows:
    """Rows of matrices with their names.

    Attributes:
        labels: "node.direction" of each row, or its number where nothing names it.
        nodes: Coordinates and sets, or None.
        meter: Unit of the coordinates, m.
        named: Whether the labels have nodes and directions.
        place: Of the structure in space: coordinates and directions of points are those of space.
    """

    labels: list[str]
    nodes: Nodes | None
    meter: float
    named: bool
    place: Pose = field(default_factory=Pose)

    @cached_property
    def places(self) -> dict[str, int]:
        """Rows by their labels."""
        return {label: i for i, label in enumerate(self.labels)}

    @cached_property
    def of_node(self) -> dict[str, dict[int, int]]:
        """Rows by node and direction, from 0 on; empty where nothing names the rows."""
        found: dict[str, dict[int, int]] = {}
        for i, label in enumerate(self.labels if self.named else ()):
            node, _, way = label.partition(".")
            found.setdefault(node, {})[DIRECTIONS[way]] = i
        return found

    def clamped(self, label: str) -> list[int]:
        """Return the rows of a DOF, a node, or a set of nodes.

        Raises:
            ArgumentError: There is none.
        """
        if label in self.places:
            return [self.places[label]]
        if label in self.of_node:
            return list(self.of_node[label].values())
        if self.nodes is not None and label.upper() in self.nodes.sets:
            return [i for node in self.nodes.sets[label.upper()] for i in self.of_node.get(node, {}).values()]
        sets = f"; sets: {', '.join(sorted(self.nodes.sets)) or 'none'}" if self.nodes is not None else ""
        raise ArgumentError(f"clamped: found {label!r}, which is no node and no DOF of the matrices{sets}", "clamped")

    def rows(self, key: str, given: PointGiven, fixed: set[int]) -> Array:
        """Return the rows of a point, (motions, DOFs).

        Raises:
            ArgumentError: A node, set or DOF is not there, has not that direction, or is clamped.
        """
        argument = f"points.{key}"
        if isinstance(given, Mapping):
            return self._along(key, given, fixed)
        wanted = [str(one) for one in ([given] if isinstance(given, str | int) else given)]
        rows = np.zeros((len(wanted), len(self.labels)))
        for row, label in zip(rows, wanted, strict=True):
            if label not in self.places:
                near = [one for one in self.labels if one.partition(".")[0] == label.partition(".")[0]]
                known = f"; that node has {', '.join(near)}" if near else ""
                raise ArgumentError(f"point {key}: found {label!r}, which is no DOF of the matrices{known}", argument)
            if self.places[label] in fixed:
                raise ArgumentError(f"point {key}: DOF {label} is clamped", argument)
            row[self.places[label]] = 1.0
        return rows

    def _along(self, key: str, given: Mapping[str, Any], fixed: set[int]) -> Array:
        """Return the mean motion of nodes along one or two directions."""
        argument = f"points.{key}"
        where = [one for one in WHERE if given.get(one) is not None]
        if len(where) != 1 or set(given) - {*WHERE, "direction"}:
            raise ArgumentError(
                f"point {key}: found {sorted(given)}, expected one of node, set or nearest, with a direction", argument
            )
        if not self.named:
            raise ArgumentError(f"point {key}: nothing names the rows; expected `dofs`, or numbers of rows", argument)
        nodes = self._nodes(key, where[0], given[where[0]])
        axes = np.atleast_2d(finite(given.get("direction"), f"point {key}: direction"))
        if axes.ndim != 2 or axes.shape[1] != 3 or not 1 <= len(axes) <= 2:
            raise ArgumentError(
                f"point {key}: found direction {given.get('direction')!r}, expected a vector (x, y, z), or two",
                argument,
            )
        size = np.linalg.norm(axes, axis=1)
        if not np.all(size > 0.0):
            raise ArgumentError(f"point {key}: found a direction of length 0, expected a vector", argument)
        axes = axes / size[:, None] @ self.place.turn
        axes[np.abs(axes) < TURNED] = 0.0
        if len(axes) == 2 and abs(axes[0] @ axes[1]) > 1e-9:
            raise ArgumentError(f"point {key}: found two directions that are not at right angles", argument)
        rows = np.zeros((len(axes), len(self.labels)))
        for node in nodes:
            for way in np.flatnonzero(np.abs(axes).max(axis=0)):
                i = self.of_node[node].get(int(way))
                if i is None:
                    has = ", ".join(str(one + 1) for one in sorted(self.of_node[node]))
                    raise ArgumentError(
                        f"point {key}: found no DOF {way + 1} at node {node}, expected one of its directions {has}",
                        argument,
                    )
                if i in fixed:
                    raise ArgumentError(f"point {key}: DOF {self.labels[i]} is clamped", argument)
                rows[:, i] = axes[:, way] / len(nodes)
        return rows

    def _nodes(self, key: str, where: str, value: Any) -> list[str]:
        argument = f"points.{key}"
        if where == "node":
            if str(value) not in self.of_node:
                raise ArgumentError(
                    f"point {key}: found node {value}, which has no rows in the matrices; expected one of "
                    f"{len(self.of_node)} nodes from {min(self.of_node, key=int)} to {max(self.of_node, key=int)}",
                    argument,
                )
            return [str(value)]
        if self.nodes is None:
            raise ArgumentError(f"point {key}: `{where}` needs the coordinates: expected `nodes`", argument)
        if where == "nearest":
            place = finite(value, f"point {key}: nearest")
            if place.shape != (3,):
                raise ArgumentError(f"point {key}: found nearest {value!r}, expected coordinates (x, y, z)", argument)
            return [self.nodes.nearest(np.asarray(self.place.own(place) / self.meter), self.of_node)]
        try:
            found = [node for node in self.nodes.of_set(str(value), argument) if node in self.of_node]
        except ArgumentError as error:
            raise ArgumentError(f"point {key}: {error}", argument) from None
        if not found:
            raise ArgumentError(f"point {key}: found no rows for the nodes of set {value!r} in the matrices", argument)
        return found

    def placed(self, given: PointGiven) -> tuple[Array | None, Array | None]:
        """Return the place of a point, m, and the directions of its motions, (motions, 3), as far as they are known."""
        if isinstance(given, Mapping):
            where = next(one for one in WHERE if given.get(one) is not None)
            nodes, axes = (
                self._nodes("", where, given[where]),
                np.atleast_2d(np.asarray(given["direction"], dtype=float)),
            )
            place = None
            if self.nodes is not None:
                place = self.place.in_space(np.mean([self.meter * self.nodes.places[node] for node in nodes], axis=0))
            return place, axes / np.linalg.norm(axes, axis=1)[:, None]
        labels = [str(one).partition(".") for one in ([given] if isinstance(given, str | int) else given)]
        if not self.named or any(DIRECTIONS[way] > 2 for _, _, way in labels):
            return None, None
        axes = np.eye(3)[[DIRECTIONS[way] for _, _, way in labels]] @ self.place.turn.T
        known = None if self.nodes is None else self.nodes.places[labels[0][0]]
        return None if known is None else self.place.in_space(self.meter * known), axes

    @cached_property
    def along_axes(self) -> Array:
        """DOFs of unit motions along x, y and z of space, (DOFs, 3)."""
        turns = np.vstack([self.place.turn.T, np.zeros((3, 3))])
        return turns[[DIRECTIONS[label.partition(".")[2]] for label in self.labels]]

    def along(self, frame: Sequence[float]) -> Array:
        """Return the DOFs of a unit motion along a direction of space.

        Raises:
            ArgumentError: It is no direction.
        """
        direction = np.asarray(frame, dtype=float)
        if direction.shape != (3,) or not np.linalg.norm(direction) > 0.0:
            raise ArgumentError(f"frame: found {frame!r}, expected three numbers that are not all 0", "frame")
        return np.asarray(self.along_axes @ (direction / np.linalg.norm(direction)))

    def rigid(self) -> Array | None:
        """Return the six rigid motions, (DOFs, 6): along x, y, z, and about them through the middle of all nodes.

        Raises:
            ArgumentError: A node of the rows has no coordinates.
        """
        if self.nodes is None or not self.named:
            return None
        missing = sorted(set(self.of_node) - set(self.nodes.places), key=int)
        if missing:
            raise ArgumentError(
                f"found that node {missing[0]} of the DOFs has no coordinates ({len(missing)} in all), expected a "
                "place for each node",
                "nodes",
            )
        middle = np.mean([self.nodes.places[one] for one in self.of_node], axis=0)
        found = np.zeros((len(self.labels), 6))
        for node, ways in self.of_node.items():
            arm = self.meter * (self.nodes.places[node] - middle)
            turns = np.cross(np.eye(3), arm)  # row: motion by a turn about x, y, z
            for way, i in ways.items():
                found[i, way] = 1.0
                if way < 3:
                    found[i, 3:] = turns[:, way]
        return found
