"""Nodes of structures in space, and how they move: what pictures, and contacts of faces, need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array

Indices = Any


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
    """

    places: Array
    rows: Any
    lines: Indices
    points: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    faces: Mapping[str, Indices] = field(default_factory=dict)
    facet: str = ""

    def over(self, basis: Array) -> StructureGeometry:
        """Return the geometry in other coordinates, DOFs = basis @ coordinates."""
        return replace(self, rows=np.asarray(self.rows @ basis))

    def displacements(self, u: Array) -> Array:
        """Return the displacements of all nodes, (nodes, 3), m, for the DOFs u."""
        return np.asarray(self.rows @ u).reshape(-1, 3)
