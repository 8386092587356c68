"""What layers of the largest cross-section of a beam with steps hold beside its material."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.beam_step import BeamStep
from gapbeam.meshes.gmsh_models.layered_extrusion import Entities
from gapbeam.meshes.gmsh_models.structured import bands
from gapbeam.meshes.sizing.layers import Positions


def beside_sections(geometry: BeamGeometry, volumes: list[Entities]) -> Entities:
    """Return the volumes that are not of the material.

    Args:
        geometry: The beam.
        volumes: Those between each two edges, in the order of the patches of its section.
    """
    return [
        volume
        for step, found in _by_step(geometry, volumes)
        for volume, filled in zip(found, step.filled, strict=True)
        if not filled
    ]


def beside_slice(geometry: BeamGeometry, surfaces: list[Entities], across: Positions) -> Entities:
    """Return the surfaces of a slice that are not of the material.

    Args:
        geometry: The beam.
        surfaces: Those between each two edges, in the order of the bands of the slice.
        across: Boundaries of the layers across the slice, m.
    """
    return [
        surface
        for step, found in _by_step(geometry, surfaces)
        for surface, (low, high) in zip(found, bands(geometry, across), strict=True)
        if abs(low + high) > step.thickness
    ]


def _by_step(geometry: BeamGeometry, bodies: list[Entities]) -> Iterator[tuple[BeamStep, Entities]]:
    """Yield the part of the beam that bodies between two edges belong to, with these; nothing without steps."""
    ends = pairwise((0.0, *geometry.edges, geometry.length))
    for (start, end), found in zip(ends, bodies, strict=True):
        if geometry.steps:
            yield geometry.at(0.5 * (start + end)), found
