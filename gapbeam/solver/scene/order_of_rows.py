"""Names and places of the rows of imported matrices, compared with what rigid motions do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.system.operators import Array

FEW_ROWS = 24
MOST = 0.6  # of the nodes: those beside clamped nodes are fewer
STRAINED = 0.02  # of the sum of the sizes of all terms of a force: preloads and digits of exports leave less


def check_order(K: Any, of_node: Mapping[str, Mapping[int, int]], places: Array, cut: float) -> None:
    """Refuse rows in another order than their names, and nodes at other places.

    A rotation about the place of a node leaves its rows without force. A translation does, too, or leaves the force of
    springs from the node to the frame, whose matrix is symmetric.

    Args:
        K: Stiffness of all rows, SI, sparse.
        of_node: Rows of each node by their direction, 0 to 5.
        places: Places of these nodes, (nodes, 3), m.
        cut: Relative error that the digits of K leave, at most.

    Raises:
        ArgumentError: Most nodes have other forces.
    """
    size = K.shape[0]
    if size < FEW_ROWS:
        return
    odd = _odd_forces(K, of_node, places, max(STRAINED, cut))
    nodes = np.array([odd[list(ways.values())].any(axis=0) for ways in of_node.values()])
    moved, turned = nodes[:, :3].any(axis=1).mean(), nodes.any(axis=1).mean()
    if moved > MOST:
        raise ArgumentError(
            f"found that a rigid translation strains at {moved:.0%} of the nodes, expected few; the DOFs are not in "
            "the order of the matrices (a model without rigid motions, such as an axisymmetric one: leave `nodes` out)",
            "dofs",
        )
    if turned > MOST:
        raise ArgumentError(
            f"found that rigid rotations strain at {turned:.0%} of the nodes, expected few; the DOFs are not in the "
            "order of the matrices, rotations have another sign or unit, or the coordinates of `nodes` are others",
            "dofs",
        )


def _odd_forces(K: Any, of_node: Mapping[str, Mapping[int, int]], places: Array, share: float) -> Array:
    """Return true for forces, (DOFs, 6), of rigid motions about the node of each row that no spring explains."""
    size = K.shape[0]
    node, way, own = np.zeros(size, dtype=int), np.zeros(size, dtype=int), np.full((size, 6), -1)
    for k, ways in enumerate(of_node.values()):
        for one, i in ways.items():
            node[i], way[i] = k, one
            own[i, list(ways)] = list(ways.values())
    entries = sp.coo_matrix(K)
    i, j, value = entries.row, entries.col, entries.data
    apart = places[node[j]] - places[node[i]]
    force, most = np.empty((size, 6)), np.empty((size, 6))
    for e in range(6):
        motion = (way[j] == e).astype(float)
        if e >= 3:
            arm = np.cross(np.eye(3)[e - 3], apart)
            motion += np.where(way[j] < 3, arm[np.arange(len(j)), way[j] % 3], 0.0)
        force[:, e] = np.bincount(i, value * motion, size)
        most[:, e] = np.bincount(i, np.abs(value * motion), size)
    back, scale = np.zeros((size, 6)), most.copy()
    of_spring = (own[:, :3] >= 0) & (way[:, None] < 3)
    other = own[:, :3][of_spring], np.broadcast_to(way[:, None], (size, 3))[of_spring]
    back[:, :3][of_spring] = force[other]
    scale[:, :3][of_spring] = np.maximum(most[:, :3][of_spring], most[other])
    return np.asarray(np.abs(force - back) > share * scale)
