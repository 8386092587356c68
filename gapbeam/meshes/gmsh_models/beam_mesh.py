"""Structured meshes of quadrilaterals or hexahedra: layers of a cross-section, extruded in gmsh along the beam.

Points become edges, edges faces and faces bodies, each in its physical group. A beam with steps is drawn in layers of
its largest cross-section; cells beside its material are removed.

Triangles or tetrahedra, drawn in gmsh as blocks with points in them.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import gmsh
import numpy as np

from gapbeam.meshes.beam_geometry import BODY, BeamGeometry, BeamStep, groups_of
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_patches import SectionPatches, Side
from gapbeam.meshes.sizing.mesh_size import BeamSizing, CellLength, Positions, even_partition, structured_partition

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
        unit: Length of one unit of the gmsh model, m.

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
        unit: Length of one unit of the gmsh model, m.

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


_BODY_TAG = 1
_NEAR = 1.0e-6


def name_faces(geometry: BeamGeometry, unit: float) -> None:
    """Add the physical groups to the current gmsh model.

    Args:
        geometry: The beam that was drawn, in m.
        unit: Length of one unit of the gmsh model, m.
    """
    dimension = geometry.dimension
    groups = groups_of(geometry)
    entities: dict[str, list[int]] = {name: [] for name in groups}
    for _, tag in gmsh.model.getEntities(dimension - 1):
        box = gmsh.model.getBoundingBox(dimension - 1, tag)
        for name in _faces_at(geometry, unit, box):
            entities[name].append(tag)
    gmsh.model.addPhysicalGroup(dimension, [tag for _, tag in gmsh.model.getEntities(dimension)], _BODY_TAG, BODY)
    for name, tags in entities.items():
        gmsh.model.addPhysicalGroup(dimension - 1, tags, groups[name], name)


def check_faces(dimension: int) -> None:
    """Make sure that gmsh meshed the body and every face: reading an empty group would leave ranks waiting.

    Raises:
        MeshError: a group has no elements.
    """
    for dim, tag in gmsh.model.getPhysicalGroups():
        entities = gmsh.model.getEntitiesForPhysicalGroup(dim, tag)
        if not any(len(tags) for entity in entities for tags in gmsh.model.mesh.getElements(dim, entity)[1]):
            name = gmsh.model.getPhysicalName(dim, tag)
            raise MeshError(f"mesh of dimension {dimension}", found=f"no elements in {name}", expected="some")


def _faces_at(geometry: BeamGeometry, unit: float, box: tuple[float, ...]) -> list[str]:
    """The faces that a plane piece with this bounding box belongs to."""
    low, high = box[:3], box[3:]
    bending = geometry.dimension - 1

    def lies_at(axis: int, value: float) -> bool:
        return all(abs(side[axis] - value / unit) < _NEAR for side in (low, high))

    if lies_at(0, 0.0):
        return ["end"]
    if lies_at(0, geometry.length):
        return ["tip"]
    here = geometry.at(0.5 * (low[0] + high[0]) * unit)
    if here.section is None:
        below, above = (lies_at(bending, side * here.thickness) for side in (-0.5, 0.5))
    else:
        side = _side_of(here.section, unit, (*low[1:], *high[1:]))
        below, above = side == "below", side == "above"
    return [
        span.name
        for span in geometry.spans
        if (below or above if span.around else below if span.below else above)
        and span.start / unit - _NEAR <= low[0]
        and high[0] <= span.end / unit + _NEAR
    ]


def _side_of(section: SectionPatches, unit: float, box: tuple[float, ...]) -> Side:
    """The side of the curve from which a surface with these smallest and largest y and z was extruded."""
    for curve in section.curves:
        lows, highs = (tuple(map(pick, curve.start, curve.end)) for pick in (min, max))
        if all(abs(found - here / unit) < _NEAR for found, here in zip(box, (*lows, *highs), strict=True)):
            return curve.side
    return "inside"


def draw_section(patches: SectionPatches, along: Positions, edges: Sequence[float], unit: float) -> list[Entities]:
    """Draw the section at x = 0 and extrude it over the layers, in the current gmsh model.

    Args:
        patches: The section, in m.
        along: Layer boundaries along x, in m.
        edges: Those of them between which the beam is one volume a patch, in m.
        unit: Length of one unit of the gmsh model, m.

    Returns:
        The volumes between each two edges, in the order of the patches.
    """
    model = gmsh.model.geo
    points = {place: model.addPoint(0.0, place[0] / unit, place[1] / unit) for place in patches.points}
    center = model.addPoint(0.0, 0.0, 0.0) if patches.curved else 0
    curves = []
    for curve in patches.curves:
        start, end = points[curve.start], points[curve.end]
        curves.append(model.addCircleArc(start, center, end) if curve.arc else model.addLine(start, end))
        model.mesh.setTransfiniteCurve(curves[-1], curve.cells + 1)
    surfaces = []
    for patch in patches.patches:
        loop = model.addCurveLoop([-curves[number] if backward else curves[number] for number, backward in patch])
        surfaces.append((2, model.addPlaneSurface([loop])))
        model.mesh.setTransfiniteSurface(surfaces[-1][1])
        model.mesh.setRecombine(*surfaces[-1])
    volumes = extrude_beam(surfaces, along, edges, unit)
    if center:
        model.remove([(0, center)])
    model.synchronize()
    return volumes


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


def cells_that_fill(geometry: BeamGeometry, cell_length: CellLength) -> float:
    """Number of equilateral cells that fill the beam, from the lengths wanted along it."""
    x = structured_partition(geometry.breakpoints(0), cell_length)
    lengths = np.diff(x)
    section = geometry.volume / geometry.length
    share = np.sqrt(3) / 4 if geometry.dimension == 2 else 1 / (6 * np.sqrt(2))
    return float(np.sum(section * lengths / (share * lengths**geometry.dimension)))


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
