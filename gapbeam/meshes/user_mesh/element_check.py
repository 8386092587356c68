"""The elements of a user's mesh: one cell type, in one piece, with contact facets on its surface."""

from __future__ import annotations

import gmsh
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gapbeam.meshes.beam_geometry import BODY
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.user_mesh.frame_check import CELL_TYPES, Facets, Nodes


def check_elements(where: str, dimension: int, groups: dict[str, int]) -> tuple[dict[str, Nodes], Facets]:
    """Check the elements of the current gmsh model.

    Returns:
        Nodes of the elements of each group, as indices from 0, one row an element; and the facets of the body.

    Raises:
        MeshError: a group is empty, has unsuitable elements, lies inside of the body or shares facets with
            another; cells are outside of the body, folded, or not connected.
    """
    gmsh.model.mesh.renumberNodes()
    kinds: dict[str, int] = {}
    nodes: dict[str, Nodes] = {}
    for name, tag in groups.items():
        dim = dimension if name == BODY else dimension - 1
        kinds[name], nodes[name] = _elements(f"{where}, group {name}", dim, tag)
    _check_types(where, kinds)
    _check_body(where, dimension, kinds[BODY], nodes[BODY])
    facets = Facets.of(nodes[BODY], CELL_TYPES[kinds[BODY]])
    surface = {row.tobytes() for row in facets.corners[facets.on_surface]}
    taken: dict[bytes, str] = {}
    for name in groups:
        if name != BODY:
            width = len(CELL_TYPES[kinds[BODY]].corners[0])
            _check_facets(f"{where}, group {name}", name, nodes[name][:, :width], surface, taken)
    return nodes, facets


def _elements(where: str, dimension: int, tag: int) -> tuple[int, Nodes]:
    """Element type and nodes of a group, which may be made of several entities."""
    parts: dict[int, list[Nodes]] = {}
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
        types, _, nodes = gmsh.model.mesh.getElements(dimension, int(entity))
        for kind, part in zip(types, nodes, strict=True):
            count = gmsh.model.mesh.getElementProperties(kind)[3]
            parts.setdefault(int(kind), []).append(part.astype(np.int64).reshape(-1, count) - 1)
    if not parts:
        raise MeshError(where, found="no elements", expected="at least one")
    if len(parts) > 1:
        names = [gmsh.model.mesh.getElementProperties(kind)[0] for kind in parts]
        raise MeshError(where, found=f"mixed elements: {', '.join(names)}", expected="one type of element")
    [(kind, pieces)] = parts.items()
    return kind, np.concatenate(pieces)


def _check_types(where: str, kinds: dict[str, int]) -> None:
    name, _, order, *_ = gmsh.model.mesh.getElementProperties(kinds[BODY])
    if kinds[BODY] not in CELL_TYPES:
        raise MeshError(
            f"{where}, group {BODY}",
            found=f"{name} cells of order {order}",
            expected="triangles, quadrilaterals, tetrahedra or hexahedra of order 1 or 2",
            hint="In gmsh, Mesh.SecondOrderIncomplete = 0 gives second-order cells all their nodes."
            if order == 2
            else "",
        )
    facet = CELL_TYPES[kinds[BODY]].facet
    for group, kind in kinds.items():
        if group != BODY and kind != facet:
            expected, found = (gmsh.model.mesh.getElementProperties(one)[0] for one in (facet, kind))
            raise MeshError(f"{where}, group {group}", found=f"{found} facets", expected=f"{expected} facets")


def _check_body(where: str, dimension: int, kind: int, cells: Nodes) -> None:
    total = sum(len(tags) for tags in gmsh.model.mesh.getElements(dimension)[1])
    if total != len(cells) or len(np.unique(np.sort(cells, axis=1), axis=0)) != len(cells):
        raise MeshError(
            f"{where}, group {BODY}",
            found=f"{len(cells)} cells, of {total} in the file",
            expected="every cell of the file once",
        )
    tags, _ = gmsh.model.mesh.getElementsByType(kind)
    smallest = np.asarray(gmsh.model.mesh.getElementQualities(tags, "minDetJac"))
    largest = np.asarray(gmsh.model.mesh.getElementQualities(tags, "maxDetJac"))
    folded = ~(smallest * largest > 0)  # counts NaN as well
    if np.any(folded):
        raise MeshError(
            f"{where}, group {BODY}",
            found=f"flat or folded cells, {int(np.sum(folded))} of {len(cells)}",
            expected="cells with a volume",
        )
    count = int(cells.max()) + 1
    ones = np.ones(cells[:, 1:].size)
    rows = np.repeat(cells[:, 0], cells.shape[1] - 1)
    _, piece = connected_components(coo_array((ones, (rows, cells[:, 1:].ravel())), (count, count)), directed=False)
    pieces = len(np.unique(piece[cells[:, 0]]))
    if pieces > 1:
        raise MeshError(
            f"{where}, group {BODY}",
            found=f"{pieces} pieces that share no nodes",
            expected="one connected body",
            hint="In gmsh, Coherence or BooleanFragments joins touching volumes; a part may also be there twice.",
        )


def _check_facets(where: str, name: str, corners: Nodes, surface: set[bytes], taken: dict[bytes, str]) -> None:
    facets = [row.tobytes() for row in np.sort(corners, axis=1)]
    inside = sum(facet not in surface for facet in facets)
    if inside:
        raise MeshError(
            where,
            found=f"{inside} of {len(facets)} facets that are not on the surface of the body",
            expected="facets of one cell each",
        )
    for facet in facets:
        if taken.setdefault(facet, name) != name or len(facets) != len(set(facets)):
            raise MeshError(
                where,
                found=f"facets that are also in {taken[facet]}" if taken[facet] != name else "facets given twice",
                expected="every facet in one group once",
            )
