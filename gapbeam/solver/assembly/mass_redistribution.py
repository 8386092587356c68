"""Massless contact nodes: the mass of the contact faces is moved into the body.

    M' = E^T M E,    (E x)_i = sum_j c_ij x_j  at the contact nodes i,    (E x)_j = x_j  elsewhere

The c_ij extrapolate from nodes j inside the body and are exact for linear functions, so that rigid motions keep their
momentum and energy: mass, center of gravity and moments of inertia stay what they are. Contact nodes carry no mass;
they are in static equilibrium with the contact pressure, and no inertia is thrown against the faces at touch.

Lumped masses, m' = E^T m, would become negative so. For them E is linear along the faces only and constant across:
mass and center of gravity stay, the mass moves inward by a node.

Source: Khenous, Laborde and Renard (2008), Eur. J. Mech. A 27, 918-932, for the idea and what M' has to keep.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array, Indices

NEAREST = 4  # nodes to extrapolate from, at first; doubled until they span the space
MOST_NEIGHBOURS = 512
LARGEST_SUM = 12.0  # of |c_ij|: more would be noise, not an extrapolation
SINGULAR = 1.0e-9


def extrapolation(space: Any, facets: Indices, lumped: bool = False) -> PETSc.Mat:
    """Return E, (n, n), distributed like the vectors of the space.

    Args:
        space: Blocked vector Lagrange space.
        facets: Local numbers of the facets of both contact faces.
        lumped: Whether the masses are lumped.

    Raises:
        UserError: There are too few nodes between the faces to extrapolate from.

    Collective.
    """
    comm, index_map, block = space.mesh.comm, space.dofmap.index_map, space.dofmap.index_map_bs
    dimension = space.mesh.geometry.dim
    first, end = index_map.local_range
    local = fem.locate_dofs_topological(space, dimension - 1, facets)
    contact = np.unique(np.concatenate(comm.allgather(index_map.local_to_global(local.astype(np.int32)))))
    owned = np.arange(first, end)
    places = space.tabulate_dof_coordinates()[: end - first, :dimension]
    on_face = np.isin(owned, contact)
    end_of_faces, height = _extent(comm, places[on_face])
    inside = ~on_face & (places[:, 0] <= end_of_faces + height)
    numbers = np.concatenate(comm.allgather(owned[inside]))
    body = np.concatenate(comm.allgather(places[inside]))
    order = np.argsort(numbers)
    numbers, body = numbers[order], body[order]
    tree = scipy.spatial.cKDTree(body)
    axes = dimension - 1 if lumped else dimension
    found = [_coefficients(tree, body, place, axes, height) for place in places[on_face]]
    if not comm.allreduce(all(each is not None for each in found), op=MPI.LAND):
        raise UserError(
            'contact.mass = "redistributed": the mesh has too few nodes between base and gland to take up the mass of '
            "the contact nodes; expected two layers or more of cells that are not much longer than high; try "
            "mesh.cells_through_thickness = 2 with mesh.degree = 2, 3 with degree 1, and a smaller mesh.support_size"
        )
    rows, columns = [owned[~on_face]], [owned[~on_face]]
    values: list[Array] = [np.ones(int(np.sum(~on_face)))]
    for node, each in zip(owned[on_face], found, strict=True):
        assert each is not None
        neighbours, shares = each
        rows.append(np.full(len(shares), node))
        columns.append(numbers[neighbours])
        values.append(shares)
    row, column, value = (np.concatenate(parts) for parts in (rows, columns, values))
    components = np.arange(block)
    row = ((row - first)[:, None] * block + components).reshape(-1)
    column = (column[:, None] * block + components).reshape(-1)
    size, total = (end - first) * block, index_map.size_global * block
    matrix = scipy.sparse.csr_matrix((np.repeat(value, block), (row, column)), (size, total))
    pattern = (matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data)
    return PETSc.Mat().createAIJ(((size, total), (size, total)), csr=pattern, comm=comm)


def _extent(comm: Any, on_faces: Array) -> tuple[float, float]:
    """Return the largest x of the contact nodes and the height between them, m. Collective."""
    spans = comm.allgather((on_faces.min(axis=0), on_faces.max(axis=0)) if len(on_faces) else None)
    low = np.min([span[0] for span in spans if span is not None], axis=0)
    high = np.max([span[1] for span in spans if span is not None], axis=0)
    return float(high[0]), float(high[-1] - low[-1])


def _coefficients(
    tree: scipy.spatial.cKDTree, body: Array, place: Array, axes: int, height: float
) -> tuple[Indices, Array] | None:
    """Return nodes and their c_ij by moving least squares of functions linear in the first axes, or None.

    Nodes farther away than the height of the beam are none of its neighbours.
    """
    count = NEAREST
    while count <= min(MOST_NEIGHBOURS, 2 * len(body)):
        farthest = tree.query(place, min(count, len(body)))[0][-1]
        if farthest > height:
            return None
        near = np.array(sorted(tree.query_ball_point(place, farthest * (1.0 + 1.0e-6))))
        offsets = (body[near] - place) / farthest
        distance = np.linalg.norm(offsets, axis=1)
        weights = 1.0 / distance**4
        linear = np.column_stack([np.ones(len(near)), offsets[:, :axes]])
        gram = linear.T @ (weights[:, None] * linear)
        scale = 1.0 / np.sqrt(np.diagonal(gram).clip(1.0e-300))
        scaled = scale[:, None] * gram * scale
        if np.linalg.eigvalsh(scaled)[0] > SINGULAR:
            unit = np.zeros(len(scale))
            unit[0] = scale[0]
            shares = weights * (linear @ (scale * np.linalg.solve(scaled, unit)))
            if np.sum(np.abs(shares)) <= LARGEST_SUM:
                return near, shares
        count *= 2
    return None
