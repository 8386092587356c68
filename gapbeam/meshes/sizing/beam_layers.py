"""Boundaries of structured layers along and across a beam."""

from __future__ import annotations

from itertools import pairwise

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.sizing.mesh_size import BeamSizing, CellLength, Positions, even_partition, structured_partition


def beam_layers(geometry: BeamGeometry, sizing: BeamSizing) -> list[Positions]:
    """Return layer boundaries along each axis, m.

    They are graded along x and even across the beam; every given point is a corner of cells. Across a slice with steps
    the layers are as thin as the thinnest part there asks for.
    """
    along, counts = sizing.layers_along(geometry), sizing.layers(geometry)
    if geometry.steps:
        (count,) = counts
        parts = [
            (high, [step.thickness for step in geometry.steps if step.thickness > abs(low + high)])
            for low, high in pairwise(levels(geometry))
        ]
        lengths = CellLength(tuple((high, min(there) / count) for high, there in parts))
        return [along, structured_partition(geometry.breakpoints(1), lengths)]
    across = [even_partition(geometry.breakpoints(axis), count) for axis, count in enumerate(counts, start=1)]
    return [along, *across]


def levels(geometry: BeamGeometry) -> tuple[float, ...]:
    """Return the heights between which the bands of layers of a slice lie, m: one band without steps."""
    found = {side * step.thickness for step in geometry.steps for side in (-0.5, 0.5)}
    inner = sorted(found - {geometry.lower[-1], geometry.upper[-1]})
    return (geometry.lower[-1], *inner, geometry.upper[-1])


def filled_parts(geometry: BeamGeometry, x: Positions) -> list[tuple[bool, ...]]:
    """Return flags of the bands of a slice, or patches of a section, that the beam fills at places; () for all."""
    found = list[tuple[bool, ...]]()
    for place in x:
        here = geometry.at(float(place))
        if not geometry.steps:
            found.append(())
        elif here.section is not None:
            found.append(here.filled)
        else:
            found.append(tuple(abs(low + high) <= here.thickness for low, high in pairwise(levels(geometry))))
    return found
