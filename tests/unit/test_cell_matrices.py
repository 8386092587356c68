"""Mass, stiffness and restraint, cell by cell, against the forms of UFL that FFCx compiles."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI

from benchmarks.textbook import stress
from gapbeam.meshes.versions.mesh_geometry import cell_matrix
from gapbeam.solver.assembly.elasticity import elastic_parts
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.models.body import mesh_beam
from tests.shared.command import PROJECT
from tests.shared.forms import compiled_form

pytestmark = pytest.mark.versions

RESTRAINT = 3.0e9, 2.0e9
MESHES = {
    "quadrilaterals": ("demo", ["mesh.degree=2"]),
    "triangles": ("demo", ["mesh.cell=triangle", "mesh.degree=1"]),
    "hexahedra": ("li2013", ["mesh.degree=1"]),
    "tetrahedra": ("li2013", ["mesh.cell=tetrahedron", "mesh.degree=1"]),
    "curved hexahedra": ("tube-holes", ["mesh.degree=2", "model.type=full", "mesh.size=0.05"]),
    "notched section": ("dovetail-slide", ["mesh.degree=1"]),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow(minutes=0.3) if "curved" in name else ()) for name in MESHES]
)
def test_parts_are_those_of_ufl(name: str) -> None:
    """Each of the three matrices agrees with its form to round-off, relative, in the Frobenius norm."""
    stem, overrides = MESHES[name]
    case = read_case(PROJECT / "cases" / f"{stem}.toml", overrides)
    meshed = mesh_beam(case, MPI.COMM_WORLD)
    space, material = meshed.space, case.material
    plane, dimension = case.mesh.plane == "stress", case.mesh.dimension
    facets = np.concatenate(list(meshed.faces.values()))
    parts = elastic_parts(space, case.profile, plane, meshed.width, RESTRAINT, facets)
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    faces = ufl.Measure("ds", domain=space.mesh, subdomain_data=meshed.tagged.facets)
    along = sum(k * u[axis] * v[axis] for axis, k in enumerate(RESTRAINT[: dimension - 1]))
    tags = tuple(meshed.tagged.groups[face] for face in meshed.faces)
    for part, form in (
        (parts.mass, material.density * ufl.inner(u, v) * ufl.dx),
        (parts.stiffness, ufl.inner(stress(u, material, plane and dimension == 2), ufl.sym(ufl.grad(v))) * ufl.dx),
        (parts.restraint, along * faces(tags)),
    ):
        expected = fem_petsc.assemble_matrix(compiled_form(meshed.width * form))
        expected.assemble()
        found = cell_matrix(space)
        part.add_to(found)
        norm = expected.norm()
        expected.axpy(-1.0, found)
        assert expected.norm() < 1e-13 * norm
        assert found.isSymmetric(1e-13 * norm)
