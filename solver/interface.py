"""From tagged faces to the contact operator G, w, g0.

Contact points are the quadrature points of the facets of base and gland. The faces are met along the bending
axis: the base lies below the lowest point of its face, the gland `clearance` above the highest point of its
face, so faces that are not flat start with their own gaps. Weights are areas projected on the bending axis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from solver.face_points import along_beam, face_points, gather_points
from solver.system import Array, ContactOperator, Indices, Interface

NO_ENTRY = 1.0e-12  # basis functions that are zero but for round-off


def contact_operator(
    space: Any, faces: Mapping[str, Indices], clearance: float, width: float, degree: int
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
    axis = space.mesh.geometry.dim - 1
    gathered = {
        name: gather_points(space.mesh.comm, face_points(space, facets, degree, width))
        for name, facets in faces.items()
    }
    coordinates = _node_coordinates(space)
    slots: dict[int, int] = {}
    rows, columns, entries, gaps = [], [], [], []
    count = 0
    for name, points in gathered.items():
        used = np.abs(points.values) > NO_ENTRY
        nodes = np.unique(points.nodes[used])
        for node in nodes[along_beam(coordinates(nodes))]:
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
    pattern = (np.concatenate(rows), np.concatenate(columns))
    return ContactOperator(
        interface=_interface(space, slots, axis),
        gap_matrix=csr_matrix((np.concatenate(entries), pattern), shape=(count, len(slots))),
        weights=np.concatenate([points.weights for points in gathered.values()]),
        initial_gap=np.concatenate(gaps),
        faces=np.repeat(np.arange(len(gathered)), [len(points.weights) for points in gathered.values()]),
        face_names=tuple(gathered),
        positions=np.concatenate([points.positions for points in gathered.values()]),
    )


def _interface(space: Any, slots: dict[int, int], axis: int) -> Interface:
    """Return the interface DOFs: one component of some nodes, given by global node number and slot."""
    index_map, block = space.dofmap.index_map, space.dofmap.index_map_bs
    first, end = index_map.local_range
    mine = [(node, slot) for node, slot in slots.items() if first <= node < end]
    return Interface(
        size=len(slots),
        owned=np.array([(node - first) * block + axis for node, _ in mine], dtype=np.int64),
        slots=np.array([slot for _, slot in mine], dtype=np.int64),
    )


def _node_coordinates(space: Any) -> Callable[[Indices], Array]:
    """Return a function from global node numbers to coordinates, the same on all ranks. Collective."""
    comm, index_map = space.mesh.comm, space.dofmap.index_map
    first, end = index_map.local_range
    local = space.tabulate_dof_coordinates()[: index_map.size_local]

    def look_up(nodes: Indices) -> Array:
        found = np.zeros((len(nodes), 3))
        mine = (nodes >= first) & (nodes < end)
        found[mine] = local[nodes[mine] - first]
        return np.asarray(comm.allreduce(found))

    return look_up
