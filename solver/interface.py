"""From tagged faces to the contact operator G, w, g0.

Contact points are the quadrature points of the facets of base and gland. The faces are met along the bending
axis: the base lies below the lowest point of its face, the gland `clearance` above the highest point of its
face, so faces that are not flat start with their own gaps. Weights are areas projected on the bending axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from mpi4py import MPI
from scipy.sparse import csr_matrix

from solver.system import Array, ContactOperator, Indices, Interface


@dataclass(frozen=True)
class FacePoints:
    """Quadrature points of the facets of one face.

    Attributes:
        nodes: Global numbers of the nodes of the cell of each point, (m, k).
        values: Basis functions of these nodes at the point, (m, k).
        weights: Projected areas, (m,), m^2 (m times the width in 2D).
        positions: (m, 3), m.
    """

    nodes: Indices
    values: Array
    weights: Array
    positions: Array


def face_points(space: Any, facets: Indices, degree: int, width: float) -> FacePoints:
    """Tabulate a scalar or blocked Lagrange space at the quadrature points of facets of this rank.

    Args:
        space: The space; its nodes (blocks) are meant, not its components.
        facets: Local numbers of exterior facets.
        degree: Quadrature degree.
        width: Factor of the weights.

    Not collective; facets of ghost cells are left out, so every facet counts on one rank only.
    """
    mesh = space.mesh
    topology, geometry = mesh.topology, mesh.geometry
    dimension = topology.dim
    cell_type = getattr(basix.CellType, topology.cell_name())
    topology.create_connectivity(dimension - 1, dimension)
    topology.create_connectivity(dimension, dimension - 1)
    facet_to_cell = topology.connectivity(dimension - 1, dimension)
    cell_to_facet = topology.connectivity(dimension, dimension - 1)
    owned_cells = topology.index_map(dimension).size_local
    element = _lagrange(cell_type, space.element.basix_element.degree)
    shape = _lagrange(cell_type, geometry.cmap.degree)
    reference = basix.geometry(cell_type)
    corners = basix.topology(cell_type)[dimension - 1]
    coordinate_nodes = geometry.dofmap
    node_count, dimension_map = space.dofmap.index_map.size_local, space.dofmap.index_map
    del node_count
    nodes, values, weights, positions = [], [], [], []
    for facet in facets:
        cell = facet_to_cell.links(facet)[0]
        if cell >= owned_cells:
            continue
        local = int(np.flatnonzero(cell_to_facet.links(cell) == facet)[0])
        corner = reference[corners[local]]
        facet_type = {2: basix.CellType.interval, 3: None}[dimension] or (
            basix.CellType.triangle if len(corner) == 3 else basix.CellType.quadrilateral
        )
        points, factors = basix.make_quadrature(facet_type, degree)
        tangents = corner[1:dimension] - corner[0]
        on_cell = corner[0] + points @ tangents
        basis = element.tabulate(0, on_cell)[0, :, :, 0]
        mapping = shape.tabulate(1, on_cell)[:, :, :, 0]
        corners_x = geometry.x[coordinate_nodes[cell]]
        jacobian = np.einsum("dqk,kx->qdx", mapping[1:], corners_x)
        physical = np.einsum("td,qdx->qtx", tangents, jacobian)
        projected = (
            np.abs(physical[:, 0, 0])
            if dimension == 2
            else np.abs(physical[:, 0, 0] * physical[:, 1, 1] - physical[:, 0, 1] * physical[:, 1, 0])
        )
        cell_nodes = dimension_map.local_to_global(space.dofmap.cell_dofs(cell).astype(np.int32))
        nodes.append(np.broadcast_to(cell_nodes, basis.shape))
        values.append(basis)
        weights.append(factors * projected * width)
        positions.append(mapping[0] @ corners_x)
    width_of_rows = element.dim
    return FacePoints(
        np.concatenate(nodes).astype(np.int64) if nodes else np.empty((0, width_of_rows), dtype=np.int64),
        np.concatenate(values) if values else np.empty((0, width_of_rows)),
        np.concatenate(weights) if weights else np.empty(0),
        np.concatenate(positions) if positions else np.empty((0, 3)),
    )


def _lagrange(cell_type: Any, degree: int) -> Any:
    return basix.create_element(
        basix.ElementFamily.P, cell_type, degree, basix.LagrangeVariant.gll_warped, dtype=np.float64
    )


def gather_points(comm: MPI.Comm, points: FacePoints) -> FacePoints:
    """Return the points of all ranks, ordered along the beam and across it. Collective."""
    everywhere = comm.allgather(points)
    merged = FacePoints(
        *(np.concatenate([getattr(p, name) for p in everywhere]) for name in ("nodes", "values", "weights")),
        np.concatenate([p.positions for p in everywhere]),
    )
    order = along_beam(merged.positions)
    return FacePoints(*(getattr(merged, name)[order] for name in ("nodes", "values", "weights", "positions")))


def along_beam(positions: Array) -> Indices:
    """Return the order by x, then y, then z, insensitive to round-off."""
    span = float(np.ptp(positions[:, 0])) if len(positions) else 1.0
    rounded = np.round(positions / max(span, 1e-300) * 1e7)
    return np.lexsort((rounded[:, 2], rounded[:, 1], rounded[:, 0]))


def contact_operator(
    space: Any, faces: dict[str, Indices], clearance: float, width: float, degree: int
) -> ContactOperator:
    """Build G, w and g0 for base (below, gap u) and gland (above, gap clearance - u).

    Args:
        space: Blocked vector Lagrange space.
        faces: Local facets of "base" and "gland".
        clearance: m, of any sign.
        width: Factor of the weights in 2D, 1 in 3D, m.
        degree: Quadrature degree on the facets.

    Collective.
    """
    comm, index_map, block = space.mesh.comm, space.dofmap.index_map, space.dofmap.index_map_bs
    axis = space.mesh.geometry.dim - 1
    gathered = {name: gather_points(comm, face_points(space, facets, degree, width)) for name, facets in faces.items()}
    coordinates = _node_coordinates(space)
    slots: dict[int, int] = {}
    rows, columns, entries, gaps = [], [], [], []
    count = 0
    for name, points in gathered.items():
        used = np.abs(points.values) > 1e-12
        nodes = np.unique(points.nodes[used])
        place = coordinates(nodes)
        for node in nodes[along_beam(place)]:
            slots.setdefault(int(node), len(slots))
        sign = 1.0 if name == "base" else -1.0
        height = points.positions[:, axis]
        level = height.min() if name == "base" else height.max() + clearance
        gaps.append(sign * (height - level))
        point, local = np.nonzero(used)
        rows.append(point + count)
        columns.append([slots[int(node)] for node in points.nodes[point, local]])
        entries.append(sign * points.values[point, local])
        count += len(height)
    first, last = index_map.local_range
    mine = [(node, slot) for node, slot in slots.items() if first <= node < last]
    interface = Interface(
        size=len(slots),
        owned=np.array([(node - first) * block + axis for node, _ in mine], dtype=np.int64),
        slots=np.array([slot for _, slot in mine], dtype=np.int64),
    )
    return ContactOperator(
        interface=interface,
        gap_matrix=csr_matrix(
            (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(count, len(slots))
        ),
        weights=np.concatenate([points.weights for points in gathered.values()]),
        initial_gap=np.concatenate(gaps),
        faces=np.repeat(np.arange(len(gathered)), [len(points.weights) for points in gathered.values()]),
        face_names=tuple(gathered),
        positions=np.concatenate([points.positions for points in gathered.values()]),
    )


def _node_coordinates(space: Any) -> Any:
    """Return a function from global node numbers to coordinates, the same on all ranks. Collective."""
    comm, index_map = space.mesh.comm, space.dofmap.index_map
    first, last = index_map.local_range
    local = space.tabulate_dof_coordinates()[: index_map.size_local]

    def look_up(nodes: Indices) -> Array:
        found = np.zeros((len(nodes), 3))
        mine = (nodes >= first) & (nodes < last)
        found[mine] = local[nodes[mine] - first]
        return np.asarray(comm.allreduce(found))

    return look_up
