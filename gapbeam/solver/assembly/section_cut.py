"""The plane of a cross-section cut through the cells of a mesh, and integrals over the cut.

The plane meets each cell in a polygon, in a slice in a line. Cells are divided into simplices in the reference cell,
where x is interpolated linearly, and each simplex is cut exactly. Gauss points on the pieces give

    int N_k s dA,    int s s^T dA,    s = (1, y, z), in a slice (1, z)

with the basis functions N_k. No number of points is chosen: finer cells have more of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product
from typing import Any

import numpy as np

from gapbeam.meshes import reference_cells
from gapbeam.meshes.mesh_readings import cell_shapes, displacement_shapes
from gapbeam.meshes.reference_cells import SIMPLICES
from gapbeam.meshes.tagged_mesh import determinant
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array, Indices

ON_PLANE = 1.0e-9  # of the length of the mesh: nodes this near to the plane lie on it
STRAIGHT = 1.0e-9  # of a cell's length along x: what x may differ from linear interpolation
FINER = 4  # parts of each side of a cell in which x is not linear


@dataclass(frozen=True)
class SectionCut:
    """Integrals over a cross-section, the same on all ranks.

    Attributes:
        nodes: Global nodes of the cells that are cut, (k,).
        integrals: int N_k s dA, (k, dimension), m^2 and m^3.
        moments: int s s^T dA, (dimension, dimension), m^2 to m^4.
    """

    nodes: Indices
    integrals: Array
    moments: Array


class SectionCutter:
    """Cuts cross-sections; made once for many of them."""

    def __init__(self, space: Any) -> None:
        """Gather the cells of this rank. Collective.

        Args:
            space: Blocked Lagrange space.
        """
        mesh = space.mesh
        dimension = mesh.topology.dim
        owned = mesh.topology.index_map(dimension).size_local
        self.space = space
        self.corners = mesh.geometry.x[coordinate_dofs(mesh)[:owned]][:, :, :dimension]
        self.basis, self.geometry = displacement_shapes(space), cell_shapes(mesh)
        x = mesh.geometry.x[:, 0]
        ends = [float(np.min(x, initial=np.inf)), -float(np.max(x, initial=-np.inf))]
        low, high = np.min(mesh.comm.allgather(ends), axis=0)
        self.tolerance = ON_PLANE * (-high - low)
        piece = "interval" if dimension == 2 else "triangle"
        # products of coordinates in the plane of a hexahedron; the area is a product of slopes of the geometry
        rule = dimension * self.basis.degree + 2 * self.geometry.degree
        self.places, self.factors = reference_cells.quadrature(piece, rule)
        self.lattices = {count: _lattice(self.basis.cell, count) for count in (1, FINER)}

    def cut(self, place: float, name: str) -> SectionCut:
        """Cut the cross-section at x = place: through the cells that begin there, or at the end those that end there.

        Args:
            place: m.
            name: Name of the section in errors.

        Raises:
            UserError: The mesh has no cells there; on all ranks.

        Collective.
        """
        comm = self.space.mesh.comm
        for ends in (False, True):
            nodes, integrals, moments = self._on_rank(place, ends)
            parts = comm.allgather((nodes, integrals, moments))
            total = np.sum([part[2] for part in parts], axis=0)
            if total[0, 0] > 0.0:
                break
        else:
            raise UserError(
                f"{name}: the mesh has no cross-section at x = {place:g} m; move the place along the beam into the "
                "body, or check that the mesh is in meters with x = 0 at the supported end"
            )
        found, slots = np.unique(np.concatenate([part[0] for part in parts]), return_inverse=True)
        summed = np.zeros((len(found), len(total)))
        np.add.at(summed, slots.reshape(-1), np.concatenate([part[1] for part in parts]))
        return SectionCut(found, summed, total)

    def _on_rank(self, place: float, ends: bool) -> tuple[Indices, Array, Array]:
        """Return the nodes and integrals of the cells of this rank."""
        comm, dimension = self.space.mesh.comm, self.corners.shape[-1]
        away = self._snapped(self.corners[:, :, 0] - place)
        met = away >= 0.0 if ends else away > 0.0  # nodes on the plane belong to the cell that is cut
        cells = np.flatnonzero(np.any(met, axis=1) & ~np.all(met, axis=1))
        lattice, simplices = self.lattices[FINER if any(comm.allgather(self._bent(away[cells]))) else 1]
        levels = self._snapped(away[cells] @ self.geometry.tabulate(lattice)[0].T)
        nodes, integrals = list[Indices](), list[Array]()
        moments = np.zeros((dimension, dimension))
        for owners, pieces in _pieces(lattice[simplices], levels[:, simplices], ends):
            sides = pieces[:, 1:] - pieces[:, :1]
            at = pieces[:, None, 0] + np.einsum("qs,psd->pqd", self.places, sides)
            shapes, turns = self.geometry.tabulate(at.reshape(-1, dimension))
            shapes, turns = shapes.reshape(*at.shape[:2], -1), turns.reshape(dimension, *at.shape[:2], -1)
            corners = self.corners[cells[owners]]
            across = np.einsum("pqc,pcx->pqx", shapes, corners[:, :, 1:])
            slopes = np.einsum("psd,dpqc,pcx->pqsx", sides, turns, corners[:, :, 1:], optimize=True)
            weights = self.factors * np.abs(determinant(slopes))
            fields = np.concatenate([np.ones((*at.shape[:2], 1)), across], axis=2)
            values = self.basis.tabulate(at.reshape(-1, dimension))[0].reshape(*at.shape[:2], -1)
            integrals.append(
                np.einsum("pq,pqk,pqs->pks", weights, values, fields, optimize=True).reshape(-1, dimension)
            )
            moments += np.einsum("pq,pqs,pqt->st", weights, fields, fields, optimize=True)
            here = self.space.dofmap.list[cells[owners]].reshape(-1).astype(np.int32)
            nodes.append(self.space.dofmap.index_map.local_to_global(here).astype(np.int64))
        if not nodes:
            return np.empty(0, dtype=np.int64), np.empty((0, dimension)), moments
        found, slots = np.unique(np.concatenate(nodes), return_inverse=True)
        summed = np.zeros((len(found), dimension))
        np.add.at(summed, slots.reshape(-1), np.concatenate(integrals))
        return found, summed, moments

    def _snapped(self, away: Array) -> Array:
        return np.where(np.abs(away) <= self.tolerance, 0.0, away)

    def _bent(self, away: Array) -> bool:
        """Return whether x is not linear on the simplices of a cell, whose corners come first."""
        fine, (corners, simplices) = self.lattices[FINER][0], self.lattices[1]
        at = self.geometry.tabulate(fine)[0]
        exact, linear = away @ at.T, np.empty((len(away), len(fine)))
        straight = away @ self.geometry.tabulate(corners)[0].T
        for simplex in simplices:
            edges = corners[simplex[1:]] - corners[simplex[0]]
            shares = np.linalg.solve(edges.T, (fine - corners[simplex[0]]).T).T
            inside = np.all(shares >= -STRAIGHT, axis=1) & (shares.sum(axis=1) <= 1.0 + STRAIGHT)
            base = straight[:, simplex[:1]]
            linear[:, inside] = base + (straight[:, simplex[1:]] - base) @ shares[inside].T
        return bool(np.any(np.abs(exact - linear) > STRAIGHT * np.ptp(away, axis=1)[:, None]))


def _lattice(cell: str, count: int) -> tuple[Array, Indices]:
    """Return points of a reference cell with so many parts a side, and the simplices between them (Kuhn's)."""
    dimension = reference_cells.corners(cell).shape[1]
    simplices = list[list[tuple[int, ...]]]()
    for base in product(range(count), repeat=dimension):
        for order in permutations(range(dimension)):
            corner, simplex = list(base), [base]
            for axis in order:
                corner[axis] += 1
                simplex.append(tuple(corner))
            simplices.append(simplex)
    if cell in SIMPLICES:  # those in 1 >= y_1 >= y_2 >= ..., which is mapped onto the reference simplex
        simplices = [one for one in simplices if all(list(place) == sorted(place, reverse=True) for place in one)]
    places = sorted({place for one in simplices for place in one})
    numbers = {place: number for number, place in enumerate(places)}
    points = np.array(places, dtype=float) / count
    if cell in SIMPLICES:
        points[:, :-1] -= points[:, 1:]
    return points, np.array([[numbers[place] for place in one] for one in simplices])


# the pieces of a simplex with its first corners below the plane, by their number: the edges that are cut
_CUTS = {
    2: {1: [(0, 1), (0, 2)], 2: [(0, 2), (1, 2)]},
    3: {
        1: [(0, 1), (0, 2), (0, 3)],
        2: [(0, 2), (0, 3), (1, 3), (0, 2), (1, 3), (1, 2)],
        3: [(0, 3), (1, 3), (2, 3)],
    },
}


def _pieces(corners: Array, levels: Array, ends: bool) -> Iterator[tuple[Indices, Array]]:
    """Yield the cells that are cut, (p,), and the pieces of the plane in them, (p, dimension, dimension).

    Args:
        corners: Corners of the simplices of the reference cell, (s, dimension + 1, dimension).
        levels: Distances beyond the plane, cell by cell, (cells, s, dimension + 1).
        ends: Whether a corner on the plane lies beyond it.
    """
    dimension = corners.shape[-1]
    beyond = levels >= 0.0 if ends else levels > 0.0
    below = dimension + 1 - beyond.sum(axis=2)
    for count, edges in _CUTS[dimension].items():
        cells, simplices = np.nonzero(below == count)
        if not len(cells):
            continue
        order = np.argsort(beyond[cells, simplices], axis=1, kind="stable")
        level = np.take_along_axis(levels[cells, simplices], order, axis=1)
        place = np.take_along_axis(corners[simplices], order[:, :, None], axis=1)
        first, second = np.array(edges).T
        share = level[:, first] / (level[:, first] - level[:, second])
        points = place[:, first] + share[:, :, None] * (place[:, second] - place[:, first])
        pieces = points.reshape(len(cells), -1, dimension, dimension)
        yield np.repeat(cells, pieces.shape[1]), pieces.reshape(-1, dimension, dimension)
