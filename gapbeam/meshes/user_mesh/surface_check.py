"""The body of a user's mesh fills every place once, and its cells hang together through facets.

A proper mesh covers space with degree one: just inside of every facet on its surface lies one cell, its own, and just
outside lies none. Where the degree of cover changes, there is a facet of the surface; so these two tests at every facet
find parts that overlap or are there twice, touching faces whose nodes are not joined, and hanging nodes alike.
"""

from __future__ import annotations

import gmsh
import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.user_mesh.cell_types import CELL_TYPES, Facets, Nodes
from gapbeam.meshes.user_mesh.point_location import cells_at, shape_values

BESIDE = 1.0e-3
"""How far from a facet the tests look, relative to the depth of its cell."""

TOWARD_CENTER = 0.2
"""Beside its center, a facet is looked at near its corners: this part of the way from a corner to the center."""

SAME_PLACE = 1.0e-6
"""Nodes this close, relative to the size of the facet, are at the same place."""

Coordinates = npt.NDArray[np.float64]


def check_surface(where: str, dimension: int, cells: Nodes, facets: Facets, points: Coordinates) -> None:
    """Check the body in the current gmsh model, whose cells are all of one type.

    Args:
        where: The file and the group, for messages.
        dimension: Of the mesh.
        cells: Nodes of the cells, (cells, nodes).
        facets: Of the cells.
        points: Coordinates of all nodes, (nodes, 3), m.

    Raises:
        MeshError: parts overlap; cells touch without sharing their facets; the body hangs together at single
            nodes or edges.
    """
    [kind] = (int(one) for one in gmsh.model.mesh.getElementTypes(dimension))
    x = points[:, :dimension]
    surface = facets.on_surface
    inside, outside = _sample_points(kind, dimension)
    doubled, _ = _covered(kind, cells, x, facets, inside)
    crowded = int(np.sum(facets.owners > 2))
    if len(doubled) or crowded:
        place = facets.corners[surface[doubled[0]]] if len(doubled) else _crowded(facets)
        raise MeshError(
            where,
            found=f"cells inside of other cells, near {_place(x[place])}",
            expected="a body that fills every place once",
            hint="A part may be in the file twice, or two parts overlap. In gmsh, BooleanFragments makes one body.",
        )
    touching, others = _covered(kind, cells, x, facets, outside)
    if len(touching):
        raise _not_joined(where, facets.corners[surface[touching]], cells[others], x)
    _check_pieces(where, cells, facets, x)


def _sample_points(kind: int, dimension: int) -> tuple[Coordinates, Coordinates]:
    """Places just inside and just outside of each facet of the reference cell, (sides, samples, dimension).

    Places in the reference cell are mapped as the cell is, so that curved facets need nothing more.
    """
    cell_type = CELL_TYPES[kind]
    _, _, _, _, local, _ = gmsh.model.mesh.getElementProperties(kind)
    corners = np.reshape(local, (-1, dimension))[: cell_type.corner_count]
    inside, outside = [], []
    for side in cell_type.corners:
        center = corners[list(side)].mean(axis=0)
        outward = BESIDE * (center - corners.mean(axis=0))
        near_corners = corners[list(side)] + TOWARD_CENTER * (center - corners[list(side)])
        inside.append([center - outward])
        outside.append([center + outward, *(near_corners + outward)])
    return np.array(inside), np.array(outside)


def _covered(kind: int, cells: Nodes, x: Coordinates, facets: Facets, samples: Coordinates) -> tuple[Nodes, Nodes]:
    """Facets of the surface with a sample in a cell that is not their own, and that cell.

    Args:
        kind: gmsh's number of the cell type.
        cells: Nodes of the cells.
        x: Coordinates of the nodes, (nodes, dimension), m.
        facets: Of the cells.
        samples: For each side of the reference cell, (sides, samples, dimension).

    Returns:
        Positions in the list of facets on the surface, each once, and the cell that covers each.
    """
    surface = facets.on_surface
    sides, count, dimension = samples.shape
    values = shape_values(kind, samples.reshape(-1, dimension)).reshape(sides, count, -1)
    owners = facets.cells[surface]
    places = np.einsum("fsn,fnd->fsd", values[facets.sides[surface]], x[cells[owners]]).reshape(-1, dimension)
    hit, cell = cells_at(kind, cells, x, places, np.repeat(owners, count))
    found, first = np.unique(hit // count, return_index=True)
    return found, cell[first]


def _not_joined(where: str, corners: Nodes, others: Nodes, x: Coordinates) -> MeshError:
    """The error of facets, given by their corners, that touch other cells and share no facet with them."""
    size = np.linalg.norm(np.ptp(x[corners], axis=1), axis=1)
    apart = np.linalg.norm(x[corners][:, :, None, :] - x[others][:, None, :, :], axis=3).min(axis=2)
    matching = np.all(apart <= SAME_PLACE * size[:, None], axis=1)
    first = 0 if np.all(matching) else int(np.flatnonzero(~matching)[0])
    place = _place(x[corners[first]])
    if np.all(matching):
        return MeshError(
            where,
            found=f"{len(corners)} facets that touch others and do not share their nodes, near {place}",
            expected="one node at each place, so that the body hangs together",
            hint="In gmsh, Coherence Mesh joins nodes at the same place. A crack that stays closed cannot be modeled:"
            " contact acts at base and gland only.",
        )
    return MeshError(
        where,
        found=f"{len(corners)} facets that touch larger or smaller ones (hanging nodes), near {place}",
        expected="cells that share whole facets",
        hint="In gmsh, BooleanFragments before meshing gives touching parts the same nodes; transfinite parts need the"
        " same divisions on both sides.",
    )


def _check_pieces(where: str, cells: Nodes, facets: Facets, x: Coordinates) -> None:
    """All cells are connected through facets."""
    order = np.argsort(facets.numbers, kind="stable")
    same = facets.numbers[order][1:] == facets.numbers[order][:-1]
    one, other = facets.cells[order][:-1][same], facets.cells[order][1:][same]
    pairs = coo_array((np.ones(len(one)), (one, other)), (len(cells), len(cells)))
    pieces, piece = connected_components(pairs, directed=False)
    if pieces == 1:
        return
    own = np.unique(cells[piece == piece[0]])
    shared = own[np.isin(own, cells[piece != piece[0]])]
    raise MeshError(
        where,
        found=f"{pieces} pieces that hang together at single nodes or edges, near {_place(x[shared[:1]])}",
        expected="a body connected through facets",
        hint="Such a joint is a hinge without stiffness. Let the parts overlap by a face, or leave one of them away.",
    )


def _crowded(facets: Facets) -> Nodes:
    """Corners of a facet that more than two cells have."""
    row = int(np.flatnonzero(facets.owners[facets.numbers] > 2)[0])
    return np.asarray(facets.corners[row])


def _place(x: Coordinates) -> str:
    return f"({', '.join(f'{value + 0.0:.4g}' for value in x.mean(axis=0))}) m"
