"""Meshes and spaces on them as arrays, where nothing is assembled (any more): beam, rigid and reduced models read them.

Attributes have the names that DOLFINx gives them, so that contact points, probes, stresses, fields and figures of both
meshes are read by the same code. Rank 0 owns all cells and nodes; other ranks own none. DOLFINx is not needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_size import BeamSizing, Positions, beam_layers, filled_parts, levels
from gapbeam.meshes.reference_cells import Array, LagrangeCell, corners, facets
from gapbeam.meshes.sections.section_grid import SectionGrid, layered_grid, patch_grid

if TYPE_CHECKING:
    from mpi4py import MPI

Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class LayeredMesh:
    """Nodes and cells of a beam.

    Attributes:
        points: Nodes, (n, d), m.
        cells: Nodes of each cell, axis after axis, x first, (m, (p + 1)^d).
        order: p.
    """

    points: Array
    cells: Numbers
    order: int

    @classmethod
    def empty(cls, dimension: int, order: int) -> LayeredMesh:
        """Return a mesh without cells, for ranks that others send cells to."""
        return cls(np.empty((0, dimension)), np.empty((0, (order + 1) ** dimension), dtype=np.int64), order)

    @property
    def centers(self) -> Array:
        """Mean places of the corners of the cells, (m, 3), m."""
        dimension, at = self.points.shape[1], (-1, *(self.order + 1,) * self.points.shape[1])
        corners = self.cells.reshape(at)[(slice(None), *(slice(None, None, self.order),) * dimension)]
        found = self.points[corners.reshape(-1, 2**dimension)].mean(axis=1)
        return np.pad(found, ((0, 0), (0, 3 - dimension)))


def layered_mesh(geometry: BeamGeometry, sizing: BeamSizing) -> LayeredMesh:
    """Return the structured mesh of a beam.

    The layers of the largest cross-section of a beam with steps go on through all of it; cells beside the material are
    left out.

    Raises:
        MeshError: The sizes make no sense.
    """
    if geometry.section is not None:
        along: Positions = sizing.layers_along(geometry)
        grid = patch_grid(geometry.section)
    else:
        along, *across = beam_layers(geometry, sizing)
        grid = layered_grid(across, levels(geometry))
    return _extruded(geometry, along, grid)


def _extruded(geometry: BeamGeometry, along: Positions, grid: SectionGrid) -> LayeredMesh:
    order, count = grid.cells.shape[1] - 1, len(grid.nodes)
    middles = 0.5 * (along[1:] + along[:-1])
    x = along
    if order == 2:
        x = np.empty(2 * len(along) - 1)
        x[::2], x[1::2] = along, middles
    points = np.concatenate([np.repeat(x, count)[:, None], np.tile(grid.nodes, (len(x), 1))], axis=1)
    section = grid.cells.reshape(len(grid.cells), -1)
    cells = list[Numbers]()
    for layer, filled in enumerate(filled_parts(geometry, middles)):
        taken = section[np.array(filled)[grid.parts]] if filled else section
        planes = count * (order * layer + np.arange(order + 1))
        cells.append((planes[None, :, None] + taken[:, None]).reshape(len(taken), -1))
    used, numbered = np.unique(np.concatenate(cells), return_inverse=True)
    return LayeredMesh(points[used], numbered.reshape(-1, cells[0].shape[1]), order)


Indices = npt.NDArray[np.integer]
DIMENSIONS = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}
CORNERS = {"triangle": 3, "quadrilateral": 4, "tetrahedron": 4, "hexahedron": 8}
NONE = 1.0e-9  # of a shape at a node: round-off


@dataclass(frozen=True)
class SerialMap:
    """Numbers of cells, facets or nodes, all on rank 0.

    Attributes:
        size_local: Number on this rank.
        size_global: Number over all ranks.
    """

    size_local: int
    size_global: int

    @property
    def local_range(self) -> tuple[int, int]:
        """First number of this rank, and the one after its last."""
        return self.size_global - self.size_local, self.size_global

    @staticmethod
    def local_to_global(numbers: Indices) -> Indices:
        """Return global numbers of local ones."""
        return numbers


class SerialMesh:
    """Cells of a beam, of order 1 or 2, with all nodes.

    Args:
        comm: The ranks.
        cell: Type of the cells, such as "hexahedron".
        order: Order of their shapes.
        x: Nodes, (n, 3), m; (0, 3) on ranks but the first one.
        cells: Nodes of each cell in the order of basix, (cells, k).

    Attributes:
        comm: As given.
        geometry: `x`, `dim`, `dofmap` for the cells, and `cmap` for their shapes.
        topology: `dim`, `cell_name()`, `index_map(dimension)` of cells and corners.

    Collective to make.
    """

    def __init__(self, comm: MPI.Comm, cell: str, order: int, x: Array, cells: Indices) -> None:
        self.comm, dimension = comm, DIMENSIONS[cell]
        self._made_of = (comm, cell, order, x, cells)
        self.geometry = SimpleNamespace(x=x, dim=dimension, dofmap=cells, cmap=LagrangeCell(cell, order))
        maps = {
            dimension: _numbers(comm, len(cells)),
            0: _numbers(comm, len(np.unique(cells[:, : CORNERS[cell]]))),
        }
        self.topology = SimpleNamespace(dim=dimension, cell_name=lambda: cell, index_map=maps.__getitem__)

    @classmethod
    def of_layers(cls, comm: MPI.Comm, layers: LayeredMesh) -> SerialMesh:
        """Return the mesh of layers on rank 0, empty elsewhere. Collective."""
        order, dimension = layers.order, layers.points.shape[1]
        cell = ("quadrilateral", "hexahedron")[dimension - 2]
        places = np.rint(order * LagrangeCell(cell, order).places).astype(int)
        numbers = places @ (order + 1) ** np.arange(dimension)[::-1]
        x = np.zeros((len(layers.points), 3))
        x[:, :dimension] = layers.points
        return cls(comm, cell, order, x, np.ascontiguousarray(layers.cells[:, numbers]))

    def __reduce__(self) -> tuple[type[SerialMesh], tuple[Any, ...]]:
        return type(self), self._made_of

    @cached_property
    def facets(self) -> tuple[Indices, Indices]:
        """Cell of each exterior facet and its place in that cell, (facets,) each."""
        cells = self.geometry.dofmap
        sides = np.array(facets(self.topology.cell_name()))
        nodes = np.sort(cells[:, sides], axis=2).reshape(-1, sides.shape[1])
        _, first, count = np.unique(nodes, axis=0, return_index=True, return_counts=True)
        alone = np.sort(first[count == 1])
        return alone // len(sides), alone % len(sides)

    def facets_at(self, cells: Indices, places: Indices) -> Indices:
        """Return the numbers of exterior facets, given the cell of each and its place in that cell.

        Raises:
            ValueError: A facet lies between two cells.
        """
        sides = len(facets(self.topology.cell_name()))
        known, asked = self.facets[0] * sides + self.facets[1], cells * sides + places
        found = np.minimum(np.searchsorted(known, asked), len(known) - 1)
        if not np.array_equal(known[found], asked):
            raise ValueError("a facet between two cells")
        return found

    @cached_property
    def facet_corners(self) -> Array:
        """Corners of the exterior facets, (facets, c, d), m."""
        cells, places = self.facets
        sides = np.array(facets(self.topology.cell_name()))
        numbers = self.geometry.dofmap[cells[:, None], sides[places]]
        return np.asarray(self.geometry.x[numbers][..., : self.geometry.dim])

    def h(self, _dimension: int, cells: npt.NDArray[np.int32]) -> Array:
        """Return the largest distance between two corners of cells, m."""
        places = self.geometry.x[self.geometry.dofmap[cells, : CORNERS[self.topology.cell_name()]]]
        return np.asarray(np.linalg.norm(places[:, :, None] - places[:, None], axis=3).max(axis=(1, 2)))

    def cells_near(self, point: Array, padding: float) -> Indices:
        """Return the cells whose nodes have a point, (3,), between them, or nearly so.

        Args:
            point: m.
            padding: Distance by which the point may lie outside, m.
        """
        nodes = self.geometry.x[self.geometry.dofmap]
        inside = (nodes.min(axis=1) <= point + padding) & (point - padding <= nodes.max(axis=1))
        return np.flatnonzero(inside.all(axis=1))


class SerialSpace:
    """Vector Lagrange space on a serial mesh.

    Args:
        mesh: The mesh.
        degree: Degree of the shapes, 1 or 2.
        nodes: Places of the nodes, (n, 3), m, and nodes of each cell, (cells, k); None: numbered here.

    Attributes:
        mesh: As given.
        degree: As given.
        dofmap: `list`, nodes of each cell, (cells, k); `cell_dofs(cell)`; `index_map`; `index_map_bs`, components.

    Collective to make.
    """

    def __init__(self, mesh: SerialMesh, degree: int, nodes: tuple[Array, Indices] | None = None) -> None:
        self.mesh, self.degree = mesh, degree
        self._places, listed = self._nodes = nodes or _nodes_of(mesh, degree)
        self.dofmap = SimpleNamespace(
            list=listed,
            cell_dofs=listed.__getitem__,
            index_map=_numbers(mesh.comm, len(self._places)),
            index_map_bs=mesh.geometry.dim,
        )

    def __reduce__(self) -> tuple[type[SerialSpace], tuple[Any, ...]]:
        return type(self), (self.mesh, self.degree, self._nodes)

    def tabulate_dof_coordinates(self) -> Array:
        """Return the places of the nodes of this rank, (n, 3), m."""
        return np.asarray(self._places)


def _numbers(comm: MPI.Comm, count: int) -> SerialMap:
    return SerialMap(count, comm.bcast(count))


def _nodes_of(mesh: SerialMesh, degree: int) -> tuple[Array, Indices]:
    """Return the places of the nodes of a degree, (n, 3), m, and those of each cell, (cells, k)."""
    cells, cell, order = mesh.geometry.dofmap, mesh.topology.cell_name(), mesh.geometry.cmap.degree
    if degree == order:
        return mesh.geometry.x, cells
    shapes = LagrangeCell(cell, order).tabulate(LagrangeCell(cell, degree).places)[0]
    places = np.einsum("kc,ncx->nkx", shapes, mesh.geometry.x[cells]).reshape(-1, 3)
    _, first, listed = np.unique(_names(cells, cell, degree), axis=0, return_index=True, return_inverse=True)
    return places[first], listed.reshape(len(cells), shapes.shape[0])


def _names(cells: Indices, cell: str, degree: int) -> Indices:
    """Return the corners between which each node of a degree lies, ascending, -1 for none, (cells k, corners)."""
    values = LagrangeCell(cell, 1).tabulate(LagrangeCell(cell, degree).places)[0]  # of the corners at the nodes
    taken = np.where(values > NONE, cells[:, None, : len(corners(cell))], -1)
    return np.sort(taken, axis=2).reshape(-1, values.shape[1])


@dataclass(frozen=True)
class FacetTags:
    """Tags of exterior facets of a serial mesh, (k,) each."""

    indices: npt.NDArray[np.integer]
    values: npt.NDArray[np.int32]

    def find(self, value: int) -> npt.NDArray[np.integer]:
        """Return the facets with a tag."""
        return np.asarray(self.indices[self.values == value])
