"""Cells distributed to the ranks in slices across the beam, the same in every run.

The cells in the support and those outside are sliced each for themselves, and every rank gets a slice of both: contact
facets, and all that is done for them, are spread over the ranks like the rest. Outside the support the ranks come in
the opposite order, so that a rank has the same two neighbors in both parts (of two ranks the one in the middle has both
cuts to answer for, `gapbeam.solver.linear_algebra.substructured_factor`, and gets fewer cells):

    support  0 | 1 | 2      outside  2   |   1   |   0
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.versions.mesh_geometry import adjacency
from gapbeam.meshes.versions.mesh_maker import read_model

if TYPE_CHECKING:
    from gapbeam.meshes.versions.mesh_geometry import Adjacency


def mesh_from_gmsh(comm: MPI.Comm, dimension: int, end: Callable[[], float]) -> tuple[Mesh, MeshTags, MeshTags]:
    """Distribute the current gmsh model of rank 0, with ghost cells across shared facets.

    The model has been checked: every cell is tagged once, one cell type, facet groups present.

    Args:
        comm: The ranks.
        dimension: Dimension of the cells.
        end: Called on rank 0; returns where the last support ends, m.

    Returns:
        Mesh, cell tags, facet tags.

    Collective.
    """
    centers: list[npt.NDArray[np.float64]] = []

    def look() -> float:
        centers.append(cell_centers(dimension))
        return end()

    support = on_rank_zero(comm, look)
    return read_model(comm, dimension, slices(centers[0] if centers else np.empty((0, 3)), support))


Partitioner = Callable[[Any, int, Any, bool], "Adjacency"]
Floats = npt.NDArray[np.float64]

SAME = 1.0e-9  # of the length: cells of one layer
BETWEEN = 0.46  # of all cells, for that one of two ranks which lies between two cuts and answers for both
WHOLE_LAYERS = 4.0  # layers in a slice, from which on it is better to cut between two than evenly


def slices(centers: Floats, support: float) -> Partitioner:
    """Return a partitioner of the dual graph of a mesh, whose cells are all on rank 0, into parts of equal size.

    PT-Scotch, the default of DOLFINx, balances as well but does not always give the same parts.

    Args:
        centers: Centers of the cells, in the order of the graph, (cells, 3), m; looked at on rank 0 only.
        support: End of the support along the beam (x), m.

    Returns:
        Function of communicator, number of parts, neighbors of the cells and whether a cell goes to the ranks of its
        neighbors, too; it returns for each cell its rank, then the ranks where it is a ghost.
    """

    def divide(_comm: Any, parts: int, neighbors: Any, ghosting: bool) -> Adjacency:
        offsets = np.asarray(neighbors.offsets, dtype=np.int32)
        if len(offsets) == 1:
            return adjacency(np.empty(0, dtype=np.int32), np.zeros(1, dtype=np.int32))
        return _with_ghosts(owners(centers, support, parts), offsets, np.asarray(neighbors.array), ghosting)

    return divide


def owners(centers: Floats, support: float, parts: int) -> npt.NDArray[np.int64]:
    """Return the rank of each cell; arguments as in `slices`."""
    rounded = np.round(centers / max(float(np.ptp(centers[:, 0])), 1e-300) / SAME)
    along = np.lexsort((rounded[:, 2], rounded[:, 1], rounded[:, 0]))
    supported = centers[along, 0] < support
    within, outside, ranks = along[supported], along[~supported], np.arange(parts)
    found = np.empty(len(centers), dtype=np.int64)
    cuts = ranks[1:] * len(within) // parts
    found[within] = ranks[_part_of_each(rounded[within, 0], cuts)]
    cuts = ranks[1:] * len(outside) // parts
    if parts == 2 and len(within) > 1:
        cuts = np.array([max(0, int(BETWEEN * len(centers)) - len(within) // 2)])
    found[outside] = ranks[::-1][_part_of_each(rounded[outside, 0], cuts)]
    return found


def _part_of_each(x: Floats, cuts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the part of each of some sorted places among consecutive parts; parts of many layers end between two."""
    layers = np.flatnonzero(np.diff(x) > 0) + 1
    if len(layers) + 1 >= WHOLE_LAYERS * (len(cuts) + 1):
        cuts = layers[np.argmin(np.abs(layers[:, None] - cuts), axis=0)]
    return np.searchsorted(cuts, np.arange(len(x)), side="right")


def _with_ghosts(
    owner: npt.NDArray[np.int64], offsets: npt.NDArray[np.int32], links: npt.NDArray[np.int32], ghosting: bool
) -> Adjacency:
    count = len(owner)
    destinations = np.column_stack([np.arange(count), owner])
    if ghosting:
        cells = np.repeat(np.arange(count), np.diff(offsets))
        foreign = owner[links] != owner[cells]
        ghosts = np.unique(np.column_stack([cells[foreign], owner[links[foreign]]]), axis=0)
        destinations = np.concatenate([destinations, ghosts])
    # stable: the owner stays in front of the ghosts
    destinations = destinations[np.argsort(destinations[:, 0], kind="stable")]
    starts = np.searchsorted(destinations[:, 0], np.arange(count + 1))
    return adjacency(destinations[:, 1], starts)


def cell_centers(dimension: int) -> npt.NDArray[np.float64]:
    """Return the mean places of the corners of all cells in physical groups, (cells, 3), m."""
    import gmsh

    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = np.empty((int(tags.max()) + 1, 3))
    points[tags.astype(np.int64)] = coordinates.reshape(-1, 3)
    centers = []
    for dim, tag in gmsh.model.getPhysicalGroups(dimension):
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            kinds, _, nodes = gmsh.model.mesh.getElements(dim, entity)
            *_, corners = gmsh.model.mesh.getElementProperties(kinds[0])
            count = gmsh.model.mesh.getElementProperties(kinds[0])[3]
            cells = nodes[0].astype(np.int64).reshape(-1, count)
            centers.append(points[cells[:, :corners]].mean(axis=1))
    return np.concatenate(centers)


def end_of(dimension: int, groups: dict[str, int], names: tuple[str, ...]) -> float:
    """Return the largest x of the nodes of some groups of facets, m."""
    import gmsh

    nodes = [gmsh.model.mesh.getNodesForPhysicalGroup(dimension - 1, groups[name])[1] for name in names]
    return float(np.max(np.concatenate(nodes).reshape(-1, 3)[:, 0]))
