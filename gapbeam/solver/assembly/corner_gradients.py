"""The gradient of a vector field at the corners of the cells of a mesh, a mean over the cells that meet at each.

    H(corner) = mean over the cells at the corner of sum_k u_k (dN_k/dX) J^-1,   H = du/dx,  J = dx/dX

Gradients of finite elements jump from cell to cell. Ghost cells are left out, and the shares of all ranks are summed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem, la

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order
from gapbeam.solver.assembly.face_quadrature import lagrange
from gapbeam.solver.system.operators import Array, Indices


@dataclass(frozen=True)
class CornerGradients:
    """Averaged gradients at the corners of a mesh.

    Attributes:
        nodes: Nodes of each cell of this rank, local, (cells, k).
        corners: Its corners, local, (cells, c).
        slopes: Gradients of the basis functions in the reference cell at its corners, (d, c, k).
        inverse: Of the Jacobians at the corners, (cells, c, d, d).
        linear: Linear space, whose nodes are the corners.
        counts: Number of cells of all ranks that meet at each corner that this rank owns, (n,).
    """

    nodes: Indices
    corners: Indices
    slopes: Array
    inverse: Array
    linear: Any
    counts: Array

    @classmethod
    def of_spaces(cls, space: Any, linear: Any) -> CornerGradients:
        """Return the gradients of a space.

        Args:
            space: Blocked vector Lagrange space.
            linear: Blocked linear Lagrange space on the same mesh.

        Collective.
        """
        mesh = space.mesh
        dimension = mesh.topology.dim
        cells = mesh.topology.index_map(dimension).size_local
        cell_type = getattr(basix.CellType, mesh.topology.cell_name())
        at = np.asarray(basix.geometry(cell_type))
        slopes = lagrange(cell_type, space.element.basix_element.degree).tabulate(1, at)[1:, :, :, 0]
        shapes = lagrange(cell_type, geometry_order(mesh)).tabulate(1, at)[1:, :, :, 0]
        places = mesh.geometry.x[coordinate_dofs(mesh)[:cells]][:, :, :dimension]
        jacobians = np.einsum("eka,bck->ecab", places, shapes)
        corners = np.asarray(linear.dofmap.list[:cells], dtype=np.int64)
        nodes = np.asarray(space.dofmap.list[:cells], dtype=np.int64)
        ones = np.ones((*corners.shape, 1))
        counts = _summed(linear, corners, ones)[:, 0]
        return cls(nodes, corners, slopes, np.linalg.inv(jacobians), linear, counts)

    def mean(self, field: fem.Function) -> Array:
        """Return the gradient du_i / dx_j at the corners that this rank owns, (n, d, d).

        Args:
            field: In the space, its ghosts up to date.

        Collective.
        """
        dimension = self.inverse.shape[-1]
        values = field.x.array.reshape(-1, dimension)[self.nodes]
        reference = np.einsum("bck,eki->ecib", self.slopes, values, optimize=True)
        gradients = (reference @ self.inverse).reshape(*self.corners.shape, dimension**2)
        summed = _summed(self.linear, self.corners, gradients) / self.counts[:, None]
        return summed.reshape(-1, dimension, dimension)


def _summed(linear: Any, corners: Indices, values: Array) -> Array:
    """Return sums over the cells of all ranks of values at their corners (cells, c, m), on owned corners (n, m)."""
    index_map, width = linear.dofmap.index_map, values.shape[-1]
    vector = la.vector(index_map, width, np.float64)
    whole = vector.array.reshape(-1, width)
    whole[:] = 0.0
    np.add.at(whole, corners.reshape(-1), values.reshape(-1, width))
    vector.scatter_reverse(la.InsertMode.add)
    return np.array(whole[: index_map.size_local])
