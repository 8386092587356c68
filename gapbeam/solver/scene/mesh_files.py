"""Solids of mesh files: cells of one kind with their nodes, groups of cells and sets of nodes.

Input of Abaqus and CalculiX is read here, since its element types say what a shell is; all else meshio reads. Cells of
fewer dimensions on the faces and edges of the solids are the sets of their nodes; elsewhere they would be shells or
beams, which are refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.scene.node_files import (
    InputBlock,
    Nodes,
    input_blocks,
    meshio_mesh,
    nodes_of_input,
    set_members,
)
from gapbeam.solver.scene.solid_cells import KINDS, Cells, Indices, facet_of
from gapbeam.solver.system.operators import Array

SOLID = re.compile(r"C3D(4|8|10|20|27)(?=[A-Z]|$)|C(?:PS|PE)(3|4|6|8)(?=[A-Z]|$)")
KIND_OF = {"4": "tetra", "8": "hexahedron", "10": "tetra10", "20": "hexahedron20", "27": "hexahedron27"}
PLANE_OF = {"3": "triangle", "4": "quad", "6": "triangle6", "8": "quad8"}
NASTRAN = (".bdf", ".nas", ".fem")
UNREAD = (
    "BOUNDARY", "COUPLING", "CONTACT PAIR", "DASHPOT", "EQUATION", "KINEMATIC COUPLING", "MPC", "RIGID BODY", "SPRING",
    "TIE", "CONM", "RBE", "RBAR", "SPC",
)  # fmt: skip
"""Keywords and cards of mechanics that no mesh holds."""
SMALLEST = 1e-6
"""Smallest determinant of a cell, of its largest, that is no flat cell."""


class Block(NamedTuple):
    """Cells of a kind with their nodes, as indices, and the names of the groups of each."""

    kind: str
    nodes: Indices
    type: str


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A mesh of solids.

    Attributes:
        kind: Cell type of meshio.
        cells: (cells, nodes), indices of labels.
        labels: Names of the nodes of the cells.
        nodes: Coordinates of all nodes by name, and sets.
        groups: Cells of each group, by its name in capitals.
        corners_of: Weights of corners in the file at each node of a finer mesh, (nodes, nodes), sparse; None: the file.
    """

    kind: str
    cells: Indices
    labels: list[str]
    nodes: Nodes
    groups: dict[str, Indices]
    corners_of: Any = None

    def surface(self) -> tuple[Indices, dict[str, Indices], str, Any]:
        """Return the surface as indices of labels: lines, facets by the set of their nodes, kind, `corners_of`."""
        kind = KINDS[self.kind]
        facet, local = facet_of(kind)
        every = np.concatenate([self.cells[:, list(one)] for one in local])
        corners = np.sort(every[:, : kind.dimension if kind.simplex else 2 ** (kind.dimension - 1)], axis=1)
        _, first, count = np.unique(corners, axis=0, return_index=True, return_counts=True)
        outer = every[first[count == 1]]
        number = {label: i for i, label in enumerate(self.labels)}
        faces = dict[str, Indices]()
        for name, members in self.nodes.sets.items():
            inside = np.zeros(len(self.labels), dtype=bool)
            inside[[number[one] for one in members if one in number]] = True
            some = outer[inside[outer].all(axis=1)]
            if len(some):
                faces[name] = some
        ends = corners.shape[1]
        pairs = [outer[:, [i, (i + 1) % ends]] for i in range(ends if ends > 2 else 1)]
        return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0), faces, facet, self.corners_of

    def made(self, meter: float) -> Cells:
        """Return the cells, coordinates times the unit of length, m."""
        places = meter * np.array([self.nodes.places[one] for one in self.labels])
        return Cells(self.kind, self.cells, places)


@dataclass
class _Parts:
    """Contents of a file: nodes, blocks of cells, and groups as cells of each block."""

    labels: list[str]
    places: Array
    sets: dict[str, list[str]]
    blocks: list[Block]
    groups: dict[str, dict[int, Indices]]


def read_mesh(path: Path) -> SolidMesh:
    """Return the solids of a mesh file, checked.

    Raises:
        ArgumentError: The file cannot be read, or has shells, beams, several kinds of cells, flat or inverted cells,
            or pieces that share no nodes.
    """
    try:
        parts = _of_input(path) if path.suffix.lower() == ".inp" else _of_meshio(path)
    except ArgumentError:
        raise
    except (OSError, UnicodeDecodeError, ValueError, KeyError, IndexError) as error:
        raise ArgumentError(f"{path}: cannot be read as a mesh ({error})", "file") from None
    if not np.all(np.isfinite(parts.places)):
        bad = int(np.flatnonzero(~np.isfinite(parts.places).all(axis=1))[0])
        raise _fault(path, f"coordinates of node {parts.labels[bad]} that are not finite", "finite numbers")
    return _solids(path, parts)


