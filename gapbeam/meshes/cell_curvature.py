"""Curvature of the cells of a mesh: fields of a lower order cannot turn curved cells as rigid bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_readings import cell_shapes
from gapbeam.meshes.reference_cells import LagrangeCell
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order

STRAIGHT = 1.0e-6  # of the size of a cell


def bulge(mesh: Any) -> float:
    """Return the largest distance of nodes from their places in straight-sided cells, over the size of their cell.

    Collective.
    """
    shapes = cell_shapes(mesh)
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    largest = 0.0
    if shapes.degree > 1 and cells:
        nodes = mesh.geometry.x[coordinate_dofs(mesh)[:cells]]
        linear, _ = LagrangeCell(shapes.cell, 1).tabulate(shapes.places)
        corners = nodes[:, : linear.shape[1]]
        apart = np.linalg.norm(nodes - linear @ corners, axis=2).max(axis=1)
        largest = float(np.max(apart / np.linalg.norm(np.ptp(corners, axis=1), axis=1)))
    return float(max(mesh.comm.allgather(largest)))


def refuse_curved(mesh: Any, degree: int) -> None:
    """Refuse cells that displacements of a degree cannot turn: a rotation would strain them.

    The field of a rotation is linear in the coordinates. On a cell with straight sides it is one of degree 1, on a
    curved one it has the order of the cell.

    Raises:
        MeshError: The cells are curved, and of a higher order than the displacements.

    Collective.
    """
    order = geometry_order(mesh)
    if degree < order and (found := bulge(mesh)) > STRAIGHT:
        raise MeshError(
            "mesh.degree",
            found=f"{degree}, with curved cells of order {order} (sides bulge by {found:.2g} of a cell)",
            expected=f"{order} or more: displacements of degree {degree} strain such cells where the beam only turns",
            hint=f"mesh.degree = {order}, or a mesh file of order {degree}",
        )
