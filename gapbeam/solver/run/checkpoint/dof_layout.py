"""Layout of the DOFs of a model on the ranks, and the places of a checkpoint's DOFs in it.

A full model keeps its DOFs at the nodes of a mesh, numbered anew for every number of ranks: they are matched by place.
A model of few DOFs has the same ones on all ranks, as long as it goes on with the same matrices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.checkpoint_files import Contents
from gapbeam.solver.run.checkpoint.kept_model import matrices_of, sum_of
from gapbeam.solver.run.output.parallel_tables import ParallelTable, RankRows, found_rows, rank_by_rank
from gapbeam.solver.run.output.point_order import matching
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Array, Indices

NODES, POINTS = "nodes", "points"


@dataclass(frozen=True)
class DofLayout:
    """Layout of the DOFs of a model on the ranks.

    Attributes:
        model: The model.
        comm: Its ranks.
        nodes: Coordinates of the nodes of this rank, (n, 3), m.
        rows: Where they are among all nodes, rank by rank.
        basis: Checksum of the matrices of a model of few DOFs; empty where DOFs are at the nodes of a mesh.
        modes: Checksum of the modal coordinates of compiled loops; empty where there are none.
    """

    model: Model
    comm: MPI.Comm
    nodes: Array
    rows: RankRows
    basis: str
    modes: str

    @property
    def spread_out(self) -> bool:
        """True where every rank has DOFs of its own."""
        return self.model.body.expansion is None

    @property
    def places(self) -> Array:
        """Contact points with a coordinate more that distinguishes the faces, (m, 4), m."""
        contact = self.model.system.contact
        return np.column_stack([contact.positions, self.model.case.beam.length * contact.faces])

    @property
    def node_table(self) -> ParallelTable:
        """The coordinates of all nodes, (N, 3), m."""
        return ParallelTable(self.rows, self.nodes)

    def table(self, x: Array) -> ParallelTable:
        """Return rows (..., n) of vectors on the DOFs of this rank as a table (..., N, components)."""
        return ParallelTable(self.rows, x.reshape(*x.shape[:-1], -1, self.components), layered=x.ndim > 1)

    def found_in(self, contents: Contents | None) -> RankRows:
        """Return the places of this rank's nodes in a checkpoint, which is there on rank 0.

        Raises:
            ValueError: They are not the same places.

        Collective.
        """

        def pieces() -> Iterator[Array]:
            assert contents is not None  # on rank 0
            if contents.shapes[NODES][1:] != self.nodes.shape[1:]:
                raise ValueError(f"nodes of the shape {contents.shapes[NODES]}")
            return contents.pieces(NODES)

        return found_rows(self.comm, self.nodes, pieces)

    def points_in(self, contents: Contents) -> Indices:
        """Return the contact points of a checkpoint that match those here; on rank 0.

        Raises:
            ValueError: They are not the same places.
        """
        return matching(contents.array(POINTS), self.places)

    @property
    def components(self) -> int:
        """Components of the displacement."""
        return int(self.model.space.dofmap.index_map_bs)


def layout_of(model: Model, comm: MPI.Comm) -> DofLayout:
    """Return the layout of the DOFs of a model. Collective."""
    space = model.space
    owned = space.dofmap.index_map.size_local
    nodes = np.ascontiguousarray(space.tabulate_dof_coordinates()[:owned])
    basis = "" if model.body.expansion is None else sum_of(matrices_of(model.body))
    modal = modal_system(model.system) if isinstance(model.system.operators, DenseOperators) else None
    modes = "" if modal is None else sum_of({"shapes": modal.shapes})
    return DofLayout(model, comm, nodes, rank_by_rank(comm, owned), comm.bcast(basis), comm.bcast(modes))
