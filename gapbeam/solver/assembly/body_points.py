"""Points within the body: basis functions and their gradients in all cells that meet there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import basix
import numpy as np

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order
from gapbeam.solver.assembly.face_quadrature import FacePoints, lagrange
from gapbeam.solver.assembly.point_rows import PointFinder
from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array, Indices

COARSE = 0.05  # of a cell: how far a point on the surface may lie outside of curved cells, which do not follow an arc


def body_points(space: Any, places: Sequence[tuple[str, Array]]) -> tuple[FacePoints, Indices]:
    """Return the points in all cells that hold them, on all ranks: gradients jump from cell to cell.

    Args:
        space: Blocked vector Lagrange space.
        places: What to call each point in an error, and the point, (3,), m.

    Returns:
        A point for each cell, and the number of the place that it belongs to, ascending.

    Raises:
        UserError: A point lies outside the mesh; on all ranks.

    Collective.
    """
    mesh, finder = space.mesh, PointFinder(space)
    dimension = mesh.topology.dim
    cell_type = getattr(basix.CellType, mesh.topology.cell_name())
    element = lagrange(cell_type, space.element.basix_element.degree)
    geometry = lagrange(cell_type, geometry_order(mesh))
    first_cell = mesh.topology.index_map(dimension).local_range[0]
    mine = list[tuple[int, FacePoints]]()
    for number, (_, place) in enumerate(places):
        for _, cell, reference in finder.cells_at(place, COARSE if finder.curved else 0.0):
            basis, shapes = element.tabulate(1, reference)[..., 0], geometry.tabulate(1, reference)[..., 0]
            corners = mesh.geometry.x[coordinate_dofs(mesh)[cell]][:, :dimension]
            jacobian = np.einsum("dqc,cx->qdx", shapes[1:], corners)
            nodes = space.dofmap.index_map.local_to_global(space.dofmap.cell_dofs(cell).astype(np.int32))
            point = FacePoints(
                nodes[None].astype(np.int64),
                basis[0],
                np.ones(1),
                np.asarray(place, dtype=float)[None],
                np.einsum("qxd,dqk->qkx", np.linalg.inv(jacobian), basis[1:]),
                np.zeros((1, dimension)),
                np.array([first_cell + cell]),
            )
            mine.append((number, point))
    found = sorted((part for rank in mesh.comm.allgather(mine) for part in rank), key=lambda part: part[0])
    numbers = np.array([number for number, _ in found], dtype=np.int64)
    for number, (name, place) in enumerate(places):
        if number not in numbers:
            where = ", ".join(f"{x:.6g}" for x in place[:dimension])
            raise UserError(f"{name}: the point ({where}) m is not in the mesh: no stress there")
    return FacePoints.join([point for _, point in found]), numbers
