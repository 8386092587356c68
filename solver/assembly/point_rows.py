"""Values and forces at points of the body: rows of basis functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import geometry
from mpi4py import MPI

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, coordinate_element
from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array, Indices, Operators

ON_NODE = 1e-9  # of the length of the mesh


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


def point_row(space: Any, point: Array, name: str) -> PointRow:
    """Find the basis functions at a point: a node where one lies there, else by interpolation in its cell.

    Args:
        space: Blocked Lagrange space.
        point: (3,), m.
        name: What to call the point in an error.

    Raises:
        UserError: The point lies outside the mesh; on all ranks.

    Collective.
    """
    comm, index_map, block = space.mesh.comm, space.dofmap.index_map, space.dofmap.index_map_bs
    owned = index_map.size_local
    places = space.tabulate_dof_coordinates()[:owned]
    span = comm.allreduce(float(np.max(np.abs(places), initial=0.0)), op=MPI.MAX)
    distance = np.linalg.norm(places - point, axis=1)
    nearest = int(np.argmin(distance)) if owned else -1
    best = float(distance[nearest]) if owned else np.inf
    candidates = comm.allgather(best)
    if min(candidates) <= ON_NODE * span:
        here = comm.rank == int(np.argmin(candidates))
        return PointRow(np.array([nearest] if here else [], dtype=np.int64), np.array([1.0] if here else []), block)
    found = comm.allgather(_in_cell(space, point))
    holders = [entry for entry in found if entry is not None]
    if not holders:
        place = ", ".join(f"{x:.6g}" for x in point[: space.mesh.geometry.dim])
        raise UserError(
            f"{name}: the point ({place}) m is not in the mesh; the nearest node is {min(candidates):.3g} m away. "
            "Move the point into the body, or check that the mesh is in meters with x = 0 at the supported end"
        )
    nodes, values = holders[0]
    first, last = index_map.local_range
    mine = (nodes >= first) & (nodes < last)
    return PointRow(nodes[mine] - first, values[mine], block)


def _in_cell(space: Any, point: Array) -> tuple[Indices, Array] | None:
    """Return global nodes and basis functions at a point of an owned cell of this rank, or None."""
    mesh = space.mesh
    tree = geometry.bb_tree(mesh, mesh.topology.dim)
    candidates = geometry.compute_collisions_points(tree, point.reshape(1, 3))
    cells = geometry.compute_colliding_cells(mesh, candidates, point.reshape(1, 3)).links(0)
    cells = cells[cells < mesh.topology.index_map(mesh.topology.dim).size_local]
    if len(cells) == 0:
        return None
    cell = int(cells[0])
    corners = mesh.geometry.x[coordinate_dofs(mesh)[cell]][:, : mesh.geometry.dim]
    reference = coordinate_element(mesh).pull_back(point[: mesh.geometry.dim].reshape(1, -1), corners)
    values = space.element.basix_element.tabulate(0, reference)[0, 0, :, 0]
    nodes = space.dofmap.index_map.local_to_global(space.dofmap.cell_dofs(cell).astype(np.int32))
    return nodes.astype(np.int64), values
