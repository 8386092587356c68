"""Layers of quadrilaterals or hexahedra, drawn in gmsh by extrusion."""

from __future__ import annotations

import gmsh

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.gmsh_models.layered_extrusion import extrude_beam, extruded
from gapbeam.meshes.sizing.layers import Positions, even_partition
from gapbeam.meshes.sizing.mesh_size import BeamSizing


def beam_layers(geometry: BeamGeometry, sizing: BeamSizing) -> list[Positions]:
    """Layer boundaries along each axis, in m.

    They are graded along x and even across the beam; every given point is a corner of cells.
    """
    along = sizing.layers_along(geometry)
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
    section = [(0, gmsh.model.geo.addPoint(*corner[:3]))]
    for axis in reversed(range(1, geometry.dimension)):
        _, section = extruded(section, axis, layers[axis] / unit)
    extrude_beam(section, layers[0], geometry.edges, unit)
    gmsh.model.geo.synchronize()
