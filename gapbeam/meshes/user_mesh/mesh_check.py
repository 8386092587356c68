"""Check of a user's mesh: cells of one type in one piece, every place filled once, physical groups and contact facets.

A proper mesh covers space with degree one: just inside of every facet on its surface lies one cell, its own, and just
outside lies none. Where the degree of cover changes, there is a facet of the surface; so these two tests at every facet
find parts that overlap or are there twice, touching faces whose nodes are not joined, and hanging nodes alike.
"""

from __future__ import annotations

import difflib

import gmsh
import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from gapbeam.meshes.beam_geometry import BODY, ENDS, BeamGeometry, contact_faces
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.user_mesh.frame_check import CELL_TYPES, Coordinates, Facets, Nodes

INSIDE = 1.0e-8
"""Least depth in the reference cell of a point that counts as inside."""

BULGE = 0.1
"""Distance by which a curved cell may leave the box of its nodes, relative to the box."""

BLOCK = 200_000
"""Pairs of point and cell that are looked at together: bounds the memory."""

FAR = 0.5
"""A point this far outside of the reference cell is given up, though a curved cell moves it a little."""

MOST_ITERATIONS = 12


def shape_values(kind: int, local: Coordinates) -> Coordinates:
    """Return the shape functions of a gmsh element type, (points, nodes), at points of its reference cell."""
    _, values, _ = gmsh.model.mesh.getBasisFunctions(kind, _padded(local).ravel(), "Lagrange")
    return np.asarray(values, dtype=np.float64).reshape(len(local), -1)


