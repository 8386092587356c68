"""Patches of cross-sections: areas, second moments, meshes, and the faces that supports touch."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

import gapbeam
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_readings import STRAIGHT, bulge, refuse_curved
from gapbeam.meshes.mesh_size import expected_cells, expected_nodes
from gapbeam.meshes.tagged_mesh import TaggedMesh, mean_section
from gapbeam.solver.assembly.case_mesh import geometry_of, mesh_of_case, sizing_of
from gapbeam.solver.assembly.section_rows import SectionRows, row_at
from gapbeam.solver.case.beam_profile import Beam
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.body import mesh_beam
from tests.shared.forms import compiled_form

pytestmark = pytest.mark.versions

HIGH, WIDE = 0.04, 0.03  # m
TUBE = {"type": "tube", "wall": 0.004}
BOX = {"type": "box", "wall": 0.004}
PROFILE = {"type": "i", "web": 0.006, "flange": 0.005}
DOVETAIL = {"type": "polygon", "points": [[0.0, 0.0], [0.03, 0.0], [0.022, 0.04], [0.008, 0.04]]}
HOLED = {
    "type": "polygon",
    "points": [[0.0, 0.0], [0.03, 0.0], [0.03, 0.03], [0.024, 0.04], [0.006, 0.04], [0.0, 0.03]],
    "holes": [[[0.01, 0.01], [0.02, 0.01], [0.015, 0.022]]],
}
TEE = {
    "type": "polygon",
    "points": [[0, 0.04], [0, 0.03], [0.01, 0.03], [0.01, 0], [0.02, 0], [0.02, 0.03], [0.03, 0.03], [0.03, 0.04]],
}
# a rectangle less two corner triangles 6 mm wide and 10 mm high and a hole 10 mm wide and 12 mm high, about the middle
_PARTS = (
    (0.0012, 0.0, 0.03 * 0.04**3 / 12.0),
    (-6.0e-5, 0.02 - 0.01 / 3.0, -2.0 * 0.006 * 0.01**3 / 36.0),
    (-6.0e-5, -0.006, -0.01 * 0.012**3 / 36.0),
)
_FIRST = sum(area * place for area, place, _ in _PARTS)
HOLED_SECOND = sum(own + area * place**2 for area, place, own in _PARTS) - _FIRST**2 / sum(
    area for area, _, _ in _PARTS
)
# section, width, area and second moment by hand, number of corners of its mesh
SECTIONS = {
    "tube": (TUBE, HIGH, pi * (0.020**2 - 0.016**2), pi / 4.0 * (0.020**4 - 0.016**4)),
    "round": ("round", HIGH, pi * 0.020**2, pi / 4.0 * 0.020**4),
    "box": (BOX, WIDE, 0.04 * 0.03 - 0.032 * 0.022, (0.03 * 0.04**3 - 0.022 * 0.032**3) / 12.0),
    "i": (PROFILE, WIDE, 2 * 0.03 * 0.005 + 0.03 * 0.006, (0.03 * 0.04**3 - 0.024 * 0.03**3) / 12.0),
    "trapezoid": (
        DOVETAIL,
        WIDE,
        0.5 * (0.03 + 0.014) * 0.04,
        0.04**3 / 36.0 * (0.03**2 + 4 * 0.03 * 0.014 + 0.014**2) / 0.044,
    ),
    "tee": (TEE, WIDE, 0.03 * 0.01 + 0.01 * 0.03, 0.03 * 0.01**3 / 12 + 0.01 * 0.03**3 / 12 + 2 * 3.0e-4 * 0.01**2),
    "holed": (HOLED, WIDE, 0.0012 - 6.0e-5 - 6.0e-5, HOLED_SECOND),
}
ALL = pytest.mark.parametrize("name", SECTIONS)


def case_of(name: str, **mesh: object) -> Case:
    """Return a case of a short beam with a section."""
    section, width, _, _ = SECTIONS[name]
    return gapbeam.read_case(
        {
            "beam": {"length": 0.2, "thickness": HIGH, "width": width, "section": section},
            "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
            "support": {"length": 0.05, "clearance": 1.0e-4},
            "mesh": {"dimension": 3, **mesh},
            "load": [{"type": "gravity"}],
            "time": {"end": 0.1, "step": 1.0e-4},
        }
    )


def meshed(case: Case) -> TaggedMesh:
    """Return the mesh of a case."""
    return mesh_of_case(case, MPI.COMM_SELF)


@ALL
def test_formulas_are_those_by_hand(name: str) -> None:
    """Area, second moment and what follows from them."""
    beam, (_, width, area, second) = case_of(name).beam, SECTIONS[name]
    assert (beam.area, beam.second_moment) == (pytest.approx(area, rel=1e-14), pytest.approx(second, rel=1e-14))
    assert beam.gyration_radius == pytest.approx((second / area) ** 0.5)
    narrower = {"trapezoid": 0.014, "tee": 0.01, "holed": 0.018}.get(name, width)  # of the sides that supports touch
    assert beam.height == pytest.approx(area / narrower)


@ALL
@pytest.mark.parametrize("cells", [2, 4, 6])
def test_meshes_fill_the_section(name: str, cells: int) -> None:
    """Volume and second moment of the mesh; those of round sections converge with the fourth power of the cells."""
    found = mean_section(meshed(case_of(name, cells_through_thickness=cells, cells_across_width=cells)), 1.0)
    _, _, area, second = SECTIONS[name]
    curved = name in ("tube", "round")
    assert found.area == pytest.approx(area, rel=0.02 / cells**4 if curved else 1e-12)
    assert found.second_moment == pytest.approx(second, rel=0.04 / cells**4 if curved else 1e-12)


@ALL
@pytest.mark.parametrize("cells", [1, 4])
def test_the_size_of_a_mesh_is_known_before(name: str, cells: int) -> None:
    """Cells exactly, and the nodes of both degrees."""
    case = case_of(name, cells_through_thickness=cells, cells_across_width=cells)
    geometry, sizing = geometry_of(case), sizing_of(case)
    tagged = meshed(case)
    assert expected_cells(geometry, sizing) == tagged.cell_count
    assert expected_nodes(geometry, sizing, 1) == tagged.vertex_count
    nodes = mesh_beam(case, MPI.COMM_SELF).space.dofmap.index_map.size_global
    assert expected_nodes(geometry, sizing, 2) == nodes


@ALL
def test_the_faces_of_a_support_look_at_it(name: str) -> None:
    """Base and gland are the lowest and highest surfaces, as wide as the beam, from x = 0 to the end of the support."""
    case = case_of(name)
    tagged = meshed(case)
    mesh = tagged.mesh
    for face, side in (("base", -1.0), ("gland", 1.0)):
        facets = tagged.facets_of(face)
        mesh.topology.create_connectivity(2, 0)
        corners = np.unique(np.concatenate([mesh.topology.connectivity(2, 0).links(facet) for facet in facets]))
        mesh.topology.create_connectivity(0, 3)
        x = mesh.geometry.x[np.unique(entities_to_geometry(mesh, 0, corners.astype(np.int32)))]
        assert (x[:, 0].min(), x[:, 0].max()) == (pytest.approx(0.0, abs=1e-12), pytest.approx(0.05))
        touched = {"trapezoid": (0.03, 0.014), "tee": (0.01, 0.03), "holed": (0.03, 0.018)}.get(
            name, 2 * (case.beam.width,)
        )
        wide = touched[int(side > 0.0)]
        assert (x[:, 1].min(), x[:, 1].max()) == (pytest.approx(-wide / 2), pytest.approx(wide / 2))
        curved = name in ("tube", "round")
        assert np.all(side * x[:, 2] >= -1e-9 if curved else np.isclose(x[:, 2], 0.5 * side * HIGH))


@ALL
@pytest.mark.parametrize("cells", [1, 4])
def test_a_point_on_the_axis_is_its_section(name: str, cells: int) -> None:
    """Forces over the section have the resultant of a force on the axis, also where the centroid lies elsewhere."""
    space = mesh_beam(case_of(name, cells_through_thickness=cells, cells_across_width=cells), MPI.COMM_SELF).space
    row = row_at(SectionRows(space), 0.123, "probe")
    places = space.tabulate_dof_coordinates()
    assert len(row.nodes) > 8
    size = 3 * len(places)
    for axis in range(3):
        unit = np.identity(3)[axis]
        force = row.force(unit, size).reshape(-1, 3)
        assert force.sum(axis=0) == pytest.approx(unit, abs=1e-12)
        assert np.cross(places, force).sum(axis=0) == pytest.approx(np.cross([0.123, 0.0, 0.0], unit), abs=1e-9)


def test_a_rectangle_is_what_it_was() -> None:
    """The section is left out of a case, or named: the same beam."""
    sizes = {"length": 0.2, "thickness": HIGH, "width": WIDE}
    assert Beam(**sizes) == Beam.model_validate({**sizes, "section": "rectangle"})
    assert Beam(**sizes).patches(4, 4) is None
    assert Beam(**sizes).shear_coefficient(0.3) == pytest.approx(13.0 / 15.3)


def test_linear_displacements_strain_curved_cells() -> None:
    """A rotation is a field of degree 1 on straight cells; on curved ones it is not, and degree 1 is refused."""
    tube, box = meshed(case_of("tube")).mesh, meshed(case_of("box")).mesh
    assert bulge(box) < STRAIGHT < 0.01 < bulge(tube)
    for mesh, degree in ((box, 1), (box, 2), (tube, 2)):
        refuse_curved(mesh, degree)
    with pytest.raises(MeshError, match=r"mesh\.degree: found 1, with curved cells of order 2 .* expected 2 or more"):
        refuse_curved(tube, 1)
    strains = []
    for mesh in (box, tube):
        turned = fem.Function(fem.functionspace(mesh, ("Lagrange", 1, (3,))))
        turned.interpolate(lambda x: np.array([0.0 * x[0], -x[2], x[1]]))
        strain = ufl.sym(ufl.grad(turned))
        square, volume = (
            fem.assemble_scalar(compiled_form(form))
            for form in (ufl.inner(strain, strain) * ufl.dx, 1.0 * ufl.dx(mesh))
        )
        strains.append(np.sqrt(square / volume))
    assert strains[0] < 1.0e-12
    assert strains[1] > 1.0e-2  # of a rotation by 1
