"""Which facets of the surface of a beam face its supports: in a plane the lines of its outline."""

from __future__ import annotations

from typing import Protocol

import meshio
import numpy as np

from gapbeam.postprocess.scene.support_surface import SupportBoxes

_ON_CIRCLE = 1.0e-3  # of the radius
_NEAR = 1.0e-6
_LEAST_FACING = 1.0e-3


class MeshedBody(Protocol):
    """What surfaces are taken of: the fields of a run, or a mesh alone."""

    @property
    def points(self) -> np.ndarray:
        """(points, 3), m."""

    @property
    def cells(self) -> list[meshio.CellBlock]:
        """Their corners, by type of cell."""


def facing(facets: np.ndarray, normals: np.ndarray, points: np.ndarray, support: SupportBoxes) -> dict[str, np.ndarray]:
    """Which facets of the surface face each plane of the supports, (facets,) by face: flat and curved ones alike.

    These are the facets along the block whose outward normal points at it, on its side of the middle of the section.

    Args:
        facets: Numbers of their points, (facets, corners).
        normals: Component in the bending direction of the outward unit normals, (facets,).
        points: Of the mesh, (n, 3), m.
        support: Beam and support.
    """
    near = _NEAR * (support.end - support.start)
    first, last = points[facets, 0].min(axis=1, initial=np.inf), points[facets, 0].max(axis=1, initial=-np.inf)
    height = points[facets, support.dimension - 1].mean(axis=1)
    middle = 0.5 * (support.bottom + support.top)
    radii = np.hypot(points[facets, 1], points[facets, support.dimension - 1] - middle)
    radius = radii.min(axis=1, initial=np.inf)
    down = (normals < -_LEAST_FACING) & (height < middle)
    up = (normals > _LEAST_FACING) & (height > middle)
    return {
        block.face: (
            radius > (1.0 - _ON_CIRCLE) * 0.5 * block.thickness if block.around else down if block.below else up
        )
        & (first >= block.along[0] - near)
        & (last <= block.along[1] + near)
        for block in support.blocks
    }
