"""Layers of quadrilaterals or hexahedra, drawn in gmsh by extrusion."""

from __future__ import annotations

from itertools import pairwise

import gmsh
import numpy as np

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.gmsh_models.layered_extrusion import Entities, extrude_beam, extruded
from gapbeam.meshes.sizing.cell_length import CellLength
from gapbeam.meshes.sizing.layers import Positions, even_partition, structured_partition
from gapbeam.meshes.sizing.mesh_size import BeamSizing


def beam_layers(geometry: BeamGeometry, sizing: BeamSizing) -> list[Positions]:
    """Layer boundaries along each axis, in m.

    They are graded along x and even across the beam; every given point is a corner of cells. Across a slice with steps
    the layers are as thin as the thinnest part there asks for.
    """
    along, counts = sizing.layers_along(geometry), sizing.layers(geometry)
    if geometry.steps:
        (count,) = counts
        levels = bands(geometry, np.array([geometry.lower[-1], geometry.upper[-1]]))
        parts = [
            (high, [step.thickness for step in geometry.steps if step.thickness > abs(low + high)])
            for low, high in levels
        ]
        lengths = CellLength(tuple((high, min(there) / count) for high, there in parts))
        return [along, structured_partition(geometry.breakpoints(1), lengths)]
    across = [even_partition(geometry.breakpoints(axis), count) for axis, count in enumerate(counts, start=1)]
    return [along, *across]


def draw_structured(geometry: BeamGeometry, layers: list[Positions], unit: float) -> list[Entities]:
    """Extrude a corner to an edge, the end face and the beam, in the current gmsh model.

    Args:
        geometry: The beam, in m.
        layers: Layer boundaries along each axis, in m.
        unit: What one unit of the gmsh model stands for, in m.

    Returns:
        The bodies between each two edges of the beam, in the order of `bands`.
    """
    corner = [axis[0] / unit for axis in layers] + [0.0]
    section = [(0, gmsh.model.geo.addPoint(*corner[:3]))]
    for axis in reversed(range(1, geometry.dimension)):
        section = _sides(section, axis, geometry, layers[axis], unit)
    bodies = extrude_beam(section, layers[0], geometry.edges, unit)
    gmsh.model.geo.synchronize()
    return bodies


def bands(geometry: BeamGeometry, across: Positions) -> list[tuple[float, float]]:
    """Return lowest and highest place of the bands of layers that a slice is made of, m: one without steps."""
    levels = {side * step.thickness for step in geometry.steps for side in (-0.5, 0.5)}
    inner = sorted(levels - {geometry.lower[-1], geometry.upper[-1]})
    return list(pairwise((float(across[0]), *inner, float(across[-1]))))


def _sides(section: Entities, axis: int, geometry: BeamGeometry, positions: Positions, unit: float) -> Entities:
    """Extrude along an axis across the beam, band by band in a slice with steps; returns what lies in between."""
    if axis != geometry.dimension - 1 or not geometry.steps:
        return extruded(section, axis, positions / unit)[1]
    found: Entities = []
    for low, high in bands(geometry, positions):
        first, last = (int(np.argmin(np.abs(positions - end))) for end in (low, high))
        section, made = extruded(section, axis, positions[first : last + 1] / unit)
        found += made
    return found
