"""Rigid-body modes: the null space of the elastic stiffness of a free body."""

from __future__ import annotations

from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array


def rigid_body_modes(space: Any) -> Array:
    """Return the rigid-body modes R, orthonormal, on a blocked vector Lagrange space: (n, 3) in 2D, (n, 6) in 3D.

    Translations, and rotations about the center as displacements linear in the coordinates; orthonormal over all
    ranks.

    Collective.
    """
    comm, block = space.mesh.comm, space.dofmap.index_map_bs
    places = space.tabulate_dof_coordinates()[: space.dofmap.index_map.size_local, :block]
    count = space.dofmap.index_map.size_global
    places = places - sum(comm.allgather(places.sum(axis=0))) / count
    axes = [np.broadcast_to(axis, places.shape) for axis in np.eye(block)]
    for first in range(block):
        for second in range(first + 1, block):
            turn = np.zeros_like(places)
            turn[:, first], turn[:, second] = -places[:, second], places[:, first]
            axes.append(turn)
    motions = np.stack([motion.reshape(-1) for motion in axes], axis=1)
    motions /= np.sqrt(sum(comm.allgather((motions**2).sum(axis=0))))
    for _ in range(2):  # twice is enough (Cholesky-QR)
        gram = sum(comm.allgather(motions.T @ motions))
        motions = np.linalg.solve(np.linalg.cholesky(gram), motions.T).T
    return np.ascontiguousarray(motions)
