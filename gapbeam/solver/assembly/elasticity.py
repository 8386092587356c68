"""Isotropic linear elasticity in 3D, plane stress and plane strain: mass, stiffness and restraint, cell by cell.

    a(u, v) = int sigma(u) : eps(v),   m(u, v) = int rho u . v,   r(u, v) = int_faces k_t u_t . v_t

In 2D every part carries the width of the beam, so that forces are whole forces in N.

Stiffness and mass of cells, and springs over facets: many at once, by products of matrices.

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
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gapbeam.meshes import reference_cells
from gapbeam.meshes.mesh_readings import cell_shapes, displacement_shapes, facet_cells
from gapbeam.meshes.reference_cells import SIMPLICES
from gapbeam.meshes.serial_mesh import SerialSpace
from gapbeam.meshes.tagged_mesh import determinant
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order
from gapbeam.solver.case.beam_profile import BeamPiece, BeamProfile, Material
from gapbeam.solver.system.operators import Array, Indices

if TYPE_CHECKING:
    from petsc4py import PETSc


def in_cells(mesh: Any, profile: BeamProfile, value: Callable[[BeamPiece], float]) -> Array:
    """Return a value of the pieces of a beam in each cell on this rank, those of other ranks among them, (cells,).

    Args:
        mesh: Its cells lie in one piece each.
        profile: The beam along x.
        value: Value of a piece.
    """
    middles = mesh.geometry.x[coordinate_dofs(mesh), 0].mean(axis=1)
    values = np.array([value(piece) for piece in profile.pieces])
    return np.asarray(values[np.searchsorted(profile.steps, middles)])


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

    def of_nodes(self) -> Array:
        """Return the diagonal of the mass of one component, on the nodes that this rank owns, (n,), kg. Collective."""
        owned, components = self.space.dofmap.index_map.size_local, self.space.dofmap.index_map_bs
        if isinstance(self.space, SerialSpace):
            nodes = self.space.dofmap.list
            of_cells = self.of_cells(np.arange(len(nodes)))
            diagonal = np.einsum("cii->ci", of_cells)[:, ::components]
            return np.asarray(np.bincount(nodes.reshape(-1), diagonal.reshape(-1), owned), dtype=float)
        matrix = assembled(self)
        found = np.array(matrix.getDiagonal().array_r)[: owned * components : components]
        matrix.destroy()
        return found

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
    def _found(self) -> tuple[Indices, Indices]:
        return facet_cells(self.space.mesh, self.facets)

    @property
    def cells(self) -> npt.NDArray[np.int32]:
        """The cells of the facets, (facets,)."""
        return self._found[0].astype(np.int32)

    def add_to(self, matrix: PETSc.Mat) -> None:
        """Add the springs of facets to a matrix that has room for their cells, and assemble it. Collective."""
        from petsc4py import PETSc

        nodes, dimension = self.space.dofmap.list.astype(PETSc.IntType), self.space.mesh.topology.dim
        cells, places = self._found
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
    from petsc4py import PETSc

    from gapbeam.meshes.versions.mesh_geometry import cell_matrix

    matrix = cell_matrix(part.space, part.cells if isinstance(part, FacetSprings) else None)
    part.add_to(matrix)
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix


def _add_cells(space: Any, of_cells: Callable[[Indices], Array], matrix: PETSc.Mat) -> None:
    from petsc4py import PETSc

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


def _corners(space: Any, cells: Indices) -> Array:
    """Return the nodes of the geometry of cells, (cells, c, d), from the first of them."""
    mesh = space.mesh
    corners = mesh.geometry.x[coordinate_dofs(mesh)[cells]][..., : mesh.topology.dim]
    return np.asarray(corners - corners[:, :1])  # short beside where the cell lies along the beam: no digits are lost


def _tabulated(space: Any, cells: Indices, degree: Callable[[str, int, int], int]) -> tuple[Array, Array, Array]:
    """Return weights (cells, q), values (q, n) and slopes (cells, q, n, d) at the quadrature points of cells."""
    element, geometry = displacement_shapes(space), cell_shapes(space.mesh)
    points, factors = reference_cells.quadrature(element.cell, degree(element.cell, element.degree, geometry.degree))
    jacobian = np.einsum("dqk,ckx->cqxd", geometry.tabulate(points)[1], _corners(space, cells), optimize=True)
    values, slopes = element.tabulate(points)
    weights = factors * np.abs(determinant(jacobian))
    return weights, values, slopes.transpose(1, 2, 0) @ np.linalg.inv(jacobian)


def _on_facets(space: Any, cells: Indices, place: int) -> tuple[Array, Array]:
    """Return weights (cells, q) and values (q, n) on the facets at one place of cells."""
    element, geometry = displacement_shapes(space), cell_shapes(space.mesh)
    cell = element.cell
    corners = reference_cells.corners(cell)[list(reference_cells.facets(cell)[place])]
    points, factors = reference_cells.quadrature(
        reference_cells.FACETS[cell], facet_degree(cell, element.degree, geometry.degree)
    )
    tangents = corners[1 : corners.shape[1]] - corners[0]
    on_cell = corners[0] + points @ tangents
    jacobian = np.einsum("td,dqk,ckx->cqtx", tangents, geometry.tabulate(on_cell)[1], _corners(space, cells))
    area = np.sqrt(determinant(jacobian @ jacobian.swapaxes(-1, -2)))
    return factors * area, element.tabulate(on_cell)[0]


def stiffness_degree(cell: str, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for the stiffness of cells."""
    if cell in SIMPLICES:
        return 2 * (displacement - 1) + reference_cells.corners(cell).shape[1] * (geometry - 1)
    return 2 * displacement + reference_cells.corners(cell).shape[1] * geometry


