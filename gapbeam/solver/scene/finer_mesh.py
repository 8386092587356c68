"""Meshes of solids twice as fine, by which errors of runs include the mesh of a file.

Cells of order 1 get order 2, those of order 2 are divided. Every motion of the mesh is one of the finer mesh, too. Its
points, faces and clamps stay the same: a part whose nodes are all clamped does not move in either.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.scene.mesh_files import SolidMesh
from gapbeam.solver.scene.node_files import Nodes
from gapbeam.solver.scene.solid_cells import KINDS, CellKind, Indices, shapes_at
from gapbeam.solver.system.operators import Array

SECOND = {"triangle": "triangle6", "quad": "quad8", "tetra": "tetra10", "hexahedron": "hexahedron20"}
CORNERS_OF = {name: first for first, name in SECOND.items()} | {"quad9": "quad", "hexahedron27": "hexahedron"}
PARTS = 64  # of which weights of corners are whole numbers
MOST_MOTIONS = 100_000
"""Largest number of motions of a finer mesh, whose factor takes ten seconds."""
_TRIANGLES = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
_TETRAHEDRA = (
    (0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3), (6, 8, 4, 7), (6, 8, 7, 9), (6, 8, 9, 5), (6, 8, 5, 4),
)  # fmt: skip


def may_be_finer(motions: int, dimension: int) -> bool:
    """Return true for a mesh of so few motions that one twice as fine is not too large."""
    return bool(motions * 2**dimension <= MOST_MOTIONS)


def finer_mesh(mesh: SolidMesh) -> SolidMesh:
    """Return the mesh twice as fine, nodes of the file first."""
    kind, count = KINDS[mesh.kind], len(mesh.labels)
    name, parts = _parts(mesh.kind)
    points, of_part = np.unique(parts.reshape(-1, kind.dimension), axis=0, return_inverse=True)
    every = np.vstack([_nodes(kind), points])
    codes = _codes(mesh, every)
    _, first, same = np.unique(codes.reshape(-1, codes.shape[2]), axis=0, return_index=True, return_inverse=True)
    same = same.reshape(codes.shape[:2])
    number = np.full(len(first), -1)
    number[same[:, : mesh.cells.shape[1]]] = mesh.cells
    new = np.flatnonzero(number < 0)
    number[new] = count + np.arange(len(new))
    cell, at = np.divmod(first, len(every))
    weights = _weights(mesh.kind, every) / PARTS
    ends = np.stack(np.broadcast_arrays(number[:, None], mesh.cells[cell, : weights.shape[1]]))
    corners_of = sp.csr_matrix((weights[at].ravel(), ends.reshape(2, -1)))
    cell, at = cell[new], at[new]
    top = 1 + max(int(one) for one in mesh.nodes.places)
    labels = [str(top + k) for k in range(len(new))]
    places = np.array([mesh.nodes.places[one] for one in mesh.labels])
    corners = places[mesh.cells[cell]]
    moved = corners[:, 0] + np.einsum("kn,knx->kx", shapes_at(mesh.kind, every)[0][at], corners - corners[:, :1])
    nodes = Nodes(
        mesh.nodes.places | dict(zip(labels, moved, strict=True)),
        _sets(mesh, cell, _around(mesh.kind, every)[at], labels),
        frozenset(labels),
    )
    cells = number[same[:, mesh.cells.shape[1] :]][:, of_part.ravel()].reshape(-1, parts.shape[1])
    groups = {
        one: (len(parts) * members[:, None] + np.arange(len(parts))).ravel() for one, members in mesh.groups.items()
    }
    return SolidMesh(name, cells, [*mesh.labels, *labels], nodes, groups, corners_of)


def _nodes(kind: CellKind) -> Array:
    """Return the nodes of a reference cell, (nodes, dimension)."""
    corners = np.array(kind.corners)
    return np.vstack([corners, *(corners[list(one)].mean(axis=0) for one in kind.between)])


def _parts(name: str) -> tuple[str, Array]:
    """Return the kind of the finer cells, and their nodes in the reference cell, (cells, nodes, dimension)."""
    kind = KINDS[name]
    if kind.order == 1:
        return SECOND[name], _nodes(KINDS[SECOND[name]])[None]
    corners = np.array(kind.corners)
    if not kind.simplex:
        inner = [0.5 * (corners + offset) for offset in product((0.0, 1.0), repeat=kind.dimension)]
    else:
        inner = [_nodes(kind)[list(one)] for one in (_TRIANGLES if kind.dimension == 2 else _TETRAHEDRA)]
        inner = [one if np.linalg.det(one[1:] - one[0]) > 0.0 else one[[1, 0, *range(2, len(one))]] for one in inner]
    return name, np.array([np.vstack([one, *(one[list(k)].mean(axis=0) for k in kind.between)]) for one in inner])


def _weights(name: str, points: Array) -> Indices:
    """Return the weights of the corners at points of the reference cell, whole numbers, (points, corners)."""
    return np.asarray(np.rint(PARTS * shapes_at(CORNERS_OF.get(name, name), points)[0]), dtype=int)


def _codes(mesh: SolidMesh, points: Array) -> Indices:
    """Return numbers that points share with the same ones in other cells: their corners with weights."""
    weights = _weights(mesh.kind, points)
    ends = mesh.cells[:, None, : weights.shape[1]]
    return np.sort(np.where(weights > 0, (PARTS + 1) * ends + weights, -1), axis=2)


def _around(name: str, points: Array) -> Indices:
    """Return true for nodes of a cell on the same edge or face as a point, or all within, (points, nodes)."""
    own, nodes = (_weights(name, at) > 0 for at in (points, _nodes(KINDS[name])))
    return np.all(own[:, None] | ~nodes[None], axis=2)


def _sets(mesh: SolidMesh, cell: Indices, around: Indices, labels: list[str]) -> dict[str, list[str]]:
    """Return the sets with new nodes all of whose neighbors around are in them."""
    found = {}
    for name, members in mesh.nodes.sets.items():
        own = set(members)
        inside = np.array([one in own for one in mesh.labels], dtype=bool)
        some = (inside[mesh.cells[cell]] | ~around).all(axis=1)
        found[name] = [*members, *(labels[k] for k in np.flatnonzero(some))]
    return found
