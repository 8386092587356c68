"""Stiffness and mass of cells, and springs over facets: many at once, by products of matrices.

With the slopes D_qix = d N_i / d x at the quadrature points q of a cell and their weights w_q, one product gives what
all entries are made of,

    H_ixjy = sum_q D_qix w_q D_qjy,
    K_ixjy = lambda H_ixjy + mu (H_iyjx + delta_xy sum_z H_izjz).

A form of the same meaning, as FFCx compiles it, sums every pair of slopes on its own: ten times the time on hexahedra.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import basix
import numpy as np
from petsc4py import PETSc

from gapbeam.meshes.tagged_mesh import determinant
from gapbeam.meshes.versions.mesh_geometry import cell_matrix, coordinate_dofs, geometry_order
from gapbeam.solver.assembly.face_quadrature import facet_type, lagrange
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
        dimension = self.space.mesh.topology.dim
        weights, _, slopes = _tabulated(self.space, cells, stiffness_degree)
        weights = self.width * weights
        count = slopes.shape[2]
        slopes = slopes.reshape(len(cells), weights.shape[1], count * dimension)
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
        _add_cells(self.space, self.of_cells, matrix)


@dataclass(frozen=True)
class CellMass:
    """The mass of the cells of a mesh: int rho N_i N_j dV, the same for each component.

    Attributes:
        space: Blocked Lagrange space.
        density: rho of each cell on this rank, those of other ranks among them, (cells,), kg/m^3.
        width: Factor of all integrals, m in 2D, 1 in 3D.
    """

    space: Any
    density: Array
    width: float

    def of_cells(self, cells: Indices) -> Array:
        """Return the mass of some cells, (cells, n, n), kg, component after component at each node."""
        weights, values, _ = _tabulated(self.space, cells, mass_degree)
        scaled = self.width * self.density[cells, None] * weights
        return _in_components(values.T @ (scaled[..., None] * values), self.space.mesh.topology.dim)

    def add_to(self, matrix: PETSc.Mat) -> None:
        """Add the cells that this rank owns to a matrix that has room for them, and assemble it. Collective."""
        _add_cells(self.space, self.of_cells, matrix)


@dataclass(frozen=True)
class FacetSprings:
    """Springs over facets: int k_x N_i N_j dA for the component x.

    Attributes:
        space: Blocked Lagrange space.
        facets: Exterior facets of this rank, (facets,).
        springs: k of each component, (d,), N/m^3.
        width: Factor of all integrals, m in 2D, 1 in 3D.
    """

    space: Any
    facets: Indices
    springs: Array
    width: float

    @cached_property
    def cells(self) -> Indices:
        """The cells of the facets, (facets,)."""
        topology = self.space.mesh.topology
        topology.create_connectivity(topology.dim - 1, topology.dim)
        topology.create_connectivity(topology.dim, topology.dim - 1)
        return np.array([topology.connectivity(topology.dim - 1, topology.dim).links(one)[0] for one in self.facets],
                        dtype=np.int32)  # fmt: skip

    def add_to(self, matrix: PETSc.Mat) -> None:
        """Add the springs of facets to a matrix that has room for their cells, and assemble it. Collective."""
        topology, nodes = self.space.mesh.topology, self.space.dofmap.list.astype(PETSc.IntType)
        dimension, cells = topology.dim, self.cells
        links = topology.connectivity(dimension, dimension - 1)
        places = np.array(
            [np.flatnonzero(links.links(cell) == one)[0] for one, cell in zip(self.facets, cells, strict=True)],
            dtype=int,
        )
        for place in np.unique(places):
            taken = cells[places == place]
            weights, values = _on_facets(self.space, taken, place)
            scaled = values.T @ (self.width * weights[..., None] * values)
            blocks = scaled[:, :, None, :, None] * np.diag(self.springs)[:, None, :]
            size = blocks.shape[1] * dimension
            matrix.setValuesBlockedLocalRCV(
                nodes[taken], nodes[taken], blocks.reshape(-1, size, size), PETSc.InsertMode.ADD_VALUES
            )
        matrix.assemble()


def assembled(part: CellStiffness | CellMass | FacetSprings) -> PETSc.Mat:
    """Return a part as a symmetric matrix. Collective."""
    matrix = cell_matrix(part.space, part.cells if isinstance(part, FacetSprings) else None)
    part.add_to(matrix)
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix


def _add_cells(space: Any, of_cells: Callable[[Indices], Array], matrix: PETSc.Mat) -> None:
    mesh = space.mesh
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    nodes = space.dofmap.list.astype(PETSc.IntType)
    dimension = mesh.topology.dim
    points = nodes.shape[1] * (geometry_order(mesh) + 1) ** dimension
    chunk = max(AT_ONCE // (points * nodes.shape[1] * dimension), 1)
    for start in range(0, owned, chunk):
        cells = np.arange(start, min(start + chunk, owned))
        matrix.setValuesBlockedLocalRCV(nodes[cells], nodes[cells], of_cells(cells), PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()


def _in_components(scalar: Array, dimension: int) -> Array:
    """Return matrices of nodes, (k, n, n), for each component at the nodes, (k, n d, n d)."""
    count = scalar.shape[1] * dimension
    scalar = 0.5 * (scalar + scalar.transpose(0, 2, 1))
    blocks = scalar[:, :, None, :, None] * np.identity(dimension)[:, None, :]
    return np.asarray(blocks.reshape(-1, count, count))


def _elements(space: Any) -> tuple[Any, Any, Any]:
    """Return the type of the cells, and the elements of displacement and geometry."""
    cell_type = getattr(basix.CellType, space.mesh.topology.cell_name())
    displacement = lagrange(cell_type, space.element.basix_element.degree)
    return cell_type, displacement, lagrange(cell_type, geometry_order(space.mesh))


def _corners(space: Any, cells: Indices) -> Array:
    """Return the nodes of the geometry of cells, (cells, c, d), from the first of them."""
    mesh = space.mesh
    corners = mesh.geometry.x[coordinate_dofs(mesh)[cells]][..., : mesh.topology.dim]
    return np.asarray(corners - corners[:, :1])  # short beside where the cell lies along the beam: no digits are lost


def _tabulated(space: Any, cells: Indices, degree: Callable[[Any, int, int], int]) -> tuple[Array, Array, Array]:
    """Return weights (cells, q), values (q, n) and slopes (cells, q, n, d) at the quadrature points of cells."""
    cell_type, element, geometry = _elements(space)
    points, factors = basix.make_quadrature(cell_type, degree(cell_type, element.degree, geometry.degree))
    shapes = geometry.tabulate(1, points)[1:, ..., 0]
    jacobian = np.einsum("dqk,ckx->cqxd", shapes, _corners(space, cells), optimize=True)
    values, slopes = element.tabulate(1, points)[0, ..., 0], element.tabulate(1, points)[1:, ..., 0]
    weights = factors * np.abs(determinant(jacobian))
    return weights, values, slopes.transpose(1, 2, 0) @ np.linalg.inv(jacobian)


def _on_facets(space: Any, cells: Indices, place: int) -> tuple[Array, Array]:
    """Return weights (cells, q) and values (q, n) on the facets at one place of cells."""
    cell_type, element, geometry = _elements(space)
    dimension = len(basix.topology(cell_type)) - 1
    corners = basix.geometry(cell_type)[basix.topology(cell_type)[dimension - 1][place]]
    points, factors = basix.make_quadrature(
        facet_type(dimension, len(corners)), facet_degree(cell_type, element.degree, geometry.degree)
    )
    tangents = corners[1:dimension] - corners[0]
    on_cell = corners[0] + points @ tangents
    jacobian = np.einsum(
        "td,dqk,ckx->cqtx", tangents, geometry.tabulate(1, on_cell)[1:, ..., 0], _corners(space, cells)
    )
    area = np.sqrt(determinant(jacobian @ jacobian.swapaxes(-1, -2)))
    return factors * area, element.tabulate(0, on_cell)[0, ..., 0]


def stiffness_degree(cell_type: Any, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for the stiffness of cells."""
    if cell_type in SIMPLICES:
        return 2 * (displacement - 1) + _dimension(cell_type) * (geometry - 1)
    return 2 * displacement + _dimension(cell_type) * geometry


def mass_degree(cell_type: Any, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for the mass of cells."""
    lower = 1 if cell_type in SIMPLICES else 0
    return 2 * displacement + _dimension(cell_type) * (geometry - lower)


def facet_degree(cell_type: Any, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for springs over facets."""
    order = geometry - 1 if cell_type in SIMPLICES else geometry
    return 2 * displacement + (2 * (_dimension(cell_type) - 1) * order + 2 if order > 0 else 0)


def _dimension(cell_type: Any) -> int:
    return len(basix.topology(cell_type)) - 1
