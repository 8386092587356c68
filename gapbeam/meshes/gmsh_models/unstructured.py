"""Triangles or tetrahedra, drawn in gmsh as blocks with points in them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise

import gmsh
import numpy as np

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.sizing.mesh_size import CellLength, structured_partition


def draw_unstructured(geometry: BeamGeometry, cell_length: CellLength, unit: float) -> None:
    """Draw the beam as blocks between the ends of supports and steps, with the given points as vertices.

    Args:
        geometry: The beam, in m.
        cell_length: Wanted length of edges, in m.
        unit: Length of one unit of the gmsh model, m.
    """
    kernel = gmsh.model.occ
    ends = [0.0, *(edge / unit for edge in geometry.edges), geometry.length / unit]
    blocks = []
    for start, stop in pairwise(ends):
        low, sides = _block(geometry, 0.5 * (start + stop), unit)
        if geometry.dimension == 2:
            blocks.append((2, kernel.addRectangle(start, low[1], 0.0, stop - start, sides[1])))
        else:
            blocks.append((3, kernel.addBox(start, low[1], low[2], stop - start, sides[1], sides[2])))
    points = [
        (0, kernel.addPoint(*(value / unit for value in point), *([0.0] if len(point) == 2 else [])))
        for point in dict.fromkeys(geometry.points)
    ]
    if len(blocks) + len(points) > 1:
        kernel.fragment(blocks, points)
    kernel.synchronize()
    gmsh.model.mesh.setSizeCallback(_size_callback(geometry, cell_length, unit))


def _block(geometry: BeamGeometry, x: float, unit: float) -> tuple[list[float], list[float]]:
    """The smallest coordinates and the sides of the beam at a place, in the units of the model; along x zeros."""
    here = geometry.at(x * unit)
    size = [here.thickness] if geometry.dimension == 2 else [here.width, here.thickness]
    lows = [-side / 2 for side in size]
    return [0.0, *(low / unit for low in lows)], [0.0, *((-low - low) / unit for low in lows)]


def _size_callback(
    geometry: BeamGeometry, cell_length: CellLength, unit: float
) -> Callable[[int, int, float, float, float, float], float]:
    """The wanted length in the units of the model, tabulated: gmsh asks for it very often."""
    breaks = geometry.breakpoints(0)
    x = structured_partition(breaks, cell_length)
    fine = np.unique(np.concatenate([np.linspace(a, b, 9) for a, b in pairwise(x)]))
    positions = [float(position) for position in fine / unit]
    lengths = [float(length) for length in cell_length.ending_at(breaks)(fine) / unit]
    last = len(positions) - 2

    def wanted(_dim: int, _tag: int, x: float, _y: float, _z: float, _length: float) -> float:
        left = min(max(bisect_right(positions, x) - 1, 0), last)
        share = (x - positions[left]) / (positions[left + 1] - positions[left])
        return float(lengths[left] + share * (lengths[left + 1] - lengths[left]))

    return wanted