def _fault(path: Path, found: str, expected: str, hint: str = "") -> ArgumentError:
    return ArgumentError(f"{path}: found {found}, expected {expected}{'; ' + hint if hint else ''}", "file")


def _of_input(path: Path) -> _Parts:
    """Return the contents of input of Abaqus or CalculiX."""
    blocks = input_blocks(path.read_text(encoding="utf-8-sig"))
    keywords = [one.keyword for one in blocks]
    for keyword, most, hint in (("PART", 1, "save one part"), ("INCLUDE", 0, "put its lines into the file")):
        if keywords.count(keyword) > most:
            raise _fault(path, f"{keywords.count(keyword)} *{keyword}", "one file of one part", hint)
    moved = next((one for one in blocks if one.keyword == "INSTANCE" and one.rows), None)
    if moved is not None:
        raise _fault(path, "an *INSTANCE that moves its part", "coordinates in space", "use `place` of the structure")
    _say_unread(path, keywords)
    nodes = nodes_of_input(blocks)
    index = {label: i for i, label in enumerate(nodes.places)}
    found, numbers, sets = list[Block](), list[dict[str, int]](), dict[str, list[str]]()
    for block in blocks:
        if block.keyword == "ELEMENT":
            name = block.options.get("TYPE", "")
            rows = _elements(path, block, name)
            at = np.array([[_known(path, index, one) for one in row[1:]] for row in rows])
            found.append(Block(_kind_of_type(path, name, at, nodes), at, name))
            numbers.append({row[0]: i for i, row in enumerate(rows)})
            members = list(numbers[-1])
        elif block.keyword == "ELSET":
            members = set_members(block, sets)
        else:
            continue
        if block.options.get("ELSET"):
            sets.setdefault(block.options["ELSET"], []).extend(members)
    groups = {
        name: {
            k: np.array([own[one] for one in members if one in own], dtype=int) for k, own in enumerate(numbers)
        }
        for name, members in sets.items()
    }  # fmt: skip
    labels = list(nodes.places)
    for block in blocks:
        if block.keyword == "NSET" and "ELSET" in block.options:
            used = [found[k].nodes[some].ravel() for k, some in groups.get(block.options["ELSET"], {}).items()]
            members = [labels[i] for i in np.unique(np.concatenate([np.zeros(0, dtype=int), *used]))]
            nodes.sets.setdefault(block.options["NSET"], []).extend(members)
    return _Parts(labels, np.array(list(nodes.places.values())), nodes.sets, found, groups)


def _elements(path: Path, block: InputBlock, name: str) -> list[list[str]]:
    """Return the rows of elements, whose nodes may go on in the next line."""
    solid = SOLID.match(name)
    if solid is None:
        return [row for row in block.rows if len(row) > 1]
    count = 1 + int(solid[1] or solid[2])
    flat = [one for row in block.rows for one in row]
    if len(flat) % count:
        raise _fault(path, f"{counted(len(flat), 'number')} below *ELEMENT, TYPE={name}", f"{count} for each element")
    return [flat[i : i + count] for i in range(0, len(flat), count)]


def _known(path: Path, index: dict[str, int], label: str) -> int:
    if label not in index:
        raise _fault(path, f"node {label} in an element, which has no coordinates", "a line for it below *NODE")
    return index[label]


def _kind_of_type(path: Path, name: str, at: Indices, nodes: Nodes) -> str:
    """Return the kind of cells of an element type."""
    solid = SOLID.match(name)
    if solid is not None:
        return KIND_OF[solid[1]] if solid[1] else PLANE_OF[solid[2]]
    what = next((word for start, word in (("SC", "continuum shells"), ("S", "shells"), ("B", "beams"), ("T", "trusses"),
                 ("M3D", "membranes"), ("CAX", "axisymmetric cells"), ("C3D6", "wedges"), ("C3D15", "wedges"))
                 if re.match(rf"{start}(\d|TRI|$)", name)), "cells of another kind")  # fmt: skip
    where = "" if not at.size else f" at {_place(np.array(list(nodes.places.values()))[np.ravel(at)[:1]])}"
    raise _refused(path, f"{counted(len(at), 'element')} of type {name or 'none'} ({what}){where}")


def _refused(path: Path, found: str) -> ArgumentError:
    return _fault(
        path, found, "solids: tetrahedra or hexahedra, in the plane triangles or quadrilaterals, of order 1 or 2",
        "matrices of a model with other elements are read by model = { type = \"matrices\" }",
    )  # fmt: skip


def _say_unread(path: Path, keywords: list[str]) -> None:
    unread = sorted({one for one in keywords if any(one == key or one.rstrip("0123456789") == key for key in UNREAD)})
    if unread:
        LOG.warning(
            "%s: %s not read: a mesh gives nodes, cells and sets; joints, contacts and masses are tables of the case",
            path, ", ".join(unread),
        )  # fmt: skip


