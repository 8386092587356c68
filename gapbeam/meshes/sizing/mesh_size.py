"""How fine the mesh of a beam is: what the user may choose, and what follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_patches import CELLS_THROUGH
from gapbeam.meshes.sizing.cell_length import CellLength
from gapbeam.meshes.sizing.layers import Positions, structured_partition

Cell = Literal["triangle", "quadrilateral", "tetrahedron", "hexahedron"]

CELLS: dict[int, tuple[Cell, Cell]] = {2: ("quadrilateral", "triangle"), 3: ("hexahedron", "tetrahedron")}
"""The cell types of each dimension, the default first."""

UNSTRUCTURED_THROUGH = 2
"""Triangles and tetrahedra are never longer than the thickness divided by this, unless asked for."""


@dataclass(frozen=True)
class BeamSizing:
    """Cell type and cell sizes, in m; None stands for the default.

    Attributes:
        cell: quadrilateral (default) or triangle in 2D, hexahedron (default) or tetrahedron in 3D.
        size: cell length along x far from the support; default the thickness there, and a third of the smaller one
            where the cross-section changes.
        support_size: the same within the support; default a third of the thickness, at most `size`.
        edge_size: the same where supports begin and end; default half of the smaller of the two
            above, never larger than these.
        cells_through_thickness: default 4 layers of quadrilaterals or hexahedra. Triangles and tetrahedra
            follow the length along x, but are no longer than the thickness divided by this number, default 2.
        cells_across_width: the same across the width; no limit by default for tetrahedra.
    """

    cell: Cell | None = None
    size: float | None = None
    support_size: float | None = None
    edge_size: float | None = None
    cells_through_thickness: int | None = None
    cells_across_width: int | None = None

    def cell_of(self, dimension: int) -> Cell:
        """The cell type, the default of the dimension when none was chosen."""
        cell = CELLS[dimension][0] if self.cell is None else self.cell
        if cell not in CELLS[dimension]:
            raise MeshError(
                "mesh.cell",
                found=f"{cell} in a mesh of dimension {dimension}",
                expected=" or ".join(CELLS[dimension]),
            )
        return cell

    def cell_length(self, geometry: BeamGeometry) -> CellLength:
        """Wanted cell length along the beam.

        Raises:
            MeshError: a size is not a positive number.
        """
        regions, at_edges = list[tuple[float, float]](), dict[float, float]()
        for start, end, supported in geometry.parts:
            size, support_size, edge_size = self._lengths(geometry, geometry.at(0.5 * (start + end)).thickness)
            regions.append((end, support_size if supported else size))
            for place in {start, end} & {*geometry.span_ends}:
                at_edges[place] = min(edge_size, at_edges.get(place, edge_size))
            if self.size is None:
                for place in {start, end} & {*geometry.shoulders}:
                    at_edges[place] = min(support_size, at_edges.get(place, support_size))
        return CellLength(tuple(regions), tuple(sorted(at_edges.items())))

    def _lengths(self, geometry: BeamGeometry, thickness: float) -> tuple[float, float, float]:
        """Cell lengths far from supports, within them and where they begin and end, for a thickness of the beam."""
        size = self._length("size", self.size, thickness)
        support_size = self._length("support_size", self.support_size, min(thickness / 3, size))
        edge_size = self._length("edge_size", self.edge_size, min(support_size, size) / 2)
        longest = self._longest(geometry, thickness)
        size, support_size = min(size, longest), min(support_size, longest)
        return size, support_size, min(edge_size, support_size, size)

    def layers_along(self, geometry: BeamGeometry) -> Positions:
        """Boundaries of structured layers along the beam, in m; errors as in `cell_length`."""
        return structured_partition(geometry.breakpoints(0), self.cell_length(geometry))

    def layers(self, geometry: BeamGeometry) -> tuple[int, ...]:
        """Number of structured cells in the directions after x: (thickness) or (width, thickness)."""
        through = self._count("cells_through_thickness", self.cells_through_thickness)
        if geometry.dimension == 2:
            return (through,)
        return (self._count("cells_across_width", self.cells_across_width), through)

    def _longest(self, geometry: BeamGeometry, thickness: float) -> float:
        """The limit that the section sets to the length of triangles and tetrahedra."""
        if self.cell_of(geometry.dimension) not in ("triangle", "tetrahedron"):
            return math.inf
        through = self.cells_through_thickness or UNSTRUCTURED_THROUGH
        longest = thickness / through
        if geometry.dimension == 3 and self.cells_across_width is not None:
            longest = min(longest, geometry.width / self.cells_across_width)
        return longest

    @staticmethod
    def _length(name: str, value: float | None, default: float) -> float:
        if value is None:
            return default
        if not (math.isfinite(value) and value > 0):
            raise MeshError(f"mesh.{name}", found=f"{value}", expected="a positive length in m")
        return value

    @staticmethod
    def _count(name: str, value: int | None) -> int:
        if value is None:
            return CELLS_THROUGH
        if value < 1:
            raise MeshError(f"mesh.{name}", found=f"{value}", expected="1 or more")
        return value