def mass_degree(cell: str, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for the mass of cells."""
    lower = 1 if cell in SIMPLICES else 0
    return 2 * displacement + reference_cells.corners(cell).shape[1] * (geometry - lower)


def facet_degree(cell: str, displacement: int, geometry: int) -> int:
    """Return the degree of quadrature that UFL would choose for springs over facets."""
    order = geometry - 1 if cell in SIMPLICES else geometry
    return 2 * displacement + (2 * (reference_cells.corners(cell).shape[1] - 1) * order + 2 if order > 0 else 0)


@dataclass(frozen=True)
class ElasticParts:
    """Bilinear forms on a vector space.

    Attributes:
        mass: m, cell by cell.
        stiffness: a, likewise.
        restraint: r, facet by facet.
    """

    mass: CellMass
    stiffness: CellStiffness
    restraint: FacetSprings


def lame(material: Material, plane_stress: bool) -> tuple[float, float]:
    """Return (lambda, mu), Pa; lambda is the reduced 2 lambda mu / (lambda + 2 mu) in plane stress."""
    E, nu = material.young_modulus, material.poisson_ratio
    mu = E / (2.0 * (1.0 + nu))
    full = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return (2.0 * full * mu / (full + 2.0 * mu) if plane_stress else full), mu


def elastic_parts(
    space: Any,
    profile: BeamProfile,
    plane_stress: bool,
    width: float,
    restraint: tuple[float, float],
    facets: Indices,
) -> ElasticParts:
    """Return mass, stiffness and restraint of a beam.

    Args:
        space: Vector Lagrange space.
        profile: Elastic constants and density along the beam.
        plane_stress: 2D assumption; no meaning in 3D.
        width: Factor of all integrals: the width in 2D, 1 in 3D, m.
        restraint: Tangential stiffness per area along x and across the width, Pa/m.
        facets: Exterior facets of this rank that are restrained.
    """
    mesh, dimension = space.mesh, space.mesh.geometry.dim
    plane = plane_stress and dimension == 2
    first = in_cells(mesh, profile, lambda piece: lame(piece.material, plane)[0])
    second = in_cells(mesh, profile, lambda piece: lame(piece.material, plane)[1])
    springs = np.array([*restraint[: dimension - 1], 0.0])
    return ElasticParts(
        mass_of(space, profile, width),
        CellStiffness(space, first, second, width),
        FacetSprings(space, facets, springs, width),
    )


def mass_of(space: Any, profile: BeamProfile, width: float) -> CellMass:
    """Return the mass of a beam on a vector Lagrange space; width as in `elastic_parts`."""
    return CellMass(space, in_cells(space.mesh, profile, lambda piece: piece.material.density), width)
