"""The physical groups of a gmsh model that gapbeam drew."""

from __future__ import annotations

import gmsh

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.group_names import BODY, groups_of
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_curve import Side
from gapbeam.meshes.sections.section_patches import SectionPatches

_BODY_TAG = 1
_NEAR = 1.0e-6


def name_faces(geometry: BeamGeometry, unit: float) -> None:
    """Add the physical groups to the current gmsh model.

    Args:
        geometry: The beam that was drawn, in m.
        unit: What one unit of the gmsh model stands for, in m.
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
