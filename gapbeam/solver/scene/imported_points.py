"""Points, clamped DOFs, rigid motions and units of imported matrices, their nodes and sets, and checks of them.

Checks rest on what every model has: mass everywhere, no negative energy, rigid motions.

Each finds a slip that no single file shows: DOFs in another order than the matrices, coordinates of another model,
other units than stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.argument_checks import ArgumentError, check_near, coordinates, finite
from gapbeam.solver.scene.node_files import Nodes
from gapbeam.solver.scene.order_of_rows import check_order
from gapbeam.solver.scene.structure_geometry import Pose
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
        place: Place of the structure in space: coordinates and directions of points are those of space.
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

    @cached_property
    def of_file(self) -> dict[str, dict[int, int]]:
        """Rows by node of a file and direction."""
        added = frozenset[str]() if self.nodes is None else self.nodes.added
        return {node: ways for node, ways in self.of_node.items() if node not in added}

    def clamped(self, label: str) -> list[int]:
        """Return the rows of a DOF, a node, or a set of nodes.

        Raises:
            ArgumentError: The label names no rows.
        """
        if label in self.places:
            return [self.places[label]]
        if label in self.of_node:
            return list(self.of_node[label].values())
        if self.nodes is not None and label.upper() in self.nodes.sets:
            found = [i for node in self.nodes.sets[label.upper()] for i in self.of_node.get(node, {}).values()]
            if not found:
                raise ArgumentError(f"clamped: found the set {label!r} without a node, expected some", "clamped")
            return found
        sets = f", or a set: {', '.join(sorted(self.nodes.sets)) or 'none'}" if self.nodes is not None else ""
        raise ArgumentError(f"clamped: found {label!r}, expected a node or DOF of the matrices{sets}", "clamped")

    def rows(self, key: str, given: PointGiven, fixed: set[int]) -> Array:
        """Return the rows of a point, (motions, DOFs).

        Raises:
            ArgumentError: A node, set or DOF is not there, has not that direction, or is clamped.
        """
        argument = f"points.{key}"
        if isinstance(given, Mapping):
            return self._along(key, given, fixed)
        if not isinstance(given, str | int | Sequence):
            raise ArgumentError(f"point {key}: found {given!r}, expected a DOF, or node, set or nearest", argument)
        wanted = [str(one) for one in ([given] if isinstance(given, str | int) else given)]
        rows = np.zeros((len(wanted), len(self.labels)))
        for row, label in zip(rows, wanted, strict=True):
            if label not in self.places:
                known = ", ".join(one for one in self.labels if one.partition(".")[0] == label.partition(".")[0])
                words = f"found {label!r}, expected a DOF of the matrices, {self.labels[0]} to {self.labels[-1]}"
                raise ArgumentError(f"point {key}: {words}{known and f'; that node has {known}'}", argument)
            if self.places[label] in fixed:
                raise ArgumentError(f"point {key}: DOF {label} is clamped", argument)
            row[self.places[label]] = 1.0
        return rows

    def _along(self, key: str, given: Mapping[str, Any], fixed: set[int]) -> Array:
        """Return the mean motion of nodes along one to three directions."""
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
        if axes.ndim != 2 or axes.shape[1] != 3 or not 1 <= len(axes) <= 3:
            raise ArgumentError(
                f"point {key}: found direction {given.get('direction')!r}, expected a vector (x, y, z), or up to three",
                argument,
            )
        size = np.linalg.norm(axes, axis=1)
        if not np.all(size > 0.0):
            raise ArgumentError(f"point {key}: found a direction of length 0, expected a vector", argument)
        axes = axes / size[:, None] @ self.place.turn
        axes[np.abs(axes) < TURNED] = 0.0
        if np.abs(axes @ axes.T - np.eye(len(axes))).max() > 1e-9:
            raise ArgumentError(f"point {key}: found directions that are not at right angles", argument)
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
            place = np.asarray(self.place.own(coordinates(value, f"point {key}: nearest", argument)) / self.meter)
            node, apart, size = self.nodes.nearest(place, self.of_file)
            check_near(f"point {key}", argument, apart * self.meter, size * self.meter)
            return [node]
        try:
            found = [node for node in self.nodes.of_set(str(value), argument) if node in self.of_file]
        except ArgumentError as error:
            raise ArgumentError(f"point {key}: {error}", argument) from None
        if not found:
            raise ArgumentError(f"point {key}: found no rows for the nodes of set {value!r} in the matrices", argument)
        return found

    def nodes_of(self, given: Mapping[str, Any]) -> list[str]:
        """Return the nodes of a point."""
        return next(self._nodes("", where, given[where]) for where in WHERE if given.get(where) is not None)

    def placed(self, given: PointGiven) -> tuple[Array | None, Array | None]:
        """Return the place of a point, m, and the directions of its motions, (motions, 3), as far as they are known."""
        if isinstance(given, Mapping):
            nodes, axes = self.nodes_of(given), np.atleast_2d(np.asarray(given["direction"], dtype=float))
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
            ArgumentError: The vector is no direction.
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


ROUND_OFF = 1e-8  # of the largest entry: what exports leave
NEGATIVE = 1e-9  # of the largest ratio of stiffness to mass on the diagonals
SLOWEST, FASTEST = 20.0, 1e5
"""Usual speeds of waves from one node to the next, m/s; others are asked about."""
HEAVIEST = 3e4
"""Largest usual density, kg/m^3; larger ones are asked about."""


def check_imported(K: Any, M: Any, C: Any, rows: Rows, name: str = "", cut: float = 0.0) -> None:
    """Refuse matrices of which no model is made, and ask about units that make unusual waves or densities.

    Args:
        K: Stiffness of all rows, SI, sparse.
        M: Mass.
        C: Damping, or None.
        rows: Their names and nodes.
        name: Name of the structure.
        cut: Relative error that the digits of K leave, at most.

    Raises:
        ArgumentError: M is not positive definite, K has a negative direction, C drives a motion, or rows are in another
            order than their names.
    """
    for A, key in ((M, "mass"), (K, "stiffness")):
        skew, most = abs(A - A.T).max(), abs(A).max()
        if not skew <= ROUND_OFF * most:
            raise ArgumentError(
                f"found a matrix that differs from its transpose by up to {skew:.3g} of {most:.3g}, expected a "
                "symmetric one; complete an exported triangle as A + A.T - diag(A)",
                key,
            )
    diagonal = M.diagonal()
    if not np.all(diagonal > 0.0):
        bare = np.flatnonzero(~(diagonal > 0.0))
        raise ArgumentError(
            f"found {len(bare)} DOFs without mass, the first is {rows.labels[bare[0]]}, expected a positive "
            "definite M; leave them out by static condensation, or give them mass",
            "mass",
        )
    scale = sp.diags(1.0 / np.sqrt(diagonal))
    unit, elastic = sp.csc_matrix(scale @ M @ scale), sp.csc_matrix(scale @ K @ scale)
    if has_negative_direction(unit):
        raise ArgumentError(
            "found an M that is not positive definite, expected kinetic energy in every motion; C3D10 of CalculiX has "
            "motions without mass in coarse meshes: refine, or take C3D20",
            "mass",
        )
    if has_negative_direction(elastic + NEGATIVE * float(abs(elastic.diagonal()).max()) * unit):
        raise ArgumentError(
            "found a K with a negative direction, expected none; look at how K was exported, and with how many "
            "digits (DMIG: fields of 16 characters), and give forces that soften as a feedback", "stiffness",
        )  # fmt: skip
    if C is not None and abs(C).max() > 0.0:
        drag = sp.csc_matrix(0.5 * scale @ (C + C.T) @ scale)
        if has_negative_direction(drag + NEGATIVE * float(abs(scale @ C @ scale).max()) * unit):
            raise ArgumentError(
                "found a C that drives a motion, expected one that takes energy from each; look at its sign, and give "
                "forces that drive as a feedback", "damping",
            )  # fmt: skip
    if rows.rigid() is not None and rows.nodes is not None:
        check_order(K, rows.of_node, rows.meter * np.array([rows.nodes.places[one] for one in rows.of_node]), cut)
        for question in unit_questions(K, M, rows):
            LOG.warning("structure %s: %s", name or "?", question)


def has_negative_direction(A: Any) -> bool:
    """Return whether a symmetric matrix has a negative direction, by the signs of its pivots (Sylvester)."""
    try:
        factor = sla.splu(
            sp.csc_matrix(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # singular
        return True
    return bool(np.any(factor.U.diagonal() < 0.0))


def unit_questions(K: Any, M: Any, rows: Rows) -> Iterator[str]:
    """Yield questions where waves are faster or slower, or the mass denser, than in usual materials."""
    assert rows.nodes is not None
    names = list(rows.of_node)
    places = rows.meter * np.array([rows.nodes.places[one] for one in names])
    node = np.empty(K.shape[0], dtype=int)
    for k, one in enumerate(names):
        node[list(rows.of_node[one].values())] = k
    entries = sp.coo_matrix(K)
    apart = node[entries.row] != node[entries.col]
    if not apart.any():
        return
    i, j = node[entries.row[apart]], node[entries.col[apart]]
    distance = np.linalg.norm(places[i] - places[j], axis=1)
    nearest = np.full(len(names), np.inf)
    np.minimum.at(nearest, i[distance > 0.0], distance[distance > 0.0])
    straight = np.array([DIRECTIONS[label.partition(".")[2]] < 3 for label in rows.labels])
    speeds = (np.sqrt(np.abs(K.diagonal() / M.diagonal())) * nearest[node])[straight & np.isfinite(nearest[node])]
    spans = np.ptp(places, axis=0)
    size = f"the nodes span {spans.max():.3g} m"
    if len(speeds) and not SLOWEST <= np.median(speeds) <= FASTEST:
        yield (
            f"waves run at about {np.median(speeds):.2g} m/s from node to node ({size}); usual are {SLOWEST:g} to "
            f"{FASTEST:g} m/s. Are the files in other units?"
        )
    volume = float(np.prod(spans))
    along = np.array([DIRECTIONS[label.partition(".")[2]] == 0 for label in rows.labels], dtype=float)
    if volume > 0.0 and along @ (M @ along) > HEAVIEST * volume:
        yield (
            f"a mass of {along @ (M @ along):.3g} kg fills {volume:.3g} m^3 ({size}); usual is less than "
            f"{HEAVIEST:g} kg/m^3. Are the files in other units?"
        )
