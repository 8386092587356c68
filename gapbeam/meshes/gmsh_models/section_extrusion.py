"""Hexahedra of a cross-section of patches, drawn in gmsh by extrusion along the beam."""

from __future__ import annotations

from collections.abc import Sequence

import gmsh

from gapbeam.meshes.gmsh_models.layered_extrusion import Entities, extrude_beam
from gapbeam.meshes.sections.section_patches import SectionPatches
from gapbeam.meshes.sizing.layers import Positions


def draw_section(patches: SectionPatches, along: Positions, edges: Sequence[float], unit: float) -> list[Entities]:
    """Draw the section at x = 0 and extrude it over the layers, in the current gmsh model.

    Args:
        patches: The section, in m.
        along: Layer boundaries along x, in m.
        edges: Those of them between which the beam is one volume a patch, in m.
        unit: What one unit of the gmsh model stands for, in m.

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
