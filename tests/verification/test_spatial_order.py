"""Orders of the discretization in space by manufactured solutions.

A smooth displacement w is chosen; body force and face tractions follow from it in Hooke's law written out here with
E and nu, not with the solver's own. The solution of (M + K + restraint) u = f then tends to w with order degree + 1.
"""

from __future__ import annotations

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import cg

from gapbeam.meshes.versions.mesh_geometry import cell_matrix
from gapbeam.solver.assembly.elasticity import elastic_parts
from gapbeam.solver.case.beam_profile import Beam, BeamProfile, Material
from tests.shared.forms import compiled_form

pytestmark = pytest.mark.versions

STEEL = Material(young_modulus=2.0, poisson_ratio=0.3, density=3.0)
PROFILE = BeamProfile.of(Beam(length=1.0, thickness=1.0, width=0.7), STEEL, ())
WIDTH, RESTRAINT = 0.7, (0.9, 0.4)


def hooke(w, plane_stress):
    """Stress of a displacement: the textbook matrices of plane stress, plane strain and the solid."""
    E, nu = STEEL.young_modulus, STEEL.poisson_ratio
    strain = ufl.sym(ufl.grad(w))
    identity, trace = ufl.Identity(len(w)), ufl.tr(strain)
    if plane_stress:
        return E / (1.0 - nu**2) * ((1.0 - nu) * strain + nu * trace * identity)
    return E / (1.0 + nu) * (strain + nu / (1.0 - 2.0 * nu) * trace * identity)


def chosen(x, dimension, functions):
    """Components of a displacement that is not a polynomial and has no symmetry, in UFL or NumPy."""
    sin, cos, exp = functions.sin, functions.cos, functions.exp
    if dimension == 2:
        return [sin(1.3 * x[0] + 0.4) * exp(0.7 * x[1]), cos(1.1 * x[0] - 1.7 * x[1])]
    return [
        sin(1.3 * x[0] + 0.4) * exp(0.7 * x[1] - 0.5 * x[2]),
        cos(1.1 * x[0] - 1.7 * x[1] + 0.6 * x[2]),
        sin(0.8 * x[0] + 0.9 * x[1]) * cos(1.5 * x[2]),
    ]


def grid(cell, cells):
    """A unit square or cube."""
    if cell in ("triangle", "quadrilateral"):
        return mesh.create_unit_square(MPI.COMM_SELF, cells, cells, getattr(mesh.CellType, cell))
    return mesh.create_unit_cube(MPI.COMM_SELF, cells, cells, cells, getattr(mesh.CellType, cell))


def error_of(cell, degree, plane_stress, cells):
    """The error in L2: w given at x = 0 and 1, tractions elsewhere, the restraint at the lowest and highest faces."""
    domain = grid(cell, cells)
    dimension = domain.geometry.dim
    facets = domain.topology.dim - 1
    space = fem.functionspace(domain, basix.ufl.element("Lagrange", domain.basix_cell(), degree, shape=(dimension,)))
    held = mesh.locate_entities_boundary(domain, facets, lambda x: np.isclose(x[0], 0.0) | np.isclose(x[0], 1.0))
    faces = mesh.locate_entities_boundary(
        domain, facets, lambda x: np.isclose(x[dimension - 1], 0.0) | np.isclose(x[dimension - 1], 1.0)
    )
    tags = mesh.meshtags(domain, facets, np.sort(faces), np.full(len(faces), 1, dtype=np.int32))
    measure = ufl.Measure("ds", domain=domain, subdomain_data=tags)
    parts = elastic_parts(space, PROFILE, plane_stress, WIDTH, RESTRAINT, np.sort(faces))
    test, normal = ufl.TestFunction(space), ufl.FacetNormal(domain)
    w = ufl.as_vector(chosen(ufl.SpatialCoordinate(domain), dimension, ufl))
    stress = hooke(w, plane_stress and dimension == 2)
    tangential = ufl.as_vector([*(k * w[i] for i, k in enumerate(RESTRAINT[: dimension - 1])), 0.0 * w[0]])
    body = STEEL.density * w - ufl.div(stress)
    work = ufl.inner(body, test) * ufl.dx + ufl.inner(stress * normal, test) * measure
    work = WIDTH * (work + ufl.inner(tangential, test) * measure(1))
    assembled = cell_matrix(space)
    for part in (parts.mass, parts.restraint, parts.stiffness):
        part.add_to(assembled)
    starts, columns, entries = assembled.getValuesCSR()
    matrix = csr_matrix((entries, columns, starts), assembled.getSize())
    right_side = fem.assemble_vector(compiled_form(work)).array
    solution = fem.Function(space)
    solution.interpolate(lambda x: np.array(chosen(x, dimension, np)))
    nodes = fem.locate_dofs_topological(space, facets, held)
    free = np.setdiff1d(np.arange(matrix.shape[0]), nodes[:, None] * dimension + np.arange(dimension))
    values = solution.x.array
    values[free] = 0.0
    scale = diags(1.0 / matrix.diagonal()[free])
    found, failed = cg(matrix[free][:, free], (right_side - matrix @ values)[free], rtol=1e-11, maxiter=4000, M=scale)
    assert not failed
    values[free] = found
    difference = solution - w
    square = compiled_form(ufl.inner(difference, difference) * ufl.dx(metadata={"quadrature_degree": 2 * degree + 3}))
    return np.sqrt(fem.assemble_scalar(square))


CELLS = {(2, 1): (8, 16, 32), (2, 2): (4, 8, 16), (3, 1): (8, 16, 24), (3, 2): (2, 4, 8)}
"""Cells per side by dimension and degree."""


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(
    ("cell", "plane_stress"),
    [
        ("quadrilateral", True),
        ("quadrilateral", False),
        ("triangle", True),
        ("triangle", False),
        ("hexahedron", True),
        ("tetrahedron", True),
    ],
)
def test_order_in_space(cell: str, plane_stress: bool, degree: int) -> None:
    """The error in L2 falls with order degree + 1 within 0.15 between all levels of cells."""
    sides = np.array(CELLS[2 if cell in ("triangle", "quadrilateral") else 3, degree])
    errors = [error_of(cell, degree, plane_stress, int(cells)) for cells in sides]
    orders = np.diff(np.log(errors)) / np.diff(np.log(1.0 / sides))
    assert orders == pytest.approx(degree + 1.0, abs=0.15)
