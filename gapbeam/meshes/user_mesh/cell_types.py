"""The cells that a user's mesh may have, and the facets on the surface of the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Nodes = npt.NDArray[np.int64]


@dataclass(frozen=True)
class CellType:
    """gmsh's number of the facet type, and the corners of each facet."""

    facet: int
    corners: tuple[tuple[int, ...], ...]

    @property
    def corner_count(self) -> int:
        """Corners of a cell."""
        return 1 + max(max(corners) for corners in self.corners)


_TRIANGLE = ((0, 1), (1, 2), (2, 0))
_QUADRILATERAL = ((0, 1), (1, 2), (2, 3), (3, 0))
_TETRAHEDRON = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
_HEXAHEDRON = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

CELL_TYPES = {
    2: CellType(1, _TRIANGLE),
    9: CellType(8, _TRIANGLE),
    3: CellType(1, _QUADRILATERAL),
    10: CellType(8, _QUADRILATERAL),
    4: CellType(2, _TETRAHEDRON),
    11: CellType(9, _TETRAHEDRON),
    5: CellType(3, _HEXAHEDRON),
    12: CellType(10, _HEXAHEDRON),
}
"""gmsh's element types of order 1 and 2 with all their nodes: those that DOLFINx reads."""


@dataclass(frozen=True)
class Facets:
    """All facets of all cells, one row for each cell that has it.

    Attributes:
        cells: the cell of each row, (rows,).
        sides: which facet of its cell, (rows,).
        corners: nodes of its corners, sorted, (rows, corners).
        numbers: rows of the same facet have the same number, (rows,).
        owners: how many cells have the facet of each number, (facets,).
    """

    cells: Nodes
    sides: Nodes
    corners: Nodes
    numbers: Nodes
    owners: Nodes

    @classmethod
    def of(cls, cells: Nodes, cell_type: CellType) -> Facets:
        """Return the facets of cells, given by their nodes (cells, nodes)."""
        sides = len(cell_type.corners)
        corners = np.sort(np.concatenate([cells[:, list(side)] for side in cell_type.corners]), axis=1)
        _, numbers, owners = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
        return cls(
            cells=np.tile(np.arange(len(cells), dtype=np.int64), sides),
            sides=np.repeat(np.arange(sides, dtype=np.int64), len(cells)),
            corners=corners,
            numbers=np.asarray(numbers, dtype=np.int64).reshape(-1),
            owners=np.asarray(owners, dtype=np.int64),
        )

    @property
    def on_surface(self) -> Nodes:
        """Rows of the facets that belong to one cell only."""
        return np.flatnonzero(self.owners[self.numbers] == 1)
