"""Structured meshes of quadrilaterals or hexahedra: layers of a cross-section along the beam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_size import BeamSizing, Positions, beam_layers, filled_parts, levels
from gapbeam.meshes.sections.section_grid import SectionGrid, layered_grid, patch_grid

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class LayeredMesh:
    """Nodes and cells of a beam.

    Attributes:
        points: Nodes, (n, d), m.
        cells: Nodes of each cell, axis after axis, x first, (m, (p + 1)^d).
        order: p.
    """

    points: Array
    cells: Indices
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
    cells = list[Indices]()
    for layer, filled in enumerate(filled_parts(geometry, middles)):
        taken = section[np.array(filled)[grid.parts]] if filled else section
        planes = count * (order * layer + np.arange(order + 1))
        cells.append((planes[None, :, None] + taken[:, None]).reshape(len(taken), -1))
    used, numbered = np.unique(np.concatenate(cells), return_inverse=True)
    return LayeredMesh(points[used], numbered.reshape(-1, cells[0].shape[1]), order)
