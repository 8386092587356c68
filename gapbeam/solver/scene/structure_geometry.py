"""Geometry of structures in space: nodes and their motions, for pictures and contacts of faces.

x_space = origin + Q x_own,     Q = (axis, across x axis, across)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.scene.argument_checks import ArgumentError, finite
from gapbeam.solver.system.operators import Array

Indices = Any
ALONG = 1e-6  # cosine or sine of directions that are at right angles or one
Direction = Sequence[float]


def directions_across(along: Array) -> Array:
    """Return two unit vectors at right angles to a unit vector in space and to each other, (2, 3)."""
    first = np.eye(3)[int(np.abs(along).argmin())]
    first = first - (first @ along) * along
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(along, first)])


@dataclass(frozen=True, eq=False)
class StructureGeometry:
    """Nodes of a structure in space.

    Attributes:
        places: (nodes, 3), m.
        rows: Motions of node after node along x, y and z of space, (3 nodes, DOFs); numpy or scipy.sparse.
        lines: Nodes between which there are lines, (lines, 2).
        points: Place, (3,), and directions, (motions, 3), of points by their names.
        faces: Facets on the surface of solids by the name of a set that holds all their nodes, (facets, nodes).
        facet: Kind of these facets.
        corners_of: Weights of corners in a file at each node of a finer mesh, whose faces touch there, (nodes, nodes).
    """

    places: Array
    rows: Any
    lines: Indices
    points: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    faces: Mapping[str, Indices] = field(default_factory=dict)
    facet: str = ""
    corners_of: Any = None

    def over(self, basis: Array) -> StructureGeometry:
        """Return the geometry in other coordinates, DOFs = basis @ coordinates."""
        return replace(self, rows=np.asarray(self.rows @ basis))

    def displacements(self, u: Array) -> Array:
        """Return the displacements of all nodes, (nodes, 3), m, for the DOFs u."""
        return np.asarray(self.rows @ u).reshape(-1, 3)


@dataclass(frozen=True)
class Pose:
    """Place of a structure in space.

    Attributes:
        origin: Origin of the structure, m.
        axis: Direction in space of the structure's own x axis: the axis of a beam; of any length.
        across: Direction of its own z axis: the motion of a beam; of any length, at right angles to the axis. Default:
            z of space, made to be at right angles.

    Raises:
        ArgumentError: A vector has not three numbers, is 0, or the directions are not at right angles.
    """

    origin: Direction = (0.0, 0.0, 0.0)
    axis: Direction = (1.0, 0.0, 0.0)
    across: Direction | None = None

    def __post_init__(self) -> None:
        for name in ("origin", "axis", "across"):
            value = getattr(self, name)
            if value is None:
                continue
            given = finite(value, f"place: {name}")
            if given.shape != (3,) or (name != "origin" and not np.linalg.norm(given) > 0.0):
                kind = "" if name == "origin" else " that are not all 0"
                raise ArgumentError(f"place: found {name} {value!r}, expected three numbers{kind}", "place")
        x = _unit(self.axis)
        if self.across is None:
            if np.linalg.norm(np.cross(x, [0.0, 0.0, 1.0])) < ALONG:
                raise ArgumentError(
                    "place: found an axis along z, expected `across` with it: the direction of the own z axis", "place"
                )
        elif abs(x @ _unit(self.across)) > ALONG:
            raise ArgumentError(
                f"place: found across {list(self.across)} that is not at right angles to axis {list(self.axis)}, "
                "expected directions at right angles",
                "place",
            )

    @cached_property
    def turn(self) -> Array:
        """Q, (3, 3): columns are the own axes in space."""
        x, z = _unit(self.axis), _unit((0.0, 0.0, 1.0) if self.across is None else self.across)
        z = _unit(z - (z @ x) * x)
        return np.column_stack([x, np.cross(z, x), z])

    def in_space(self, places: Array) -> Array:
        """Return places, (..., 3), in space."""
        return np.asarray(np.asarray(self.origin, dtype=float) + places @ self.turn.T)

    def own(self, places: Array) -> Array:
        """Return places of space, (..., 3), in the structure's own axes."""
        return np.asarray((places - np.asarray(self.origin, dtype=float)) @ self.turn)


def _unit(direction: Direction | Array) -> Array:
    given = np.asarray(direction, dtype=float)
    return np.asarray(given / np.linalg.norm(given))
