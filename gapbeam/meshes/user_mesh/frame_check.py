"""Check of a user's mesh against the beam: cell types, size, place, orientation, and faces toward their supports."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BODY, BeamGeometry, ContactSpan
from gapbeam.meshes.mesh_errors import MeshError

TOLERANCE = 0.01
"""Allowed difference between a dimension of the file and of the case, relative."""

Coordinates = npt.NDArray[np.float64]


def check_frame(where: str, geometry: BeamGeometry, faces: dict[str, Coordinates], body: Coordinates) -> None:
    """Check that the mesh is the beam of the case.

    Args:
        where: The file, for messages.
        geometry: The beam of the case.
        faces: Coordinates (nodes, 3) of what faces each support, by name, in m.
        body: Coordinates (nodes, 3) of the body, in m.

    Raises:
        MeshError: another size, place or orientation; a face does not cover its support.
    """
    dimension = geometry.dimension
    if not np.all(np.isfinite(body)):
        raise MeshError(where, found="coordinates that are not finite", expected="finite coordinates")
    if dimension == 2 and np.ptp(body[:, 2]) > TOLERANCE * geometry.thickness:
        raise MeshError(
            where,
            found=f"z between {body[:, 2].min():g} and {body[:, 2].max():g} m",
            expected="a plane mesh: x along the beam, y in the bending direction, z constant",
        )
    lower, upper = body[:, :dimension].min(axis=0), body[:, :dimension].max(axis=0)
    expected = np.array(geometry.upper) - np.array(geometry.lower)
    _check_size(where, upper - lower, expected)
    _check_place(where, lower, np.array(geometry.lower), expected)
    for span in geometry.spans:
        _check_support(f"{where}, group {span.name}", geometry, span, faces[span.name][:, 0])
    means = {span: float(faces[span.name][:, dimension - 1].mean()) for span in geometry.spans}
    for lower, upper in permutations(geometry.spans, 2):
        alike = (lower.start, lower.end) == (upper.start, upper.end)
        if alike and lower.below and not upper.below and means[lower] >= means[upper]:
            axis = "xyz"[dimension - 1]
            raise MeshError(
                where,
                found=f"{lower.name} at {axis} = {means[lower]:g} m and {upper.name} at {axis} = {means[upper]:g} m "
                "on average",
                expected=f"{lower.name} below {upper.name}, {axis} pointing up",
                hint=f'Perhaps the names "{lower.name}" and "{upper.name}" are exchanged.',
            )


def _check_size(where: str, found: Coordinates, expected: Coordinates) -> None:
    if np.all(np.abs(found - expected) <= TOLERANCE * expected):
        return
    raise MeshError(
        where,
        found=f"a mesh of {_sizes(found)} m",
        expected=f"{_sizes(expected)} m, the {_names(len(expected))} of the beam within {TOLERANCE:.0%}",
        hint=_size_hint(found, expected),
    )


def _size_hint(found: Coordinates, expected: Coordinates) -> str:
    factor = float(np.exp(np.mean(np.log(np.maximum(found, 1e-300) / expected))))
    if np.all(np.abs(found - factor * expected) <= TOLERANCE * factor * expected):
        if abs(factor - 1000) < 30:
            return "The file seems to be in mm: save it with Mesh.ScalingFactor = 0.001."
        if abs(factor - 0.001) < 3e-5:
            return "The dimensions of the beam in the case seem to be in mm: they are in m."
        return f"The file is {factor:.4g} times as large: scale it by {1 / factor:.4g}."
    for order in permutations(range(len(expected))):
        if np.all(np.abs(found[list(order)] - expected) <= TOLERANCE * expected):
            return f"The axes seem to be exchanged: {_axes(len(expected))}."
    return ""


def _check_place(where: str, found: Coordinates, expected: Coordinates, size: Coordinates) -> None:
    if np.any(np.abs(found - expected) > TOLERANCE * size):
        raise MeshError(
            where,
            found=f"a mesh that begins at {_point(found)} m",
            expected=f"one that begins at {_point(expected)} m",
            hint=f"Move it by {_point(expected - found)} m: x = 0 is the supported end, "
            "the other coordinates are measured from the beam axis.",
        )


def _check_support(where: str, geometry: BeamGeometry, span: ContactSpan, x: Coordinates) -> None:
    """A contact face reaches from the start to the end of its support."""
    length, wanted = geometry.length, np.array([span.start, span.end])
    ends = np.array([x.min(), x.max()])
    if np.all(np.abs(ends - wanted) <= TOLERANCE * (span.end - span.start)):
        return
    mirrored = np.all(np.abs(ends - (length - wanted[::-1])) <= TOLERANCE * length)
    raise MeshError(
        where,
        found=f"facets from x = {ends[0]:g} m to x = {ends[1]:g} m",
        expected=f"from x = {span.start:g} to x = {span.end:g} m, the length of the support",
        hint="The supported end seems to be at the far end: turn the mesh around." if mirrored else "",
    )


def _names(dimension: int) -> str:
    return "length (x) and thickness (y)" if dimension == 2 else "length (x), width (y) and thickness (z)"


def _axes(dimension: int) -> str:
    return "x is along the beam, y across its thickness" + (
        "" if dimension == 2 else "; z takes the thickness and y the width"
    )


def _sizes(values: Coordinates) -> str:
    return " x ".join(f"{value:.4g}" for value in values)


def _point(values: Coordinates) -> str:
    return f"({', '.join(f'{value + 0.0:.4g}' for value in values)})"


Nodes = npt.NDArray[np.int64]


@dataclass(frozen=True)
class CellType:
    """gmsh's number of the facet type, and the corners of each facet."""

    facet: int
    corners: tuple[tuple[int, ...], ...]

    @property
    def corner_count(self) -> int:
        """Corners of a cell."""
        return 1 + max(max(corners) for corners in self.corners)


