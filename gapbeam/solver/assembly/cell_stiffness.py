"""Elastic stiffness of cells: many at once, by products of matrices.

With the slopes D_qix = d N_i / d x at the quadrature points q of a cell and their weights w_q, one product gives what
all entries are made of,

    H_ixjy = sum_q D_qix w_q D_qjy,
    K_ixjy = lambda H_ixjy + mu (H_iyjx + delta_xy sum_z H_izjz).

A form of the same meaning, as FFCx compiles it, sums every pair of slopes on its own: ten times the time on hexahedra.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from petsc4py import PETSc

from gapbeam.meshes.section_figures import determinant
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order
from gapbeam.solver.assembly.face_quadrature import lagrange
from gapbeam.solver.system.operators import Array, Indices

SIMPLICES = (basix.CellType.triangle, basix.CellType.tetrahedron)
AT_ONCE = 2**22  # slopes that are held at once


@dataclass(frozen=True)
class CellStiffness:
    """The elastic stiffness of the cells of a mesh.

    Attributes:
        space: Blocked Lagrange space.
        first: lambda of each cell on this rank, those of other ranks among them, (cells,), Pa.
        second: mu, likewise.
        width: Factor of all integrals, m in 2D, 1 in 3D.
    """

    space: Any
    first: Array
    second: Array
    width: float

    def of_cells(self, cells: Indices) -> Array:
        """Return the stiffness of some cells, symmetric, (cells, n, n), N/m, component after component at each node."""
        mesh = self.space.mesh
        dimension = mesh.topology.dim
        cell_type = getattr(basix.CellType, mesh.topology.cell_name())
        element = lagrange(cell_type, self.space.element.basix_element.degree)
        geometry = lagrange(cell_type, geometry_order(mesh))
        points, factors = basix.make_quadrature(cell_type, _degree(cell_type, element.degree, geometry.degree))
        corners = mesh.geometry.x[coordinate_dofs(mesh)[cells]][..., :dimension]
        corners -= corners[:, :1].copy()  # short beside where the cell lies along the beam: no digits are lost
        jacobian = np.einsum("dqk,ckx->cqxd", geometry.tabulate(1, points)[1:, ..., 0], corners, optimize=True)
        weights = self.width * factors * np.abs(determinant(jacobian))
        slopes = element.tabulate(1, points)[1:, ..., 0].transpose(1, 2, 0) @ np.linalg.inv(jacobian)
        count = slopes.shape[2]
        slopes = slopes.reshape(len(cells), len(points), count * dimension)
        products = slopes.transpose(0, 2, 1) @ (weights[..., None] * slopes)  # some rules have negative weights
        products = products.reshape(len(cells), count, dimension, count, dimension)
        first, second = (moduli[cells, None, None, None, None] for moduli in (self.first, self.second))
        stiffness = first * products + second * products.transpose(0, 1, 4, 3, 2)
        laplace = self.second[cells, None, None] * np.einsum("cizjz->cij", products)
        for component in range(dimension):
            stiffness[:, :, component, :, component] += laplace
        stiffness = stiffness.reshape(len(cells), count * dimension, count * dimension)
        return np.asarray(0.5 * (stiffness + stiffness.transpose(0, 2, 1)))

    def add_to(self, matrix: PETSc.Mat) -> None:
        """Add the cells that this rank owns to a matrix that has room for them, and assemble it. Collective."""
        mesh = self.space.mesh
        owned = mesh.topology.index_map(mesh.topology.dim).size_local
        nodes = self.space.dofmap.list.astype(PETSc.IntType)
        dimension = mesh.topology.dim
        points = nodes.shape[1] * (geometry_order(mesh) + 1) ** dimension
        chunk = max(AT_ONCE // (points * nodes.shape[1] * dimension), 1)
        for start in range(0, owned, chunk):
            cells = np.arange(start, min(start + chunk, owned))
            blocks = self.of_cells(cells)
            matrix.setValuesBlockedLocalRCV(nodes[cells], nodes[cells], blocks, PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()


def _degree(cell_type: Any, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for these cells."""
    if cell_type in SIMPLICES:
        return 2 * (displacement - 1) + _dimension(cell_type) * (geometry - 1)
    return 2 * displacement + _dimension(cell_type) * geometry


def _dimension(cell_type: Any) -> int:
    return len(basix.topology(cell_type)) - 1
