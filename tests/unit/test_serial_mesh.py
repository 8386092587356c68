"""Meshes of arrays agree with those of DOLFINx: contact points, surface, gradients, figures, mass of rigid bodies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import basix
import numpy as np
import pytest
from mpi4py import MPI

from gapbeam.meshes.mesh_readings import vector_space
from gapbeam.meshes.reference_cells import PRODUCTS, SIMPLICES, LagrangeCell, facets, nodal_rule, quadrature
from gapbeam.solver.assembly.contact_assembly import contact_operator
from gapbeam.solver.assembly.face_quadrature import CornerGradients, body_points
from gapbeam.solver.assembly.surface_rows import SurfaceRows, rows_at, surface_rows
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.models.beam_body import RigidPart
from gapbeam.solver.models.bending_stiffness import rigid_motions
from gapbeam.solver.models.body import MeshedBeam, mesh_beam, point_rule
from gapbeam.solver.models.solid_body import finite_elements
from gapbeam.solver.system.operators import Array
from tests.shared.mesh_figures import described

pytestmark = pytest.mark.versions

CASES = Path(__file__).parents[2] / "cases"
COARSE = ["mesh.size=0.05", "mesh.support_size=0.02"]
SHAPES = {
    "slice": ("demo", []),
    "slice of degree 1": ("demo", ["mesh.degree=1"]),
    "solid": ("demo", ["mesh.dimension=3", 'mesh.cell="hexahedron"', *COARSE]),
    "curved solid": (
        "demo",
        [
            "mesh.dimension=3",
            'mesh.cell="hexahedron"',
            *COARSE,
            "mesh.cells_through_thickness=4",
            'beam.section={type="round"}',
            "beam.width=0.012",
        ],
    ),
}


@pytest.fixture(params=SHAPES)
def pair(request: pytest.FixtureRequest) -> tuple[Case, MeshedBeam, MeshedBeam]:
    """Return a case, its mesh of arrays and that of DOLFINx."""
    name, overrides = SHAPES[request.param]
    rigid, full = (
        read_case(CASES / f"{name}.toml", [*overrides, f'model={{type="{kind}"}}']) for kind in ("rigid", "full")
    )
    return full, mesh_beam(rigid, MPI.COMM_SELF), mesh_beam(full, MPI.COMM_SELF)


def field_on(space: Any) -> Array:
    """Return a motion that no shape function follows, at the nodes of a space."""
    places, dimension = space.tabulate_dof_coordinates(), space.mesh.geometry.dim
    waves = [np.sin(30.0 * places @ [1.0, 2.0 + axis, 3.0]) + places[:, 0] ** 3 for axis in range(dimension)]
    return np.stack(waves, axis=1).reshape(-1)


def on_surface(found: SurfaceRows, field: Array) -> list[Array]:
    moved = np.zeros(found.interface.size)
    moved[found.interface.slots] = field[found.interface.owned]
    return [found.places, found.cell_middles, found.displacement @ moved, found.gradient @ moved]


def test_readings_agree_with_dolfinx(pair: tuple[Case, MeshedBeam, MeshedBeam]) -> None:
    case, *meshes = pair
    rule, faces = point_rule(case), case.layout.faces
    readings = []
    for meshed in meshes:
        space, field = meshed.space, field_on(meshed.space)
        contact = contact_operator(space, meshed.faces, faces, meshed.width, rule)
        surface = surface_rows(space, np.concatenate(list(meshed.faces.values())))
        inside = [("probe", np.array([0.37, 0.0, 0.0])), ("other", np.array([0.111, 0.0, 0.0]))]
        points, owners = body_points(space, inside)
        linear = vector_space(space.mesh, 1)
        corners = np.lexsort(np.round(linear.tabulate_dof_coordinates() / 1e-9).T)
        gradients = CornerGradients.of_spaces(space, linear).mean(field)
        means = on_surface(rows_at(space, points), field)[2:]
        shares = [part.reshape(len(owners), -1) / np.bincount(owners)[owners, None] for part in means]
        sums = [np.stack([part[owners == one].sum(axis=0) for one in (0, 1)]) for part in shares]
        readings.append(
            [contact.positions, contact.weights, contact.initial_gap, *on_surface(surface, field), *sums,
             np.array([meshed.facet_length, *vars(meshed.section).values()]), gradients[corners]]
        )  # fmt: skip
    for found, expected in zip(*readings, strict=True):
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-10 * np.abs(expected).max())
    figures = [described(meshed.tagged) for meshed in meshes]
    assert figures[0].keys() == figures[1].keys()
    for name, value in figures[1].items():
        assert figures[0][name] == (pytest.approx(value) if not isinstance(value, str) else value), name


def test_mass_of_rigid_bodies_is_that_of_finite_elements(pair: tuple[Case, MeshedBeam, MeshedBeam]) -> None:
    case, arrays, meshed = pair
    part = RigidPart.of_case(case, arrays)
    moves = np.array(list(part.rigid_motions().values()))
    found = moves @ part.mass @ moves.T
    body = finite_elements(case, meshed)
    motions = rigid_motions(meshed.space)
    expected = (body.rigid @ motions.T)[np.ix_(*[np.flatnonzero(np.abs(motions).max(axis=1))] * 2)]
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("cell", [*PRODUCTS, *SIMPLICES])
def test_reference_cells_are_those_of_basix(cell: str) -> None:
    kind = getattr(basix.CellType, cell)
    dimension = len(basix.topology(kind)) - 1
    points = np.random.default_rng(1).random((5, dimension))
    for degree in (1, 2):
        element = basix.create_element(basix.ElementFamily.P, kind, degree, basix.LagrangeVariant.gll_warped)
        shapes, table = LagrangeCell(cell, degree), element.tabulate(1, points)[..., 0]
        values, slopes = shapes.tabulate(points)
        assert shapes.places == pytest.approx(element.points)
        assert values == pytest.approx(table[0], abs=1e-14)
        assert slopes == pytest.approx(table[1:], abs=1e-14)
        if cell in PRODUCTS:
            rule = basix.make_quadrature(kind, 2 * degree - 1, basix.QuadratureType.gll)
            assert all(np.allclose(*both, atol=1e-15) for both in zip(nodal_rule(cell, degree), rule, strict=True))
    if dimension > 1:
        assert list(map(list, facets(cell))) == [list(one) for one in basix.topology(kind)[dimension - 1]]
    for degree in range(1, 11):
        both = zip(quadrature(cell, degree), basix.make_quadrature(kind, degree), strict=True)
        assert all(found == pytest.approx(expected, abs=1e-14) for found, expected in both)


def test_watched_points_lie_farthest_from_the_axis_however_many_facets_there_are() -> None:
    """Against the circle: most facets of a long tube are passed by, none in eight directions at its ends is."""
    keys = [
        'beam.section={type="tube",wall=0.001}',
        "beam.width=0.012",
        'mesh.cell="hexahedron"',
        'model={type="rigid"}',
    ]
    meshed = mesh_beam(read_case(CASES / "demo.toml", ["mesh.dimension=3", *keys, *COARSE]), MPI.COMM_SELF)
    found = surface_rows(meshed.space, np.concatenate(list(meshed.faces.values())))
    places, angles = found.places[found.on_faces :], np.pi / 4.0 * np.arange(8)
    for at_end in (places[:, 0] < 0.02, places[:, 0] > 0.46):
        far = places[at_end, 1:] @ np.array([np.cos(angles), np.sin(angles)])
        assert far.max(axis=0) == pytest.approx(0.006, rel=0.05)
