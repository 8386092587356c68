"""Stiffness of cells by products of matrices, against the form of the textbook as DOLFINx compiles and assembles it."""

from __future__ import annotations

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI

from gapbeam.solver.assembly.elasticity import CellStiffness
from tests.shared.forms import compiled_form

pytestmark = pytest.mark.versions

PLANE, SOLID = ("triangle", "quadrilateral"), ("tetrahedron", "hexahedron")
WIDTH = 0.3


def curved(cell, order):
    """A mesh of cells of an order, bent so that cells of order 2 have curved sides."""
    kind = getattr(mesh.CellType, cell)
    if cell in PLANE:
        straight = mesh.create_rectangle(MPI.COMM_SELF, [(0.0, 0.0), (3.0, 1.0)], (3, 2), kind)
    else:
        straight = mesh.create_box(MPI.COMM_SELF, [(0.0, 0.0, 0.0), (3.0, 1.0, 1.0)], (3, 1, 2), kind)
    dimension = straight.geometry.dim
    shape = basix.ufl.element("Lagrange", straight.basix_cell(), order, shape=(dimension,))
    places = fem.functionspace(straight, shape)
    cells = straight.topology.index_map(straight.topology.dim).size_local
    x = places.tabulate_dof_coordinates()[:, :dimension].copy()
    x[:, 1] += 0.1 * x[:, 0] ** 2
    listed = places.dofmap.list[:cells].astype(np.int64)
    return mesh.create_mesh(comm=MPI.COMM_SELF, cells=listed, x=x, e=shape)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    ("cell", "degree"),
    [*((cell, degree) for cell in PLANE for degree in (1, 2)), *((c, d) for c in SOLID for d in (1, 2))],
)
def test_matrix_of_the_textbook_form(cell: str, degree: int, order: int) -> None:
    """On every cell, straight and curved, with moduli that change from cell to cell, but for round-off."""
    domain = curved(cell, order)
    dimension = domain.geometry.dim
    space = fem.functionspace(domain, basix.ufl.element("Lagrange", domain.basix_cell(), degree, shape=(dimension,)))
    count = domain.topology.index_map(dimension).size_local
    moduli = [fem.Function(fem.functionspace(domain, ("DG", 0))) for _ in range(2)]
    random = np.random.default_rng(1)
    for modulus in moduli:
        modulus.x.array[:] = random.uniform(1.0, 3.0, count)
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    strain, virtual = ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))
    stress = moduli[0] * ufl.tr(strain) * ufl.Identity(dimension) + 2.0 * moduli[1] * strain
    form = compiled_form(fem.Constant(domain, WIDTH) * ufl.inner(stress, virtual) * ufl.dx)
    expected = fem_petsc.assemble_matrix(form)
    expected.assemble()
    found = fem_petsc.create_matrix(form)
    CellStiffness(space, *(modulus.x.array for modulus in moduli), WIDTH).add_to(found)
    found.axpy(-1.0, expected)
    assert found.norm() < 1e-13 * expected.norm()


def test_symmetric_to_the_last_bit() -> None:
    """Whatever order sums are taken in."""
    domain = curved("hexahedron", 2)
    space = fem.functionspace(domain, basix.ufl.element("Lagrange", domain.basix_cell(), 2, shape=(3,)))
    cells = np.arange(domain.topology.index_map(3).size_local)
    blocks = CellStiffness(space, np.full(len(cells), 3.0), np.full(len(cells), 2.0), 1.0).of_cells(cells)
    assert np.array_equal(blocks, blocks.transpose(0, 2, 1))
