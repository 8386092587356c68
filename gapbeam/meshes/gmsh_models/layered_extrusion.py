"""Extrusion over layers in gmsh: points to edges, edges to faces, faces to bodies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import gmsh
import numpy as np

from gapbeam.meshes.sizing.layers import Positions

Entities = list[tuple[int, int]]

COHERENCE = "Geometry.AutoCoherence"


def extruded(entities: Entities, axis: int, positions: Positions) -> tuple[Entities, Entities]:
    """Extrude entities of one dimension over layers; returns their copies at the far end, and what lies in between."""
    reach = positions[-1] - positions[0]
    heights = (positions[1:] - positions[0]) / reach
    heights[-1] = 1.0
    direction = [0.0, 0.0, 0.0]
    direction[axis] = float(reach)
    made = gmsh.model.geo.extrude(
        entities, *direction, numElements=[1] * len(heights), heights=heights.tolist(), recombine=True
    )
    between = entities[0][0] + 1
    pairs = [(before, after) for before, after in pairwise(made) if after[0] == between]  # behind its copy
    return [copy for copy, _ in pairs], [body for _, body in pairs]


def extrude_beam(section: Entities, along: Positions, edges: Sequence[float], unit: float) -> list[Entities]:
    """Extrude a section at x = 0 over the layers of a beam, one body between two edges.

    Args:
        section: Its entities.
        along: Layer boundaries along x, in m.
        edges: Those of them where bodies end, in m.
        unit: What one unit of the gmsh model stands for, in m.

    Returns:
        The bodies between each two edges, in the order of the section.
    """
    bodies = []
    gmsh.option.setNumber(COHERENCE, 0)  # after each body, it would go through all bodies before
    ends = [int(np.searchsorted(along, edge)) for edge in edges]
    for first, last in pairwise((0, *ends, len(along) - 1)):
        section, made = extruded(section, 0, along[first : last + 1] / unit)
        bodies.append(made)
    gmsh.model.geo.removeAllDuplicates()
    gmsh.option.setNumber(COHERENCE, 1)
    return bodies
