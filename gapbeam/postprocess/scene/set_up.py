"""What a picture of a set-up shows: mesh, supports, loads, probes, and cross-sections, as plain figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from meshio import CellBlock

from gapbeam.postprocess.results.supports_of_run import RunSupport


@dataclass(frozen=True)
class LoadArrow:
    """A load in a picture.

    Attributes:
        words: Name and size.
        point: Where it acts, m, in the frame of the case; None: not at a point.
        direction: Unit vector, (3,), y or z being the bending direction.
        sways: Whether it acts both ways.
        support: The support whose walls it moves; None: no single one.
    """

    words: str
    point: tuple[float, float, float] | None
    direction: tuple[float, float, float]
    sways: bool = True
    support: str | None = None


@dataclass(frozen=True)
class SectionMask:
    """Which points of a plane across the beam are in its material.

    Attributes:
        across: Grid along y, (k,), m.
        up: Grid along the bending direction, (l,), m.
        inside: 1 in the material, 0 outside, (l, k).
    """

    across: np.ndarray
    up: np.ndarray
    inside: np.ndarray


@dataclass(frozen=True)
class SetUp:
    """A case before anything runs.

    Attributes:
        title: Of the case.
        points: Of the mesh, (points, 3), m.
        cells: Their corners, by type of cell.
        supports: Along the beam.
        regions: The types of their regions, by name.
        sections: The beam in each support, by its name; none where it is not known.
        loads: The loads.
        probes: Points by name, m, in the frame of the case.
        case: The case as tables: its joints, masses and fluids are read.
    """

    title: str
    points: np.ndarray
    cells: list[CellBlock]
    supports: tuple[RunSupport, ...]
    regions: Mapping[str, str]
    sections: Mapping[str, SectionMask]
    loads: tuple[LoadArrow, ...]
    probes: Mapping[str, tuple[float, float, float]]
    case: Mapping[str, Any]

    @cached_property
    def dimension(self) -> int:
        """2 for cells of a plane, 3 for those of a solid."""
        return 3 if any(block.type in ("tetra", "tetrahedron", "hexahedron") for block in self.cells) else 2

    @cached_property
    def cell_count(self) -> int:
        """Cells of the mesh."""
        return sum(len(block.data) for block in self.cells)