def _of_meshio(path: Path) -> _Parts:
    """Return the contents of a file that meshio reads."""
    mesh = meshio_mesh(path)
    places = np.zeros((len(mesh.points), 3))
    places[:, : mesh.points.shape[1]] = mesh.points
    labels = [str(one) for one in getattr(mesh, "points_id", range(1, len(places) + 1))]
    if path.suffix.lower() in NASTRAN:
        _check_nastran(path, mesh)
    blocks = [Block(one.type, np.asarray(one.data), one.type) for one in mesh.cells if one.type != "vertex"]
    solid = [one for one in mesh.cells if one.type != "vertex"]
    if path.suffix.lower() == ".med":
        blocks = [_upright(one, places) for one in blocks]
    groups: dict[str, dict[int, Indices]] = {}
    for name, k, some in _named(mesh, solid):
        own = groups.setdefault(name.upper(), {})
        own[k] = np.union1d(own.get(k, np.zeros(0, dtype=int)), some)
    sets = {name.upper(): [labels[int(i)] for i in np.ravel(some)] for name, some in mesh.point_sets.items()}
    for key, data in mesh.point_data.items():
        values = np.asarray(data)
        for value in np.unique(values) if values.dtype.kind in "iu" and values.ndim == 1 else ():
            names = mesh.point_tags.get(int(value), []) if key == "point_tags" else [f"{key}:{value}"]
            for name in names:
                sets.setdefault(name.upper(), []).extend(labels[int(i)] for i in np.flatnonzero(values == value))
    return _Parts(labels, places, sets, blocks, groups)


def _named(mesh: Any, solid: list[Any]) -> Iterator[tuple[str, int, Indices]]:
    """Yield named groups of cells: (name, block, cells)."""
    physical = {tuple(map(int, tag)): name for name, tag in mesh.field_data.items() if np.size(tag) == 2}
    for k, one in enumerate(solid):
        place = next(i for i, other in enumerate(mesh.cells) if other is one)
        for name, members in mesh.cell_sets.items():
            if members[place] is not None and len(members[place]) and not name.startswith("gmsh:"):
                yield name, k, np.asarray(members[place], dtype=int)
        for key, data in mesh.cell_data.items():
            values = np.asarray(data[place])
            if values.dtype.kind not in "iu" or values.ndim != 1 or key == "gmsh:geometrical":
                continue
            for value in map(int, np.unique(values)):
                plain = str(value) if key in ("gmsh:physical", "nastran:ref") else f"{key}:{value}"
                names = mesh.cell_tags.get(value, []) if key == "cell_tags" else [physical.get((value, one.dim), plain)]
                for name in names:
                    yield name, k, np.flatnonzero(values == value)


def _check_nastran(path: Path, mesh: Any) -> None:
    """Refuse entries of Nastran's bulk data that meshio leaves out without a word."""
    frames = np.asarray(mesh.point_data.get("nastran:ref", [0]))
    if np.any(frames != 0):
        raise _fault(path, f"GRID in the coordinate system {frames[frames != 0][0]}", "coordinates of the basic system")
    cards = [line.split(",")[0][:8].strip() for line in path.read_text(encoding="utf-8-sig").splitlines()]
    wide = next((one for one in cards if re.match(r"C(TETRA|HEXA)\*", one)), None)
    if wide is not None:
        raise _fault(path, f"{wide}, an element in wide fields", "elements in fields of 8 characters, or with commas")
    _say_unread(path, cards)
    shells = next((one for one in mesh.cells if one.type not in KINDS or KINDS[one.type].dimension < 3), None)
    if shells is not None:
        what = f"shells, beams or springs ({shells.type}) at {_place(mesh.points[np.ravel(shells.data)[:1]])}"
        raise _refused(path, f"{len(shells.data)} elements that are {what}")


def _upright(block: Block, places: Array) -> Block:
    """Return cells of MED, whose order of nodes is the mirrored one, in the order of VTK."""
    if block.kind not in KINDS or KINDS[block.kind].dimension < 3:
        return block
    turned = block._replace(nodes=block.nodes[:, KINDS[block.kind].mirror()])
    return turned if np.all(Cells(block.kind, block.nodes, places).jacobians < 0.0) else block


