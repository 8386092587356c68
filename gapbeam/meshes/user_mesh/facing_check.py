"""The contact faces of a user's mesh look at their supports."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.group_names import BODY
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.user_mesh.cell_types import Facets, Nodes

LEAST_FACING = 1.0e-3
"""Least part of a unit normal that points at the support: the rim of a half tube still looks at it a little."""

MOST_ALONG = 0.9
"""Largest part of a unit normal along the beam: a chamfer of 45 degrees belongs to a contact face, an end does not."""

Coordinates = npt.NDArray[np.float64]


def check_facing(
    where: str, geometry: BeamGeometry, nodes: dict[str, Nodes], facets: Facets, points: Coordinates
) -> None:
    """Check where the facets that face supports look.

    The normal of a facet is that of its corners, away from the middle of the cell behind it.

    Args:
        where: The file, for messages.
        geometry: The beam, with what faces a support.
        nodes: Nodes of the elements of each group, corners first.
        facets: Of the body.
        points: Coordinates of all nodes, (nodes, 3), m.

    Raises:
        MeshError: facets of the lower surface do not look down, or those of the upper one not up, or some are missing.
    """
    dimension = geometry.dimension
    x = points[:, :dimension]
    behind = {facets.corners[row].tobytes(): facets.cells[row] for row in facets.on_surface}
    for name, below, *_ in geometry.spans:
        side = -1.0 if below else 1.0
        corners = nodes[name][:, : facets.corners.shape[1]]
        cells = [behind[row.tobytes()] for row in np.sort(corners, axis=1)]
        normals = _normals(x[corners], x[nodes[BODY][cells]].mean(axis=1))
        wrong = (side * normals[:, -1] < LEAST_FACING) | (np.abs(normals[:, 0]) > MOST_ALONG)
        if not np.any(wrong):
            rest = [row for row in facets.on_surface if not _is_in(facets.corners[row], corners)]
            _check_unbroken(f"{where}, group {name}", side, corners, facets.corners[rest], x)
            continue
        ends = int(np.sum(np.abs(normals[wrong, 0]) > MOST_ALONG))
        first = x[corners[np.flatnonzero(wrong)[0]]].mean(axis=0)
        axis, sign = "xyz"[dimension - 1], "-" if side < 0.0 else ""
        raise MeshError(
            f"{where}, group {name}",
            found=f"{int(np.sum(wrong))} of {len(corners)} facets that do not look {'down' if side < 0.0 else 'up'}, "
            f"the first at ({', '.join(f'{value + 0.0:.4g}' for value in first)}) m",
            expected=f"facets whose outward normal points along {sign}{axis}",
            hint=f"{ends} of them are on a face across the beam, such as its end: take them out of the group."
            if ends
            else "Faces at the side or of a bore do not meet this face of the support: take them out of the group.",
        )


def _is_in(facet: Nodes, facets: Nodes) -> bool:
    return bool(np.any(np.all(np.sort(facets, axis=1) == facet, axis=1)))


def _check_unbroken(where: str, side: float, corners: Nodes, rest: Nodes, x: Coordinates) -> None:
    """Refuse a face without some facets in its middle, where the surface goes on: contact would be missing there.

    A groove is none: its walls do not look at the support.
    """
    along = x[corners][:, :, 0]
    order = np.argsort(along.min(axis=1))
    begins, reached = along.min(axis=1)[order][1:], np.maximum.accumulate(along.max(axis=1)[order])[:-1]
    beside = rest[np.isin(rest, corners).any(axis=1)]
    middles = x[beside].mean(axis=1)
    for low, high in zip(reached[begins > reached], begins[begins > reached], strict=True):
        within = beside[(middles[:, 0] > low) & (middles[:, 0] < high)]
        # seen from far behind the support every normal points outward
        normals = _normals(x[within], x[within].mean(axis=1) - side * np.eye(x.shape[1])[-1])
        if np.any(side * normals[:, -1] > 1.0 - MOST_ALONG):
            raise MeshError(
                where,
                found=f"a hole from x = {low:.4g} to {high:.4g} m, where the surface goes on",
                expected="all facets between the ends of the support",
                hint="Add the missing facets to the group; two parts apart are two supports.",
            )


def _normals(corners: Coordinates, middles: Coordinates) -> Coordinates:
    """Outward unit normals (facets, dimension) of facets (facets, corners, dimension)."""
    if corners.shape[2] == 2:
        along = corners[:, 1] - corners[:, 0]
        normals = np.column_stack([along[:, 1], -along[:, 0]])
    else:
        normals = np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), dtype=np.float64)
    outward = np.sign(np.einsum("fd,fd->f", corners.mean(axis=1) - middles, normals))
    return np.asarray((outward / np.linalg.norm(normals, axis=1))[:, None] * normals)
