"""Meshes in layers and spaces on them as arrays, where nothing is assembled: what beam and rigid models read.

Attributes have the names that DOLFINx gives them, so that contact points, probes, stresses, fields and figures of both
meshes are read by the same code. Rank 0 owns all cells and nodes; other ranks own none. DOLFINx is not needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.layered_mesh import LayeredMesh
from gapbeam.meshes.reference_cells import LagrangeCell, corners, facets

if TYPE_CHECKING:
    from mpi4py import MPI

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class SerialMap:
    """Numbers of cells, facets or nodes, all on rank 0.

    Attributes:
        size_local: Of this rank.
        size_global: Of all ranks.
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
    """Quadrilaterals or hexahedra of a beam, of order 1 or 2.

    Args:
        comm: The ranks.
        layers: Nodes and cells on rank 0; empty elsewhere.

    Attributes:
        comm: As given.
        geometry: `x`, nodes (n, 3), m; `dim`; `dofmap`, nodes of each cell, (cells, k); `cmap`, its shapes.
        topology: `dim`, `cell_name()`, `index_map(dimension)` of cells and corners.

    Collective to make.
    """

    def __init__(self, comm: MPI.Comm, layers: LayeredMesh) -> None:
        self.comm, order = comm, layers.order
        dimension = layers.points.shape[1]
        cell = ("quadrilateral", "hexahedron")[dimension - 2]
        shapes, axes = LagrangeCell(cell, order), np.arange(dimension)
        places = np.rint(order * shapes.places).astype(int) @ (order + 1) ** axes[::-1]
        cells = np.ascontiguousarray(layers.cells[:, places])
        x = np.zeros((len(layers.points), 3))
        x[:, :dimension] = layers.points
        self.geometry = SimpleNamespace(x=x, dim=dimension, dofmap=cells, cmap=shapes)
        maps = {
            dimension: _numbers(comm, len(cells)),
            0: _numbers(comm, len(np.unique(cells[:, : 2**dimension]))),
        }
        self.topology = SimpleNamespace(dim=dimension, cell_name=lambda: cell, index_map=maps.__getitem__)

    @cached_property
    def facets(self) -> tuple[Indices, Indices]:
        """Cell of each exterior facet and its place in that cell, (facets,) each."""
        cells = self.geometry.dofmap
        sides = np.array(facets(self.topology.cell_name()))
        nodes = np.sort(cells[:, sides], axis=2).reshape(-1, sides.shape[1])
        _, first, count = np.unique(nodes, axis=0, return_index=True, return_counts=True)
        alone = np.sort(first[count == 1])
        return alone // len(sides), alone % len(sides)

    @cached_property
    def facet_corners(self) -> Array:
        """Corners of the exterior facets, (facets, c, d), m."""
        cells, places = self.facets
        sides = np.array(facets(self.topology.cell_name()))
        numbers = self.geometry.dofmap[cells[:, None], sides[places]]
        return np.asarray(self.geometry.x[numbers][..., : self.geometry.dim])

    def h(self, _dimension: int, cells: npt.NDArray[np.int32]) -> Array:
        """Return the largest distance between two corners of cells, m."""
        places = self.geometry.x[self.geometry.dofmap[cells, : 2**self.geometry.dim]]
        return np.asarray(np.linalg.norm(places[:, :, None] - places[:, None], axis=3).max(axis=(1, 2)))

    def cells_near(self, point: Array, padding: float) -> Indices:
        """Return the cells whose nodes have a point, (3,), between them, or nearly so.

        Args:
            point: m.
            padding: How far it may lie outside, m.
        """
        nodes = self.geometry.x[self.geometry.dofmap]
        inside = (nodes.min(axis=1) <= point + padding) & (point - padding <= nodes.max(axis=1))
        return np.flatnonzero(inside.all(axis=1))


class SerialSpace:
    """Vector Lagrange space on a serial mesh.

    Args:
        mesh: The mesh.
        degree: Of the shapes, 1 or 2.

    Attributes:
        mesh: As given.
        degree: As given.
        dofmap: `list`, nodes of each cell, (cells, k); `cell_dofs(cell)`; `index_map`; `index_map_bs`, components.

    Collective to make.
    """

    def __init__(self, mesh: SerialMesh, degree: int) -> None:
        self.mesh, self.degree = mesh, degree
        cells, cell, order = mesh.geometry.dofmap, mesh.topology.cell_name(), mesh.geometry.cmap.degree
        if degree == order:
            self._places, listed = mesh.geometry.x, cells
        else:
            shapes = LagrangeCell(cell, order).tabulate(LagrangeCell(cell, degree).places)[0]
            places = np.einsum("kc,ncx->nkx", shapes, mesh.geometry.x[cells]).reshape(-1, 3)
            _, first, listed = np.unique(_names(cells, cell, degree), axis=0, return_index=True, return_inverse=True)
            self._places, listed = places[first], listed.reshape(len(cells), shapes.shape[0])
        index_map = _numbers(mesh.comm, len(self._places))
        self.dofmap = SimpleNamespace(
            list=listed, cell_dofs=listed.__getitem__, index_map=index_map, index_map_bs=mesh.geometry.dim
        )

    def tabulate_dof_coordinates(self) -> Array:
        """Return the places of the nodes of this rank, (n, 3), m."""
        return np.asarray(self._places)


def _numbers(comm: MPI.Comm, count: int) -> SerialMap:
    return SerialMap(count, comm.bcast(count))


def _names(cells: Indices, cell: str, degree: int) -> Indices:
    """Return the corners between which each node of a degree lies, ascending, -1 for none, (cells k, corners)."""
    values = LagrangeCell(cell, 1).tabulate(LagrangeCell(cell, degree).places)[0]  # of the corners at the nodes
    taken = np.where(values > 0.0, cells[:, None, : len(corners(cell))], -1)
    return np.sort(taken, axis=2).reshape(-1, values.shape[1])


@dataclass(frozen=True)
class FacetTags:
    """Tags of exterior facets of a serial mesh, (k,) each."""

    indices: npt.NDArray[np.integer]
    values: npt.NDArray[np.int32]

    def find(self, value: int) -> npt.NDArray[np.integer]:
        """Return the facets with a tag."""
        return np.asarray(self.indices[self.values == value])