def _solids(path: Path, parts: _Parts) -> SolidMesh:
    """Return the solids of a file; elements on their faces become sets of nodes."""
    strange = next((one for one in parts.blocks if one.kind not in KINDS and not one.kind.startswith("line")), None)
    if strange is not None:
        at = _place(parts.places[np.ravel(strange.nodes)[:1]])
        raise _refused(path, f"{counted(len(strange.nodes), 'cell')} of type {strange.type} at {at}")
    known = [one for one in parts.blocks if one.kind in KINDS]
    if not known:
        raise _fault(path, "no solid cells", "tetrahedra or hexahedra, in the plane triangles or quadrilaterals",
                     "gmsh saves only cells of physical groups unless Mesh.SaveAll is set")  # fmt: skip
    dimension = max(KINDS[one.kind].dimension for one in known)
    solid = [k for k, one in enumerate(parts.blocks) if one.kind in KINDS and KINDS[one.kind].dimension == dimension]
    kinds = sorted({parts.blocks[k].kind for k in solid})
    if len(kinds) > 1:
        at = _place(parts.places[parts.blocks[solid[-1]].nodes[0, :1]])
        raise _fault(path, f"{' and '.join(kinds)}, the last at {at}", "cells of one kind",
                     "mesh with one kind, or read matrices of another program")  # fmt: skip
    cells = np.concatenate([parts.blocks[k].nodes for k in solid])
    first = dict(zip(solid, np.cumsum([0, *(len(parts.blocks[k].nodes) for k in solid)]), strict=False))
    groups, sets = dict[str, Indices](), dict(parts.sets)
    for name, members in parts.groups.items():
        own = [first[k] + some for k, some in members.items() if k in first]
        if own and sum(map(len, own)):
            groups[name] = np.concatenate(own)
        used = np.unique(np.concatenate([np.zeros(0, dtype=int), *(parts.blocks[k].nodes[some].ravel()
                         for k, some in members.items())]))  # fmt: skip
        sets[name] = list(dict.fromkeys([*sets.get(name, []), *(parts.labels[i] for i in used)]))
    _check_faces(path, parts, kinds[0], cells, solid)
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(-1, len(KINDS[kinds[0]].corners) + len(KINDS[kinds[0]].between))
    places = parts.places[used]
    if dimension == 2 and np.ptp(places[:, 2]) > SMALLEST * np.ptp(places, axis=0).max():
        at = _place(places[[np.abs(places[:, 2] - places[0, 2]).argmax()]])
        raise _refused(path, f"{kinds[0]} cells out of a plane z = constant, which are shells, at {at}")
    nodes = Nodes(dict(zip(parts.labels, parts.places, strict=True)), sets)
    mesh = SolidMesh(kinds[0], cells, [parts.labels[i] for i in used], nodes, groups)
    _check_cells(path, mesh)
    return mesh


def _check_faces(path: Path, parts: _Parts, kind: str, cells: Indices, solid: list[int]) -> None:
    """Refuse cells of fewer dimensions that do not lie on the faces or edges of the solids."""
    if len(solid) == len(parts.blocks):
        return
    facets = {frozenset(map(int, row)) for side in KINDS[kind].facets for row in cells[:, list(side)]}
    inside = set(map(int, np.unique(cells)))
    for k, block in enumerate(parts.blocks):
        if k in solid:
            continue
        corners = len(KINDS[block.kind].corners) if block.kind in KINDS else 2
        for row in block.nodes:
            own = frozenset(map(int, row[:corners]))
            if own not in facets and not (corners == 2 and KINDS[kind].dimension == 3 and own <= inside):
                what = "beams" if corners == 2 else "shells"
                raise _refused(path, f"a {block.type} at {_place(parts.places[row])} on no face of the solids ({what})")


def _check_cells(path: Path, mesh: SolidMesh) -> None:
    """Refuse flat, inverted and separate cells."""
    sizes = mesh.made(1.0).jacobians
    bad = np.flatnonzero(~(sizes.min(axis=1) > SMALLEST * np.abs(sizes).max(axis=1)))
    if len(bad):
        corners = [mesh.labels[i] for i in mesh.cells[bad[0]][: len(KINDS[mesh.kind].corners)]]
        at = _place(np.array([mesh.nodes.places[one] for one in corners]))
        raise _fault(path, f"{len(bad)} of {counted(len(sizes), 'cell')} flat or inverted, the first at {at} of nodes "
                     f"{', '.join(corners)}", "cells with a volume, nodes in the order of the format")  # fmt: skip
    count = len(mesh.labels)
    rows = np.repeat(mesh.cells[:, 0], mesh.cells.shape[1])
    links = sp.coo_array((np.ones(len(rows)), (rows, mesh.cells.ravel())), (count, count))
    pieces, piece = connected_components(links, directed=False)
    if pieces > 1:
        at = _place(np.array([mesh.nodes.places[mesh.labels[int(np.flatnonzero(piece == piece.max())[0])]]]))
        raise _fault(path, f"{pieces} pieces that share no nodes, one at {at}", "one body",
                     "merge nodes at the same place, or make a file of each body")  # fmt: skip


def _place(x: Array) -> str:
    return f"({', '.join(f'{value + 0.0:.4g}' for value in np.atleast_2d(x).mean(axis=0))})"
