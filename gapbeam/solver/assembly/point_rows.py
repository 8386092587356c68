"""Values and forces at points of the body: rows of basis functions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np

from gapbeam.meshes.mesh_readings import displacement_shapes
from gapbeam.meshes.serial_mesh import SerialMesh
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, coordinate_element, geometry_order
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array, Indices, Operators

ON_NODE = 1e-9  # of the length of the mesh
IN_CELL = 1e-6  # of the reference cell
BULGE = 0.05  # of the smallest side of the mesh: how far curved cells may reach beyond their nodes
SIMPLICES = {2: (3, 6), 3: (4, 10)}  # nodes of triangles and tetrahedra of order 1 and 2


@dataclass(frozen=True)
class PointRow:
    """Basis functions at one point, on the nodes that this rank owns.

    Attributes:
        nodes: Owned nodes (blocks), (k,).
        values: Their basis functions at the point, (k,).
        components: Number of components per node.
    """

    nodes: Indices
    values: Array
    components: int

    def evaluate(self, x: Array, operators: Operators) -> Array:
        """Return the vector field at the point, (components,), or row by row of x, (times, components). Collective."""
        return operators.sum(self.values @ x.reshape(*x.shape[:-1], -1, self.components)[..., self.nodes, :])

    def force(self, direction: Array, size: int) -> Array:
        """Return the nodal forces of a unit force along a direction, (n,), local."""
        pattern = np.zeros((size // self.components, self.components))
        pattern[self.nodes] = np.outer(self.values, direction)
        return pattern.reshape(-1)


class PointFinder:
    """Finds points in a mesh; made once for many of them."""

    def __init__(self, space: Any) -> None:
        """Build the tree of bounding boxes. Collective.

        Args:
            space: Blocked Lagrange space.
        """
        mesh, index_map = space.mesh, space.dofmap.index_map
        self.space = space
        self.places = space.tabulate_dof_coordinates()[: index_map.size_local]
        self.span = max(mesh.comm.allgather(float(np.max(np.abs(self.places), initial=0.0))))
        self.curved = geometry_order(mesh) > 1
        sides = np.ptp(mesh.geometry.x[:, : mesh.geometry.dim], axis=0) if len(mesh.geometry.x) else np.zeros(1)
        self.padding = BULGE * float(np.min(sides)) if self.curved else 0.0
        self.tree: Any = None
        if not isinstance(mesh, SerialMesh):
            from dolfinx import geometry

            self.tree = geometry.bb_tree(mesh, mesh.topology.dim, padding=self.padding)

    def row(self, point: Array, name: str, beyond: float = IN_CELL) -> PointRow:
        """Find the basis functions at a point: a node where one lies there, else by interpolation in its cell.

        Args:
            point: (3,), m.
            name: Name of the point in errors.
            beyond: Allowed distance of a point from a curved cell, over the size of the cell: coarse cells do not
                follow an arc exactly.

        Raises:
            UserError: The point lies outside the mesh; on all ranks.

        Collective.
        """
        comm, index_map, block = self.space.mesh.comm, self.space.dofmap.index_map, self.space.dofmap.index_map_bs
        distance = np.linalg.norm(self.places - point, axis=1)
        nearest = int(np.argmin(distance)) if len(distance) else -1
        best = float(distance[nearest]) if len(distance) else np.inf
        candidates = comm.allgather(best)
        if min(candidates) <= ON_NODE * self.span:
            here = comm.rank == int(np.argmin(candidates))
            return PointRow(np.array([nearest] if here else [], dtype=np.int64), np.array([1.0] if here else []), block)
        found = comm.allgather(self._in_cell(point, beyond))
        holders = [entry for entry in found if entry is not None]
        if not holders:
            place = ", ".join(f"{x:.6g}" for x in point[: self.space.mesh.geometry.dim])
            raise UserError(
                f"{name}: the point ({place}) m is not in the mesh; the nearest node is {min(candidates):.3g} m away. "
                "Move the point into the body, or check that the mesh is in meters with x = 0 at the supported end"
            )
        _, nodes, values = min(holders, key=itemgetter(0))
        first, last = index_map.local_range
        mine = (nodes >= first) & (nodes < last)
        return PointRow(nodes[mine] - first, values[mine], block)

    def cells_at(self, point: Array, beyond: float = IN_CELL) -> Iterator[tuple[float, int, Array]]:
        """Yield the distance of a point from owned cells that hold it, each cell, and the place in it, (1, dimension).

        Args:
            point: (3,), m.
            beyond: As in `row`.
        """
        for cell in map(int, self._cells_near(point)):
            away, reference = self._reference(cell, point)
            if away <= beyond:
                yield away, cell, reference

    def _cells_near(self, point: Array) -> Indices:
        """Return owned cells that may hold a point."""
        mesh = self.space.mesh
        if isinstance(mesh, SerialMesh):
            return mesh.cells_near(point, self.padding + ON_NODE * self.span)
        from dolfinx import geometry

        candidates = geometry.compute_collisions_points(self.tree, point.reshape(1, 3))
        if not self.curved:  # else cells bulge beyond the hull of their nodes, which is what is tested here
            candidates = geometry.compute_colliding_cells(mesh, candidates, point.reshape(1, 3))
        cells = candidates.links(0)
        return np.asarray(cells[cells < mesh.topology.index_map(mesh.topology.dim).size_local], dtype=np.int64)

    def _in_cell(self, point: Array, beyond: float) -> tuple[float, Indices, Array] | None:
        """Return the distance of a point from the nearest owned cell, global nodes, and the basis functions there."""
        nearest: tuple[float, int, Array] | None = None
        for found in self.cells_at(point, beyond):
            if nearest is None or found[0] < nearest[0]:
                nearest = found
            if found[0] <= IN_CELL:
                break
        if nearest is None:
            return None
        away, cell, reference = nearest
        values = displacement_shapes(self.space).tabulate(reference)[0][0]
        nodes = self.space.dofmap.index_map.local_to_global(self.space.dofmap.cell_dofs(cell).astype(np.int32))
        return away, nodes.astype(np.int64), values

    def _reference(self, cell: int, point: Array) -> tuple[float, Array]:
        """Return the distance of a point from the reference cell, and its place there, (1, dimension)."""
        mesh, dimension = self.space.mesh, self.space.mesh.geometry.dim
        corners = mesh.geometry.x[coordinate_dofs(mesh)[cell]][:, :dimension]
        shapes, serial = coordinate_element(mesh), isinstance(mesh, SerialMesh)
        try:
            place = point[:dimension] if serial else point[:dimension].reshape(1, -1)
            found = np.asarray(shapes.pull_back(place, corners))
        except RuntimeError:  # Newton's method ends far outside of the cell
            return np.inf, np.empty((1, dimension))
        if not self.curved and not serial:
            return 0.0, found
        outside = [float(np.max(-found)), float(np.max(found - 1.0))]
        if len(corners) in SIMPLICES[dimension]:
            outside.append(float(np.sum(found) - 1.0))
        away = max(0.0, *outside)
        return (0.0 if away <= IN_CELL and not self.curved else away), found


def point_row(space: Any, point: Array, name: str) -> PointRow:
    """Find the basis functions at a point, as `PointFinder.row` does. Collective."""
    return PointFinder(space).row(point, name)
