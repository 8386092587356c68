"""Names of the groups of cells and facets of a beam."""

from __future__ import annotations

from gapbeam.meshes.beam_geometry import BeamGeometry

BODY = "body"
"""The group of all cells."""

ENDS = {"end": 3, "tip": 4}
"""Facets across the beam and their tags in meshes that gapbeam builds; end is at x = 0, tip at x = length."""

_FIRST_TAGS, _FURTHER_TAGS = (1, 2), 11


def contact_faces(geometry: BeamGeometry) -> tuple[str, ...]:
    """Return the names of the groups of facets that face a support."""
    return tuple(span.name for span in geometry.spans)


def groups_of(geometry: BeamGeometry) -> dict[str, int]:
    """Return all groups of facets and their tags in meshes that gapbeam builds."""
    names = contact_faces(geometry)
    tags = (*_FIRST_TAGS, *range(_FURTHER_TAGS, _FURTHER_TAGS + len(names)))
    return dict(zip(names, tags, strict=False)) | ENDS