_TRIANGLE = ((0, 1), (1, 2), (2, 0))
_QUADRILATERAL = ((0, 1), (1, 2), (2, 3), (3, 0))
_TETRAHEDRON = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
_HEXAHEDRON = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

CELL_TYPES = {
    2: CellType(1, _TRIANGLE),
    9: CellType(8, _TRIANGLE),
    3: CellType(1, _QUADRILATERAL),
    10: CellType(8, _QUADRILATERAL),
    4: CellType(2, _TETRAHEDRON),
    11: CellType(9, _TETRAHEDRON),
    5: CellType(3, _HEXAHEDRON),
    12: CellType(10, _HEXAHEDRON),
}
"""gmsh's element types of order 1 and 2 with all their nodes: those that DOLFINx reads."""


@dataclass(frozen=True)
class Facets:
    """All facets of all cells, one row for each cell that has it.

    Attributes:
        cells: the cell of each row, (rows,).
        sides: number of the facet within its cell, (rows,).
        corners: nodes of its corners, sorted, (rows, corners).
        numbers: rows of the same facet have the same number, (rows,).
        owners: number of cells that have the facet of each number, (facets,).
    """

    cells: Nodes
    sides: Nodes
    corners: Nodes
    numbers: Nodes
    owners: Nodes

    @classmethod
    def of(cls, cells: Nodes, cell_type: CellType) -> Facets:
        """Return the facets of cells, given by their nodes (cells, nodes)."""
        sides = len(cell_type.corners)
        corners = np.sort(np.concatenate([cells[:, list(side)] for side in cell_type.corners]), axis=1)
        _, numbers, owners = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
        return cls(
            cells=np.tile(np.arange(len(cells), dtype=np.int64), sides),
            sides=np.repeat(np.arange(sides, dtype=np.int64), len(cells)),
            corners=corners,
            numbers=np.asarray(numbers, dtype=np.int64).reshape(-1),
            owners=np.asarray(owners, dtype=np.int64),
        )

    @property
    def on_surface(self) -> Nodes:
        """Rows of the facets that belong to one cell only."""
        return np.flatnonzero(self.owners[self.numbers] == 1)


LEAST_FACING = 1.0e-3
"""Least part of a unit normal that points at the support: the rim of a half tube still looks at it a little."""

MOST_ALONG = 0.9
"""Largest part of a unit normal along the beam: a chamfer of 45 degrees belongs to a contact face, an end does not."""


def check_facing(
    where: str, geometry: BeamGeometry, nodes: dict[str, Nodes], facets: Facets, points: Coordinates
) -> None:
    """Check the directions of the facets that face supports.

    The normal of a facet is that of its corners, away from the middle of the cell behind it.

    Args:
        where: The file, for messages.
        geometry: The beam, with what faces a support.
        nodes: Nodes of the elements of each group, corners first.
        facets: Facets of the body.
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
            mine = {row.tobytes() for row in np.sort(corners, axis=1)}
            rest = [row for row in facets.on_surface if facets.corners[row].tobytes() not in mine]
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


def _check_unbroken(where: str, side: float, corners: Nodes, rest: Nodes, x: Coordinates) -> None:
    """Refuse a face without some facets in its middle, where the surface continues: contact would be missing there.

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
