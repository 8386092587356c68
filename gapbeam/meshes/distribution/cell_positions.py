"""Positions of the cells of the current gmsh model, in the order in which DOLFINx reads them."""

from __future__ import annotations

import gmsh
import numpy as np
import numpy.typing as npt


def cell_centers(dimension: int) -> npt.NDArray[np.float64]:
    """Return the mean places of the corners of all cells in physical groups, (cells, 3), m."""
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
    nodes = [gmsh.model.mesh.getNodesForPhysicalGroup(dimension - 1, groups[name])[1] for name in names]
    return float(np.max(np.concatenate(nodes).reshape(-1, 3)[:, 0]))
