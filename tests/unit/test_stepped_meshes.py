"""Meshes of beams with steps: volume, surface, and faces of supports by hand; shared patches of their sections."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from dolfinx.mesh import entities_to_geometry, exterior_facet_indices
from mpi4py import MPI

import gapbeam
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_size import expected_cells, expected_nodes
from gapbeam.meshes.sections.section_patches import grid_patches, rectangle_patches, ring_patches, shared_patches
from gapbeam.meshes.tagged_mesh import TaggedMesh, mean_section
from gapbeam.solver.assembly.case_mesh import geometry_of, mesh_of_case, sizing_of
from gapbeam.solver.case.case import Case

pytestmark = pytest.mark.versions

TUBE = {"type": "tube", "wall": 0.002}
THICK = {"type": "tube", "wall": 0.005}
BOX = {"type": "box", "wall": 0.002}
PROFILE = {"type": "i", "web": 0.002, "flange": 0.003}


def stepped(dimension: int, section: Any, segment: dict[str, Any], **mesh: Any) -> Case:
    """Return a case of a beam of 12 mm that is another one between 0.1 and 0.2 m, with a support in each part."""
    places = {"near": (0.02, 0.05), "mid": (0.12, 0.16)}
    return gapbeam.read_case(
        {
            "beam": {"length": 0.3, "thickness": 0.012, "width": 0.012, "section": section},
            "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
            "segment": [{"name": "a", "from": 0.1, "to": 0.2, **segment}],
            "support": [
                {"name": name, "from": start, "to": end, "clearance": 1.0e-4} for name, (start, end) in places.items()
            ],
            "mesh": {"dimension": dimension, "size": 0.04, "support_size": 0.02, "edge_size": 0.02, **mesh},
            "load": [{"type": "gravity"}],
            "time": {"end": 0.01, "step": 1.0e-4},
        }
    )


# dimension, section, segment, and area of both sections by hand
STEPS: dict[str, tuple[int, Any, dict[str, Any], float, float]] = {
    "thicker slice": (2, "rectangle", {"thickness": 0.02}, 0.012 * 0.012, 0.02 * 0.012),
    "thinner slice": (2, "rectangle", {"thickness": 0.005}, 0.012 * 0.012, 0.005 * 0.012),
    "thick and wide": (3, "rectangle", {"thickness": 0.02, "width": 0.03}, 0.012**2, 0.02 * 0.03),
    "thick and narrow": (3, "rectangle", {"thickness": 0.02, "width": 0.006}, 0.012**2, 0.02 * 0.006),
    "box to rectangle": (3, BOX, {"section": "rectangle"}, 0.012**2 - 0.008**2, 0.012**2),
    "box to i": (3, BOX, {"section": PROFILE, "thickness": 0.02}, 0.012**2 - 0.008**2, 6 * 0.012e-3 + 0.014 * 0.002),
    "shaft": (3, "round", {"thickness": 0.02}, pi * 0.006**2, pi * 0.01**2),
    "shaft to tube": (3, "round", {"thickness": 0.02, "section": THICK}, pi * 0.006**2, pi * (0.01**2 - 0.005**2)),
    "tube to shaft": (3, TUBE, {"section": "round"}, pi * (0.006**2 - 0.004**2), pi * 0.006**2),
}
ALL = pytest.mark.parametrize("name", STEPS)


def meshed(name: str, **mesh: Any) -> tuple[Case, TaggedMesh]:
    """Return a case and its mesh."""
    case = stepped(*STEPS[name][:3], **mesh)
    return case, mesh_of_case(case, MPI.COMM_SELF)


@ALL
def test_the_mesh_fills_both_sections_and_its_faces_lie_on_their_surfaces(name: str) -> None:
    """Volume by hand (16 curved cells around lack 5e-5); each face is at half the thickness of the beam there."""
    case, tagged = meshed(name)
    width = 0.012 if tagged.dimension == 2 else 1.0
    thin, other = STEPS[name][3:]
    assert mean_section(tagged, width).volume == pytest.approx(0.2 * thin + 0.1 * other, rel=1e-4)
    mesh, last = tagged.mesh, tagged.dimension - 1
    mesh.topology.create_connectivity(last, tagged.dimension)
    for face, start, end in (("near_below", 0.02, 0.05), ("mid_above", 0.12, 0.16)):
        x = mesh.geometry.x[entities_to_geometry(mesh, last, tagged.facets_of(face))].reshape(-1, 3)
        thickness = case.profile.at(0.5 * (start + end)).beam.thickness
        assert (x[:, 0].min(), x[:, 0].max()) == (pytest.approx(start), pytest.approx(end))
        assert np.abs(x[:, last]).max() == pytest.approx(0.5 * thickness)
        if not case.beam.section.round:
            assert np.abs(x[:, last]).min() == pytest.approx(0.5 * thickness)


@ALL
def test_the_size_of_a_mesh_with_steps_is_known_before_it_is_made(name: str) -> None:
    """Cells of solids exactly, those of slices and nodes from about the largest section."""
    case, tagged = meshed(name)
    cells, nodes = (
        expected_cells(geometry_of(case), sizing_of(case)),
        expected_nodes(geometry_of(case), sizing_of(case), 1),
    )
    if tagged.dimension == 3:
        assert cells == tagged.cell_count
        assert nodes == pytest.approx(tagged.vertex_count, rel=0.15)
    else:
        assert tagged.cell_count <= cells <= 2 * tagged.cell_count
        assert tagged.vertex_count <= nodes <= 2 * tagged.vertex_count


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("thicker slice", "quadrilateral"),
        ("thinner slice", "quadrilateral"),
        ("thicker slice", "triangle"),
        ("thick and wide", "hexahedron"),
        ("thick and narrow", "hexahedron"),
        ("thick and narrow", "tetrahedron"),
        ("box to rectangle", "hexahedron"),
    ],
)
def test_cells_are_joined_at_steps(name: str, cell: str) -> None:
    """The mesh has the surface of the beam with its shoulders: cells that are not joined have more."""
    case, tagged = meshed(name, cell=cell)
    mesh, last = tagged.mesh, tagged.dimension - 1
    facets = np.asarray(exterior_facet_indices(mesh.topology), dtype=np.int32)
    x = mesh.geometry.x[entities_to_geometry(mesh, last, facets)]
    one, other = case.profile.at(0.0).beam, case.profile.at(0.15).beam
    if tagged.dimension == 2:
        found = np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum()
        wanted = 2 * 0.3 + 2 * 0.012 + 2 * abs(other.thickness - one.thickness)
    else:
        sides = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        found = (0.5 if cell == "tetrahedron" else 1.0) * np.linalg.norm(sides, axis=1).sum()
        outside = 2 * 0.2 * (one.thickness + one.width) + 2 * 0.1 * (other.thickness + other.width)
        inside = 0.2 * 4 * 0.008 if name == "box to rectangle" else 0.0
        shared = min(one.thickness, other.thickness) * min(one.width, other.width)
        shoulders = 2 * (one.area + other.area - 2 * (shared if one.rectangular else one.area))
        wanted = outside + inside + 2 * one.area + shoulders
    assert found == pytest.approx(wanted, rel=1e-9)


def test_shared_patches_are_as_fine_as_each_section_asks() -> None:
    """A rectangle of 4 by 4 cells in one half as wide and twice as high: lines of both, no cell longer than theirs."""
    flat, high = rectangle_patches(0.01, 0.02, 4, 4), rectangle_patches(0.02, 0.01, 4, 4)
    whole, ((one, filled), (other, more)) = shared_patches([flat, high])
    assert (filled, more) == ((False, True, True, True, False), (True, False, True, False, True))
    assert (one.cells, other.cells) == (24, 24), "4 and twice 1 cell by 4 through each of them"
    assert whole.cells == 32
    assert {curve.side for curve in one.curves if curve.start[1] == curve.end[1] == -0.005} == {"below"}
    assert {curve.side for curve in other.curves if curve.start[1] == curve.end[1] == -0.005} == {"inside"}


def test_rings_are_shared_by_shafts_and_tubes() -> None:
    """A bar of 10 mm, and a tube from 8 to 12 mm: circles at 8, 10 and 12 mm around a square."""
    bar, tube = ring_patches(0.005, 0.002, 4, 2, filled=True), ring_patches(0.006, 0.004, 2, 2, filled=False)
    whole, ((one, filled), (other, more)) = shared_patches([bar, tube])
    assert (sum(filled), sum(more), len(whole.patches)) == (9, 8, 13)
    assert {round(np.hypot(*curve.start), 6) for curve in whole.curves if curve.arc} == {0.004, 0.005, 0.006}
    assert {round(np.hypot(*curve.start), 6) for curve in one.curves if curve.side != "inside"} == {0.005}
    assert {curve.side for curve in other.curves if np.hypot(*curve.start) < 0.0059} == {"inside"}


def test_round_sections_beside_others_are_refused() -> None:
    square = grid_patches(((-1.0, 1.0), (-1.0, 1.0)), ((2,), (2,)), ((True,),))
    with pytest.raises(MeshError, match="round ones beside others"):
        shared_patches([square, ring_patches(1.0, 0.5, 2, 1, filled=True)])


def test_surfaces_that_almost_coincide_are_refused() -> None:
    """A shaft that is thicker than the bore of a tube by 10 nm would leave cells of that size."""
    shaft, tube = ring_patches(0.00400001, 0.002, 4, 2, filled=True), ring_patches(0.006, 0.004, 2, 2, filled=False)
    with pytest.raises(MeshError, match="1e-08 m apart"):
        shared_patches([shaft, tube])
