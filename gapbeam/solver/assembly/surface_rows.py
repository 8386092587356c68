"""Displacement and its gradient at points spread over the surface of a mesh, as rows on the DOFs.

The largest strains and rotations of a bent beam lie where its surface is farthest from the axis. One point in the
middle of a facet, of a few hundred facets along the beam, shows how large they get at the cost of short rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.meshes.mesh_readings import exterior_facets, facet_middles
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.assembly.contact_assembly import dof_interface
from gapbeam.solver.assembly.face_quadrature import FacePoints, PointRule, along_beam, face_points, gather_points
from gapbeam.solver.system.operators import Array, Indices, Interface

MOST_POINTS = 384
MOST_ON_FACES = 32  # of base and gland together
IN_THE_MIDDLE = PointRule(1)
WAYS = {2: 2, 3: 8}  # across the beam, by its dimension
AS_FAR = 1.0e-6  # of the distance of a facet from the axis


@dataclass(frozen=True)
class SurfaceRows:
    """Rows that give displacement and gradient at k points, from the DOFs that they depend on.

    Attributes:
        interface: DOFs that the rows depend on.
        places: The points, (k, 3), m.
        on_faces: Number of those spread over base and gland; they come first.
        displacement: (k d, interface.size), component by component of each point.
        gradient: (k d d, interface.size), du_i / dx_j, j running first.
        cell_middles: x of the middle of the cell in which the gradient is taken, (k,), m.
    """

    interface: Interface
    places: Array
    on_faces: int
    displacement: csr_matrix
    gradient: csr_matrix
    cell_middles: Array


def surface_rows(space: Any, faces: Indices) -> SurfaceRows:
    """Return the rows of a mesh.

    Args:
        space: Blocked vector Lagrange space.
        faces: Local facets of base and gland.

    Collective.
    """
    mesh = space.mesh
    chosen = [_spread(mesh, faces, MOST_ON_FACES), _outermost(mesh, exterior_facets(mesh), MOST_POINTS)]
    parts = [gather_points(mesh.comm, face_points(space, facets, IN_THE_MIDDLE, 1.0)) for facets in chosen]
    return rows_at(space, FacePoints.join(parts), len(parts[0].weights))


def rows_at(space: Any, points: FacePoints, on_faces: int = 0) -> SurfaceRows:
    """Return the rows of given points, the same on all ranks.

    Args:
        space: Blocked vector Lagrange space.
        points: The points.
        on_faces: Number of them on base and gland, which come first.

    Collective.
    """
    block, count = space.dofmap.index_map_bs, len(points.weights)
    columns = points.nodes[:, :, None] * block + np.arange(block)
    interface, slots = dof_interface(space, [columns.reshape(-1)], block)
    placed = slots(columns.reshape(-1)).reshape(columns.shape)
    values = np.repeat(points.values[:, :, None], block, axis=2)
    rows = np.broadcast_to((np.arange(count)[:, None] * block + np.arange(block))[:, None, :], placed.shape)
    displacement = csr_matrix(
        (values.reshape(-1), (rows.reshape(-1), placed.reshape(-1))), (count * block, interface.size)
    )
    slopes = np.broadcast_to(points.gradients[:, :, None, :], (*placed.shape, block))
    turned = rows[..., None] * block + np.arange(block)
    gradient = csr_matrix(
        (slopes.reshape(-1), (turned.reshape(-1), np.repeat(placed.reshape(-1), block))),
        (count * block * block, interface.size),
    )
    middles = _cell_middles(space.mesh, points.cells)
    return SurfaceRows(interface, points.positions, on_faces, displacement, gradient, middles)


def _cell_middles(mesh: Any, cells: Indices) -> Array:
    """Return the mean x of the nodes of cells, by their global numbers, (k,), the same on all ranks. Collective."""
    index_map = mesh.topology.index_map(mesh.topology.dim)
    first, count = index_map.local_range[0], index_map.size_local
    mine = (cells >= first) & (cells < first + count)
    found = np.zeros(len(cells))
    found[mine] = mesh.geometry.x[coordinate_dofs(mesh)[cells[mine] - first], 0].mean(axis=1)
    return np.asarray(mesh.comm.allreduce(found))


def _outermost(mesh: Any, facets: Indices, most: int) -> Indices:
    """Return the facets farthest from the axis in each way and part of the length, at most so many, of this rank.

    Of facets that are as far, that is taken which is nearest to an end of the beam. Collective.
    """
    gathered = mesh.comm.allgather(facet_middles(mesh, facets))
    first, places = sum(len(part) for part in gathered[: mesh.comm.rank]), np.concatenate(gathered)
    ways = WAYS[mesh.geometry.dim]
    order = along_beam(places)
    low, size = places.min(axis=0), np.ptp(places, axis=0)
    along, *across = ((places - low) / np.where(size > 0.0, size, 1.0)).T[: mesh.geometry.dim]
    angles = 2.0 * np.pi / ways * np.arange(ways)
    far = np.column_stack(across) @ np.array([np.cos(angles), np.sin(angles)])[: len(across)]
    part = np.minimum((along * (most // ways)).astype(int), most // ways - 1)
    kept = set[int]()
    for one in np.unique(part):
        here = order[part[order] == one]
        for way in far[here].T:
            farthest = here[way > way.max() - AS_FAR]
            kept.add(int(farthest[0 if 2 * one < most // ways else -1]))
    mine: Indices = np.sort(np.array(list(kept)) - first)
    return np.asarray(facets)[mine[(mine >= 0) & (mine < len(facets))]]


def _spread(mesh: Any, facets: Indices, most: int) -> Indices:
    """Return at most so many facets of all ranks, spread along the mesh, those of this rank. Collective."""
    gathered = mesh.comm.allgather(facet_middles(mesh, facets))
    first = sum(len(part) for part in gathered[: mesh.comm.rank])
    order = along_beam(np.concatenate(gathered))
    step = -(-len(order) // most) | 1  # odd, so that facets above each other are not passed by
    kept = order[::step]
    mine = kept[(kept >= first) & (kept < first + len(facets))] - first
    return np.asarray(facets)[np.sort(mine)]
