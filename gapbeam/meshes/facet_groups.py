"""Groups of the facets on the surface of a beam that gapbeam meshes, from their places: each rank tags its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from gapbeam.meshes.beam_geometry import BeamGeometry, BeamStep, groups_of
from gapbeam.meshes.mesh_readings import exterior_facets, facet_corners, tagged_facets
from gapbeam.meshes.sections.section_grid import middles

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

NEAR = 1.0e-6  # of the thickness


def facet_groups(mesh: Any, geometry: BeamGeometry) -> Any:
    """Return the tags of the facets at the ends of the beam and of those that face a support. Collective."""
    near, facets = NEAR * geometry.thickness, exterior_facets(mesh)
    corners = facet_corners(mesh, facets)
    low, high = corners[..., 0].min(axis=1, initial=np.inf), corners[..., 0].max(axis=1, initial=-np.inf)
    groups, tags = groups_of(geometry), np.zeros(len(facets), dtype=np.int32)
    tags[high < near] = groups["end"]
    tags[low > geometry.length - near] = groups["tip"]
    for step in geometry.steps or (geometry.at(0.0),):
        here = (tags == 0) & (high - low > near) & (low > step.start - near) & (high < step.end + near)
        below, above = _sides(step, corners[here, :, 1:], near)
        for span in geometry.spans:
            met = below | above if span.around else below if span.below else above
            met = met & (span.start - near <= low[here]) & (high[here] <= span.end + near)
            tags[np.flatnonzero(here)[met]] = groups[span.name]
    named = tags > 0
    return tagged_facets(mesh, facets[named], tags[named])


def _sides(step: BeamStep, corners: Array, near: float) -> tuple[Flags, Flags]:
    """Return flags of facets that face supports below and above, by their corners, (k, corners, d - 1)."""
    if step.section is None:
        heights = corners[..., -1]
        below, above = (np.all(np.abs(heights - side * step.thickness) < near, axis=1) for side in (-0.5, 0.5))
        return np.asarray(below), np.asarray(above)
    curves = [(curve.side, middles(curve)) for curve in step.section.curves if curve.side != "inside"]
    sides = np.concatenate([np.full(len(places), side) for side, places in curves])
    distances, nearest = scipy.spatial.KDTree(np.concatenate([places for _, places in curves])).query(
        corners.mean(axis=1)
    )
    touched = np.where(distances < near, sides[nearest], "inside")
    return touched == "below", touched == "above"
