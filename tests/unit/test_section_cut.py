"""Cross-sections cut through the cells of a mesh: integrals by hand on drawn places, cells and shapes of cells."""

from __future__ import annotations

from typing import Any

import basix.ufl
import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import CellType, create_box, create_rectangle
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI

from gapbeam.solver.assembly.section_cut import SectionCutter
from gapbeam.solver.messages.errors import UserError

pytestmark = pytest.mark.versions

LENGTH, WIDE, HIGH = 1.0, 0.3, 0.2  # m
SLICES = (CellType.triangle, CellType.quadrilateral)
SOLIDS = (CellType.tetrahedron, CellType.hexahedron)
INSIDE = st.floats(0.0, 1.0)


def space_of(cell: CellType, cells: int, degree: int) -> Any:
    """Return a vector space on a prism about the axis."""
    if cell in SLICES:
        mesh = create_rectangle(MPI.COMM_SELF, [[0.0, -HIGH / 2], [LENGTH, HIGH / 2]], [3 * cells, cells], cell)
    else:
        ends = [[0.0, -WIDE / 2, -HIGH / 2], [LENGTH, WIDE / 2, HIGH / 2]]
        mesh = create_box(MPI.COMM_SELF, ends, [3 * cells, cells, cells], cell)
    dimension = mesh.geometry.dim
    return fem.functionspace(mesh, basix.ufl.element("Lagrange", mesh.basix_cell(), degree, shape=(dimension,)))


def integral(space: Any, x: float, field: Any) -> np.ndarray:
    """Return int f s dA of a field over a section."""
    cut = SectionCutter(space).cut(x, "here")
    values = field(*space.tabulate_dof_coordinates().T)
    return np.asarray(values[cut.nodes] @ cut.integrals)


@pytest.mark.parametrize("cell", [*SLICES, *SOLIDS])
@pytest.mark.parametrize("degree", [1, 2])
@given(x=st.one_of(INSIDE, st.sampled_from([0.0, 1.0, 0.5, 1.0 / 3.0])), skew=st.floats(-0.5, 0.5))
@settings(max_examples=6, deadline=None)
def test_integrals_are_those_by_hand(cell: CellType, degree: int, x: float, skew: float) -> None:
    """Area, moments, and fields of the degree of the elements, wherever the plane cuts, in skewed cells, too."""
    space = space_of(cell, 2, degree)
    nodes = space.mesh.geometry.x
    # cells lean but for those at the ends
    nodes[:, 0] += (
        skew * 0.5 * nodes[:, space.mesh.geometry.dim - 1] * 16.0 * nodes[:, 0] ** 2 * (1.0 - nodes[:, 0]) ** 2
    )
    wide = 1.0 if cell in SLICES else WIDE
    cut = SectionCutter(space).cut(x, "here")
    straight = cell in (CellType.triangle, CellType.tetrahedron) or skew == 0.0
    second = wide * HIGH**3 / 12.0
    assert cut.moments[0, 0] == pytest.approx(wide * HIGH, rel=1e-12)
    assert cut.moments[-1, -1] == pytest.approx(second, rel=1e-12)
    if cell in SOLIDS:
        assert cut.moments[1, 1] == pytest.approx(HIGH * WIDE**3 / 12.0, rel=1e-12)
        assert cut.moments[1, 2] == pytest.approx(0.0, abs=1e-12 * second)
    assert np.sum(cut.integrals, axis=0) == pytest.approx(cut.moments[0], abs=1e-12 * wide * HIGH)
    if straight:
        linear = integral(space, x, lambda a, b, c: a + (c if cell in SOLIDS else b))
        assert linear[0] == pytest.approx(x * wide * HIGH, rel=1e-8, abs=1e-10 * wide * HIGH)
        assert linear[-1] == pytest.approx(second, rel=1e-8)
        if degree == 2:
            squares = integral(space, x, lambda a, b, c: (c if cell in SOLIDS else b) ** 2 - a**2)
            assert squares[0] == pytest.approx(second - x**2 * wide * HIGH, rel=1e-7, abs=1e-9 * wide * HIGH)


@pytest.mark.parametrize("cell", [*SLICES, *SOLIDS])
@pytest.mark.parametrize("x", [-0.1, 1.1, float("nan")])
def test_a_place_beside_the_mesh_is_refused(cell: CellType, x: float) -> None:
    """No cell is cut there."""
    with pytest.raises(UserError, match=r"here: the mesh has no cross-section at x = "):
        SectionCutter(space_of(cell, 1, 1)).cut(x, "here")
