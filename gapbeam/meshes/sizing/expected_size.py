"""Expected size of a mesh, before it is made."""

from __future__ import annotations

import numpy as np

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.sections.section_patches import SectionPatches
from gapbeam.meshes.sizing.beam_layers import beam_layers
from gapbeam.meshes.sizing.mesh_size import BeamSizing, CellLength, structured_partition

STRUCTURED = ("quadrilateral", "hexahedron")


def expected_cells(geometry: BeamGeometry, sizing: BeamSizing) -> float:
    """Return the number of cells of a beam: exact for layers, about that for triangles and tetrahedra.

    Raises:
        MeshError: The sizes make no sense.
    """
    if geometry.section is not None:
        along = sizing.layers_along(geometry)
        if geometry.steps:
            return sum(_section(geometry, x).cells for x in 0.5 * (along[1:] + along[:-1]))
        return float(geometry.section.cells * (len(along) - 1))
    if sizing.cell_of(geometry.dimension) not in STRUCTURED:
        return cells_that_fill(geometry, sizing.cell_length(geometry))
    count = 1.0
    for axis in beam_layers(geometry, sizing):
        count *= len(axis) - 1
    return count


def expected_nodes(geometry: BeamGeometry, sizing: BeamSizing, degree: int) -> float:
    """Return the number of nodes of degree p: exact for layers, p^2 / 2 a triangle, p^3 / 6 a tetrahedron.

    Raises:
        MeshError: The sizes make no sense.
    """
    if geometry.section is not None:
        along = sizing.layers_along(geometry)
        if geometry.steps:  # but for the nodes where sections meet
            each = [_section(geometry, x).nodes(degree) for x in 0.5 * (along[1:] + along[:-1])]
            return float(each[0] + degree * sum(each))
        return float(geometry.section.nodes(degree) * (degree * (len(along) - 1) + 1))
    if sizing.cell_of(geometry.dimension) not in STRUCTURED:
        share = degree**2 / 2.0 if geometry.dimension == 2 else degree**3 / 6.0
        return share * expected_cells(geometry, sizing)
    count = 1.0
    for axis in beam_layers(geometry, sizing):
        count *= degree * (len(axis) - 1) + 1
    return count


def _section(geometry: BeamGeometry, x: float) -> SectionPatches:
    """Return the patches of the cross-section at a place of a beam with steps."""
    section = geometry.at(x).section
    assert section is not None
    return section


def cells_that_fill(geometry: BeamGeometry, cell_length: CellLength) -> float:
    """Number of equilateral cells that fill the beam, from the lengths wanted along it."""
    x = structured_partition(geometry.breakpoints(0), cell_length)
    lengths = np.diff(x)
    section = geometry.volume / geometry.length
    share = np.sqrt(3) / 4 if geometry.dimension == 2 else 1 / (6 * np.sqrt(2))
    return float(np.sum(section * lengths / (share * lengths**geometry.dimension)))