def cells_at(kind: int, cells: Nodes, x: Coordinates, points: Coordinates, excluded: Nodes) -> tuple[Nodes, Nodes]:
    """Find the cells in which points lie.

    Args:
        kind: gmsh's number of the cell type.
        cells: Nodes of the cells, (cells, nodes).
        x: Coordinates of the nodes, (nodes, dimension), m.
        points: (points, dimension), m.
        excluded: Cell that is not looked at, for each point, (points,).

    Returns:
        Pairs of point and cell, by rising point: the points, and the cells.
    """
    lower, upper = x[cells].min(axis=1), x[cells].max(axis=1)
    size = upper - lower
    if cells.shape[1] > CELL_TYPES[kind].corner_count:
        lower, upper = lower - BULGE * size, upper + BULGE * size
    tree = cKDTree(points)
    radius = 0.5 * np.linalg.norm(upper - lower, axis=1)
    found: list[tuple[Nodes, Nodes]] = []
    step = max(1, BLOCK // 16)
    for first in range(0, len(cells), step):
        block = np.arange(first, min(first + step, len(cells)), dtype=np.int64)
        near = tree.query_ball_point(0.5 * (lower + upper)[block], radius[block])
        cell = np.repeat(block, [len(one) for one in near])
        point = np.array([number for one in near for number in one], dtype=np.int64)
        candidate = (cell != excluded[point]) & np.all(
            (points[point] >= lower[cell]) & (points[point] <= upper[cell]), axis=1
        )
        point, cell = _roughly(kind, cells, x, points, point[candidate], cell[candidate])
        for start in range(0, len(point), BLOCK):
            part = slice(start, start + BLOCK)
            inside = _inside(kind, x[cells[cell[part]]], points[point[part]])
            found.append((point[part][inside], cell[part][inside]))
    if not found:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    point, cell = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(point, kind="stable")
    return point[order], cell[order]


def _roughly(
    kind: int, cells: Nodes, x: Coordinates, points: Coordinates, point: Nodes, cell: Nodes
) -> tuple[Nodes, Nodes]:
    """Leave away pairs of point and cell that are far apart: where the cell were as at its middle throughout."""
    dimension = points.shape[1]
    middle = _middle(kind, dimension)
    mine, which = np.unique(cell, return_inverse=True)
    jacobian = np.einsum("nk,cnd->cdk", _shape_gradients(kind, middle)[0], x[cells[mine]])
    jacobian[np.linalg.det(jacobian) == 0.0] = np.eye(dimension)
    inverse = np.linalg.inv(jacobian)
    off = points[point] - (shape_values(kind, middle)[0] @ x[cells[mine]])[which]
    local = middle + np.einsum("pkd,pd->pk", inverse[which], off)
    near = _depth(local, _is_simplex(kind, dimension)) > -FAR
    return point[near], cell[near]


def _inside(kind: int, nodes: Coordinates, points: Coordinates) -> npt.NDArray[np.bool_]:
    """Return True for each point (pairs, dimension) in the cell with these nodes (pairs, nodes, dimension).

    Newton's method finds the place xi in the reference cell with sum_i N_i(xi) x_i = x.
    """
    dimension = points.shape[1]
    simplex = _is_simplex(kind, dimension)
    local = np.repeat(_middle(kind, dimension), len(points), axis=0)
    inside, left = np.zeros(len(points), dtype=bool), np.arange(len(points))
    for _ in range(MOST_ITERATIONS):
        missing = points[left] - np.einsum("pn,pnd->pd", shape_values(kind, local[left]), nodes[left])
        jacobian = np.einsum("pnk,pnd->pdk", _shape_gradients(kind, local[left]), nodes[left])
        regular = np.linalg.det(jacobian) != 0.0
        left, jacobian, missing = left[regular], jacobian[regular], missing[regular]
        change = np.linalg.solve(jacobian, missing[:, :, None])[:, :, 0]
        local[left] += change
        found = np.all(np.abs(change) < 0.1 * INSIDE, axis=1)
        inside[left[found]] = _depth(local[left[found]], simplex) > INSIDE
        left = left[~found & (_depth(local[left], simplex) > -FAR)]
        if len(left) == 0:
            break
    return inside


def _is_simplex(kind: int, dimension: int) -> bool:
    return len(CELL_TYPES[kind].corners) == dimension + 1


def _middle(kind: int, dimension: int) -> Coordinates:
    """The middle of gmsh's reference cell, (1, dimension)."""
    return np.full((1, dimension), 1.0 / (dimension + 1) if _is_simplex(kind, dimension) else 0.0)


def _depth(local: Coordinates, simplex: bool) -> Coordinates:
    """Return the depth of places in the reference cell, (points,): negative outside; NaN stays NaN."""
    if simplex:
        return np.asarray(np.minimum(local.min(axis=1), 1.0 - local.sum(axis=1)))
    return np.asarray(1.0 - np.abs(local).max(axis=1))


def _shape_gradients(kind: int, local: Coordinates) -> Coordinates:
    """Derivatives of the shape functions in the reference cell, (points, nodes, dimension)."""
    _, values, _ = gmsh.model.mesh.getBasisFunctions(kind, _padded(local).ravel(), "GradLagrange")
    gradients = np.asarray(values, dtype=np.float64).reshape(len(local), -1, 3)
    return gradients[:, :, : local.shape[1]]


def _padded(local: Coordinates) -> Coordinates:
    """Return coordinates as gmsh wants them: three."""
    return np.pad(local, ((0, 0), (0, 3 - local.shape[1])))


BESIDE = 1.0e-3
"""Distance of test points from a facet, relative to the depth of its cell."""

TOWARD_CENTER = 0.2
"""Beside its center, a facet is looked at near its corners: this part of the way from a corner to the center."""

SAME_PLACE = 1.0e-6
"""Nodes this close, relative to the size of the facet, are at the same place."""


def check_surface(where: str, dimension: int, cells: Nodes, facets: Facets, points: Coordinates) -> None:
    """Check the body in the current gmsh model, whose cells are all of one type.

    Args:
        where: The file and the group, for messages.
        dimension: Dimension of the mesh.
        cells: Nodes of the cells, (cells, nodes).
        facets: Facets of the cells.
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
        facets: Facets of the cells.
        samples: Points on each side of the reference cell, (sides, samples, dimension).

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


_KINDS = {0: "points", 1: "curves", 2: "surfaces", 3: "volumes"}


def check_groups(where: str, geometry: BeamGeometry) -> dict[str, int]:
    """Find the groups in the current gmsh model, and remove all that mean nothing to gapbeam.

    Returns:
        Name to tag: body, those of the spans, and end and tip when they are there.

    Raises:
        MeshError: the mesh has another dimension, or groups are missing.
    """
    dimension, faces = geometry.dimension, contact_faces(geometry)
    _check_dimension(where, dimension)
    found = {(dim, gmsh.model.getPhysicalName(dim, tag)): tag for dim, tag in gmsh.model.getPhysicalGroups()}
    wanted = {BODY: dimension, **dict.fromkeys((*faces, *ENDS), dimension - 1)}
    kept = {name: found[dim, name] for name, dim in wanted.items() if (dim, name) in found}
    missing = [name for name in (BODY, *faces) if name not in kept]
    if missing:
        listed = [f'"{name}" ({_KINDS[dim]})' for dim, name in sorted(found) if name]
        unnamed = sum(not name for _, name in found)
        if unnamed:
            listed.append(f"{unnamed} without a name")
        raise MeshError(
            where,
            found=f"the physical groups {', '.join(listed)}" if listed else "no physical groups",
            expected=f"also {' and '.join(f'{name} ({_KINDS[wanted[name]]})' for name in missing)}"
            if listed
            else f"{BODY} ({_KINDS[dimension]}), {_listed(faces)} ({_KINDS[dimension - 1]})",
            hint=" ".join(filter(None, (_near_miss(name, wanted[name], list(found)) for name in missing))),
        )
    useless = [(dim, tag) for (dim, name), tag in found.items() if wanted.get(name) != dim]
    if useless:
        gmsh.model.removePhysicalGroups(useless)
    return kept


def _listed(names: tuple[str, ...]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _check_dimension(where: str, dimension: int) -> None:
    types = gmsh.model.mesh.getElementTypes()
    largest = max((gmsh.model.mesh.getElementProperties(kind)[1] for kind in types), default=0)
    if largest == 0:
        raise MeshError(where, found="no cells", expected="a mesh", hint="In gmsh: mesh first, then save.")
    if largest != dimension:
        raise MeshError(
            where,
            found=f"a mesh of dimension {largest}",
            expected=f"dimension {dimension}, as mesh.dimension says",
            hint="gmsh saves only the elements in physical groups unless Mesh.SaveAll is set."
            if largest < dimension
            else "",
        )


def _near_miss(name: str, dimension: int, found: list[tuple[int, str]]) -> str:
    """Return advice: the group to rename, or the group of the wrong kind."""
    for dim, other in found:
        if other == name:
            return f'"{name}" is a group of {_KINDS[dim]}; it has to be one of {_KINDS[dimension]}.'
    plain = {other.strip().lower(): other for dim, other in reversed(found) if dim == dimension}
    close = difflib.get_close_matches(name, plain, n=1, cutoff=0.7)
    return f'Rename "{plain[close[0]]}" to "{name}".' if close else ""
