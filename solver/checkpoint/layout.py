"""How the DOFs of a model lie on the ranks, and how those of a checkpoint are found in it.

A full model keeps its DOFs at the nodes of a mesh, numbered anew for every number of ranks: they are matched by place.
A reduced one has them in a basis that is found anew: where it is not the same to the last bit, the motion of the mesh
is taken in its place. Beam elements are numbered along the beam.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solver.case_tables.model import BeamModel
from solver.checkpoint.files import BrokenCheckpoint
from solver.dense import DenseOperators
from solver.modal import modal_system
from solver.model import Model
from solver.operators import Array, Indices
from solver.places import matching

NODES, POINTS = "nodes", "points"
IN_THE_BASIS = 1.0e-6  # of a motion: what of it another basis may miss


@dataclass(frozen=True)
class Layout:
    """Where the DOFs of a model are.

    Attributes:
        model: The model.
        comm: Its ranks.
        nodes: Coordinates of all nodes in the order of the ranks, (N, 3), m, on rank 0.
        counts: Nodes of each rank, (ranks,).
        basis: Checksum of the basis that DOFs are in; empty where they are at the nodes of mesh or beam.
        modes: Checksum of the modal coordinates of compiled loops; empty where there are none.
    """

    model: Model
    comm: MPI.Comm
    nodes: Array
    counts: Indices
    basis: str
    modes: str

    @property
    def spread_out(self) -> bool:
        """Whether every rank has DOFs of its own."""
        return self.model.body.expansion is None

    @property
    def places(self) -> Array:
        """Contact points with a coordinate more that tells the faces apart, (m, 4), m."""
        contact = self.model.system.contact
        return np.column_stack([contact.positions, self.model.case.beam.length * contact.faces])

    def gathered(self, x: Array) -> Array:
        """Return rows (..., n) of vectors on the DOFs, or on the nodes, of all ranks: (..., N, components); on rank 0.

        Collective.
        """
        parts = self.comm.gather(x.reshape(*x.shape[:-1], -1, self._components))
        return np.concatenate(parts, axis=-2) if parts is not None else x

    def scattered(self, x: Array) -> Array:
        """Return the part of this rank, (..., n), of what `gathered` returned on rank 0. Collective."""
        parts = None
        if self.comm.rank == 0:
            parts = [np.ascontiguousarray(part) for part in np.split(x, np.cumsum(self.counts)[:-1], axis=-2)]
        mine = self.comm.scatter(parts)
        return np.asarray(mine.reshape(*mine.shape[:-2], -1))

    def coordinates(self, moved: Array) -> Array:
        """Return the DOFs (r,) of a basis in which the nodes of this rank move like that, (n,).

        Raises:
            BrokenCheckpoint: No DOFs do.

        Collective.
        """
        basis = self.model.body.expansion
        assert isinstance(basis, np.ndarray)
        gram, seen = self._sum(basis.T @ basis), self._sum(basis.T @ moved)
        found = np.linalg.solve(gram, seen)
        missed = moved - basis @ found
        left, size = self._sum(np.array([missed @ missed, moved @ moved]))
        if left > IN_THE_BASIS**2 * size:
            raise BrokenCheckpoint("its motion is not one of the reduced basis")
        return np.asarray(found)

    def matched(self, arrays: Mapping[str, NDArray[Any]]) -> tuple[Indices, Indices]:
        """Return which nodes and which contact points of a checkpoint are those here; on rank 0.

        Raises:
            ValueError: They are not the same places.
        """
        return matching(arrays[NODES], self.nodes), matching(arrays[POINTS], self.places)

    @property
    def _components(self) -> int:
        return int(self.model.space.dofmap.index_map_bs)

    def _sum(self, local: Array) -> Array:
        total = self.comm.reduce(local)
        return np.asarray(self.comm.bcast(total))


def layout_of(model: Model, comm: MPI.Comm) -> Layout:
    """Return where the DOFs of a model are. Collective."""
    space = model.space
    owned = space.dofmap.index_map.size_local
    parts = comm.gather(np.ascontiguousarray(space.tabulate_dof_coordinates()[:owned]))
    nodes = np.concatenate(parts) if parts is not None else np.zeros((0, 3))
    basis = ""
    if isinstance(model.body.expansion, np.ndarray) and not isinstance(model.case.model, BeamModel):
        basis = ",".join(comm.allgather(_checksum(model.body.expansion)))
    modal = modal_system(model.system) if isinstance(model.system.operators, DenseOperators) else None
    modes = "" if modal is None else ",".join(comm.allgather(_checksum(modal.shapes)))
    return Layout(model, comm, nodes, np.array(comm.allgather(owned)), basis, modes)


def _checksum(matrix: Array) -> str:
    return hashlib.sha256(np.ascontiguousarray(matrix).tobytes()).hexdigest()
