"""Places in meshes of any size: the cells that hold a point, of micrometers as of kilometers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from gapbeam.solver.assembly.section_rows import PointFinder
from gapbeam.solver.models.body import mesh_beam
from tests.shared.models import beam_case

pytestmark = pytest.mark.versions

SIZES = [1e-8, 1e-5, 1e-2, 1.0, 1e3]
CELLS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]


def finder(size: float, cell: str) -> PointFinder:
    """Return the finder of a beam of some cells whose thickness is `size`, m."""
    solid = {"cells_across_width": 2} if cell in CELLS[2:] else {}
    changes: dict[str, dict[str, Any]] = {
        "beam": {"length": 5.0 * size, "thickness": size, "width": size},
        "support": {"length": size, "clearance": 0.01 * size},
        "mesh": {
            "dimension": 3 if solid else 2, "cell": cell, "cells_through_thickness": 2, "size": size,
            "support_size": 0.5 * size, "edge_size": 0.5 * size, **solid,
        },
    }  # fmt: skip
    return PointFinder(mesh_beam(beam_case(changes), MPI.COMM_SELF).space)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("cell", CELLS)
def test_a_point_within_a_cell_is_in_no_other_cell(size: float, cell: str) -> None:
    """Neighbors that were taken to hold it gave their stress, too, beyond their sides."""
    found = finder(size, cell)
    dimension = found.space.mesh.geometry.dim
    points = np.zeros((30, 3))
    low = -0.5 * size * (np.arange(dimension) > 0)
    points[:, :dimension] = (
        low + np.random.default_rng(1).random((30, dimension)) * np.where(low < 0.0, 1.0, 5.0) * size
    )
    for point in points:
        assert len(list(found.cells_at(point))) == 1
        row = found.row(point, "point")
        assert row.values @ found.places[row.nodes] == pytest.approx(point, abs=1e-9 * size)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("cell", CELLS)
def test_single_precision_leaves_points_in_the_mesh(size: float, cell: str) -> None:
    """The far end, rounded to the digits that many files have, is held by as many cells as the end itself."""
    found = finder(size, cell)
    dimension = found.space.mesh.geometry.dim
    end = np.array([5.0 * size, *[0.1 * size] * (dimension - 1), *[0.0] * (3 - dimension)])
    rounded = end * np.array([1.0 + 6e-8, 1.0 - 6e-8, 1.0])
    assert len(list(found.cells_at(rounded))) == len(list(found.cells_at(end))) == 1
