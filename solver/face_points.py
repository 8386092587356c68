"""Quadrature points on the contact faces, with the basis functions there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from mpi4py import MPI

from meshes.compat import coordinate_dofs, geometry_order
from solver.system import Array, Indices


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


@dataclass(frozen=True)
class _Rule:
    """What all facets at one place of the reference cell have in common.

    Attributes:
        basis: Basis functions at the points, (q, k).
        shape: Shape functions of the geometry, (q, c).
        slopes: Their derivatives along the one or two tangents of the facet, (t, q, c).
        factors: Quadrature weights, (q,).
    """

    basis: Array
    shape: Array
    slopes: Array
    factors: Array


def face_points(space: Any, facets: Indices, degree: int, width: float) -> FacePoints:
    """Tabulate a scalar or blocked Lagrange space at the quadrature points of facets of this rank.

    The faces are met along the bending axis (the last one), so weights are areas projected on it.

    Args:
        space: The space; its nodes (blocks) are meant, not its components.
        facets: Local numbers of exterior facets.
        degree: Quadrature degree.
        width: Factor of the weights.

    Not collective; facets of ghost cells are left out, so every facet counts on one rank only.
    """
    mesh = space.mesh
    topology, dimension = mesh.topology, mesh.topology.dim
    topology.create_connectivity(dimension - 1, dimension)
    topology.create_connectivity(dimension, dimension - 1)
    facet_to_cell = topology.connectivity(dimension - 1, dimension)
    cell_to_facet = topology.connectivity(dimension, dimension - 1)
    owned_cells = topology.index_map(dimension).size_local
    rules = _rules(space, degree)
    coordinates, cell_coordinates = mesh.geometry.x, coordinate_dofs(mesh)
    empty: Array = np.empty((0, rules[0].basis.shape[1]))
    nodes: list[Indices] = [empty.astype(np.int64)]
    values: list[Array] = [empty]
    weights: list[Array] = [np.empty(0)]
    positions: list[Array] = [np.empty((0, 3))]
    for facet in facets:
        cell = facet_to_cell.links(facet)[0]
        if cell >= owned_cells:
            continue
        rule = rules[int(np.flatnonzero(cell_to_facet.links(cell) == facet)[0])]
        corners = coordinates[cell_coordinates[cell]]
        cell_nodes = space.dofmap.index_map.local_to_global(space.dofmap.cell_dofs(cell).astype(np.int32))
        nodes.append(np.broadcast_to(cell_nodes, rule.basis.shape).astype(np.int64))
        values.append(rule.basis)
        weights.append(rule.factors * width * _projected(np.einsum("tqc,cx->tqx", rule.slopes, corners)))
        positions.append(rule.shape @ corners)
    return FacePoints(np.concatenate(nodes), np.concatenate(values), np.concatenate(weights), np.concatenate(positions))


def gather_points(comm: MPI.Comm, points: FacePoints) -> FacePoints:
    """Return the points of all ranks, ordered along the beam and across it. Collective."""
    everywhere: list[FacePoints] = comm.allgather(points)
    positions = np.concatenate([part.positions for part in everywhere])
    order = along_beam(positions)
    return FacePoints(
        np.concatenate([part.nodes for part in everywhere])[order],
        np.concatenate([part.values for part in everywhere])[order],
        np.concatenate([part.weights for part in everywhere])[order],
        positions[order],
    )


def along_beam(positions: Array) -> Indices:
    """Return the order by x, then y, then z, insensitive to round-off."""
    span = float(np.ptp(positions[:, 0])) if len(positions) else 1.0
    rounded = np.round(positions / max(span, 1e-300) * 1e7)
    return np.asarray(np.lexsort((rounded[:, 2], rounded[:, 1], rounded[:, 0])), dtype=np.int64)


def _projected(tangents: Array) -> Array:
    """Return the length (2D) or area (3D) that tangents (t, q, 3) span, projected on the bending axis."""
    if len(tangents) == 1:
        return np.asarray(np.abs(tangents[0, :, 0]))
    first, second = tangents
    return np.asarray(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]))


def _rules(space: Any, degree: int) -> list[_Rule]:
    """Return one rule for each facet of the reference cell."""
    mesh = space.mesh
    dimension = mesh.topology.dim
    cell_type = getattr(basix.CellType, mesh.topology.cell_name())
    element = _lagrange(cell_type, space.element.basix_element.degree)
    geometry = _lagrange(cell_type, geometry_order(mesh))
    rules = []
    for facet in basix.topology(cell_type)[dimension - 1]:
        corners = basix.geometry(cell_type)[facet]
        points, factors = basix.make_quadrature(_FACETS[dimension, len(corners)], degree)
        tangents = corners[1:dimension] - corners[0]
        on_cell = corners[0] + points @ tangents
        shape = geometry.tabulate(1, on_cell)[:, :, :, 0]
        slopes = np.einsum("td,dqc->tqc", tangents, shape[1:])
        rules.append(_Rule(element.tabulate(0, on_cell)[0, :, :, 0], shape[0], slopes, factors))
    return rules


_FACETS = {
    (2, 2): basix.CellType.interval,
    (3, 3): basix.CellType.triangle,
    (3, 4): basix.CellType.quadrilateral,
}


def _lagrange(cell_type: Any, degree: int) -> Any:
    variant = basix.LagrangeVariant.gll_warped
    return basix.create_element(basix.ElementFamily.P, cell_type, degree, variant, dtype=np.float64)
