"""Layers of quadrilaterals or hexahedra, drawn in gmsh by extrusion."""

from __future__ import annotations

from itertools import pairwise

import gmsh
import numpy as np

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.sizing.layers import Positions, even_partition, structured_partition
from gapbeam.meshes.sizing.mesh_size import BeamSizing


def beam_layers(geometry: BeamGeometry, sizing: BeamSizing) -> list[Positions]:
    """Layer boundaries along each axis, in m.

    They are graded along x and even across the beam; every given point is a corner of cells.
    """
    along = structured_partition(geometry.breakpoints(0), sizing.cell_length(geometry))
    across = [
        even_partition(geometry.breakpoints(axis), count) for axis, count in enumerate(sizing.layers(geometry), start=1)
    ]
    return [along, *across]


def draw_structured(geometry: BeamGeometry, layers: list[Positions], unit: float) -> None:
    """Extrude a corner to an edge, the end face and the beam, in the current gmsh model.

    Args:
        geometry: The beam, in m.
        layers: Layer boundaries along each axis, in m.
        unit: What one unit of the gmsh model stands for, in m.
    """
    corner = [axis[0] / unit for axis in layers] + [0.0]
    section = (0, gmsh.model.geo.addPoint(*corner[:3]))
    for axis in reversed(range(1, geometry.dimension)):
        _, section = _extrude(section, axis, layers[axis] / unit)
    along = layers[0]
    edges = [int(np.searchsorted(along, edge)) for edge in geometry.edges]
    for first, last in pairwise((0, *edges, len(along) - 1)):
        section, _ = _extrude(section, 0, along[first : last + 1] / unit)
    gmsh.model.geo.synchronize()


def _extrude(entity: tuple[int, int], axis: int, positions: Positions) -> tuple[tuple[int, int], ...]:
    """Extrude an entity over the layers; returns its copy at the far end, and what lies in between."""
    reach = positions[-1] - positions[0]
    ends = (positions[1:] - positions[0]) / reach
    ends[-1] = 1.0
    direction = [0.0, 0.0, 0.0]
    direction[axis] = float(reach)
    made = gmsh.model.geo.extrude(
        [entity], *direction, numElements=[1] * len(ends), heights=ends.tolist(), recombine=True
    )
    return made[0], made[1]
