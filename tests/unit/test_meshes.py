"""Meshes of the beam with all four cell types: size, faces and points exact, the same every time."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.graph import adjacencylist
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.distributed_mesh import owners, slices
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_size import GROWTH, BeamSizing, Cell
from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.tagged_mesh import TaggedMesh, build_beam
from gapbeam.solver.assembly.case_mesh import geometry_of, sizing_of
from gapbeam.solver.case.reading.case_reader import read_case
from tests.shared.command import PROJECT
from tests.shared.forms import compiled_form
from tests.shared.mesh_figures import described

pytestmark = pytest.mark.versions

COMM = MPI.COMM_WORLD
LENGTH, THICKNESS, WIDTH, SUPPORT = 0.51, 0.012, 0.02, 0.05
CELLS: tuple[Cell, ...] = ("triangle", "quadrilateral", "tetrahedron", "hexahedron")
# on the axis, at the tip, on the faces, on an edge of the box, inside
POINTS_3D = (
    (0.37, 0.0, 0.0),
    (0.51, 0.0, 0.0),
    (0.25, 0.0, 0.006),
    (0.03, 0.01, -0.006),
    (0.05, 0.003, -0.006),
    (0.2, -0.004, 0.0031),
)


def beam(cell: Cell, *points: tuple[float, float, float]) -> BeamGeometry:
    if cell in ("tetrahedron", "hexahedron"):
        return BeamGeometry(3, LENGTH, THICKNESS, WIDTH, SUPPORT, points)
    return BeamGeometry(2, LENGTH, THICKNESS, WIDTH, SUPPORT, tuple((x, z) for x, _, z in points))


def integral(tagged: TaggedMesh, group: str | None = None) -> float:
    """Volume of the mesh, or area of a group of facets."""
    one = fem.Constant(tagged.mesh, 1.0)
    if group is None:
        measure = ufl.dx(domain=tagged.mesh)
    else:
        measure = ufl.Measure("ds", tagged.mesh, subdomain_data=tagged.facets)(tagged.groups[group])
    return float(COMM.allreduce(fem.assemble_scalar(compiled_form(one * measure))))


def nearest_vertex(tagged: TaggedMesh, point: tuple[float, ...]) -> float:
    x = tagged.mesh.geometry.x[:, : len(point)]
    return float(COMM.allreduce(np.min(np.linalg.norm(x - point, axis=1), initial=np.inf), MPI.MIN))


def facet_nodes(tagged: TaggedMesh, group: str) -> np.ndarray:
    """Coordinates of the nodes of each owned facet of a group, shape (facets, nodes, 3)."""
    mesh, dimension = tagged.mesh, tagged.dimension
    facets = tagged.facets_of(group)
    if len(facets) == 0:  # DOLFINx 0.9 divides by this number
        corners = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 4}
        return np.empty((0, corners[mesh.topology.cell_name()], 3))
    mesh.topology.create_connectivity(dimension - 1, dimension)
    return mesh.geometry.x[entities_to_geometry(mesh, dimension - 1, facets)]


@pytest.mark.parametrize("points", [(), POINTS_3D], ids=["no points", "points"])
@pytest.mark.parametrize("cell", CELLS)
def test_size_faces_and_points(cell: Cell, points: tuple[tuple[float, float, float], ...]) -> None:
    """Volume and faces to 1e-12, every point on a vertex to 1e-12 m."""
    geometry = beam(cell, *points)
    tagged = build_beam(COMM, geometry, BeamSizing(cell))
    assert described(tagged)["cell"] == cell
    across = WIDTH if geometry.dimension == 3 else 1.0
    assert integral(tagged) == pytest.approx(LENGTH * THICKNESS * across, rel=1e-12)
    for name, area in (("base", SUPPORT), ("gland", SUPPORT), ("end", THICKNESS), ("tip", THICKNESS)):
        assert integral(tagged, name) == pytest.approx(area * across, rel=1e-12), name
    assert tagged.lower == pytest.approx(geometry.lower, abs=1e-12)
    assert tagged.upper == pytest.approx(geometry.upper, abs=1e-12)
    for point in geometry.points:
        assert nearest_vertex(tagged, point) < 1e-12, point


@pytest.mark.parametrize("cell", CELLS)
def test_groups_are_where_their_names_say(cell: Cell) -> None:
    """Base below and gland above, both for 0 <= x <= support length only; end and tip at the ends."""
    tagged = build_beam(COMM, beam(cell), BeamSizing(cell))
    bending = tagged.dimension - 1
    for name, axis, value in (
        ("base", bending, -THICKNESS / 2),
        ("gland", bending, THICKNESS / 2),
        ("end", 0, 0.0),
        ("tip", 0, LENGTH),
    ):
        nodes = facet_nodes(tagged, name)
        assert COMM.allreduce(len(nodes)) == tagged.facet_counts[name] > 0
        assert nodes[..., axis] == pytest.approx(value, abs=1e-12), name
        if name in ("base", "gland"):
            ends = COMM.allgather((nodes[..., 0].min(initial=1), nodes[..., 0].max(initial=-1)))
            assert min(end[0] for end in ends) == 0.0
            assert max(end[1] for end in ends) == pytest.approx(SUPPORT, abs=1e-12)


@pytest.mark.parametrize(("cell", "dofs"), [("quadrilateral", 2106), ("hexahedron", 28431)])
def test_default_number_of_unknowns(cell: Cell, dofs: int) -> None:
    """Degree 2, one unknown for each node and direction."""
    tagged = build_beam(COMM, beam(cell), BeamSizing(cell))
    space = fem.functionspace(tagged.mesh, ("Lagrange", 2, (tagged.dimension,)))
    assert space.dofmap.index_map.size_global * tagged.dimension == dofs


@pytest.mark.parametrize("cell", ["triangle", "tetrahedron"])
def test_default_number_of_unstructured_cells(cell: Cell) -> None:
    """Cells of about the wanted length: these numbers depend a little on the release of gmsh."""
    tagged = build_beam(COMM, beam(cell), BeamSizing(cell))
    assert tagged.cell_count == pytest.approx({"triangle": 500, "tetrahedron": 5830}[cell], rel=0.2)


@pytest.mark.parametrize("cell", CELLS)
def test_cells_are_small_at_the_edge_and_in_the_support(cell: Cell) -> None:
    """Facet lengths along x at the edge of the base, within the support and on average."""
    tagged = build_beam(COMM, beam(cell), BeamSizing(cell))
    nodes = np.concatenate(COMM.allgather(facet_nodes(tagged, "base")[..., 0]))
    lengths = np.ptp(nodes, axis=1)
    at_edge = lengths[nodes.max(axis=1) > SUPPORT - 1e-12]
    at_end = lengths[nodes.min(axis=1) < 1e-12]
    middle = lengths[np.abs(nodes.mean(axis=1) - SUPPORT / 2) < SUPPORT / 6]
    assert at_edge.mean() < 0.75 * middle.mean()
    assert at_end.mean() < 0.75 * middle.mean()
    assert at_edge.max() < 1.5 * THICKNESS / 6 * GROWTH
    assert described(tagged)["contact_facet_length"] == pytest.approx(lengths.mean(), rel=0.03)


def test_layers_of_hexahedra_are_those_asked_for() -> None:
    sizing = BeamSizing("hexahedron", cells_through_thickness=3, cells_across_width=5)
    tagged = build_beam(COMM, beam("hexahedron"), sizing)
    assert tagged.facet_counts["tip"] == 15
    assert tagged.cell_count == 58 * 15


@pytest.mark.parametrize("cell", CELLS)
def test_two_builds_are_equal(cell: Cell) -> None:
    geometry = beam(cell, *POINTS_3D)
    first, second = (build_beam(COMM, geometry, BeamSizing(cell)) for _ in range(2))
    assert np.array_equal(first.mesh.geometry.x, second.mesh.geometry.x)
    cells, again = (one.mesh.topology.connectivity(one.dimension, 0).array for one in (first, second))
    assert np.array_equal(cells, again)
    assert np.array_equal(first.facets.indices, second.facets.indices)
    assert np.array_equal(first.facets.values, second.facets.values)


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_any_scale(cell: Cell, scale: float) -> None:
    """The tolerances of gmsh are absolute; a beam of half a millimeter is meshed like one of half a meter."""
    big = beam(cell, *POINTS_3D)
    points = tuple(tuple(scale * value for value in point) for point in big.points)
    sides = (scale * side for side in (LENGTH, THICKNESS, WIDTH, SUPPORT))
    tagged = build_beam(COMM, BeamGeometry(big.dimension, *sides, points), BeamSizing(cell))
    assert tagged.cell_count == pytest.approx(build_beam(COMM, big, BeamSizing(cell)).cell_count, rel=0.03)
    for point in points:
        assert nearest_vertex(tagged, point) < 1e-12 * scale


@pytest.mark.parametrize("cell", CELLS)
def test_support_as_long_as_the_beam(cell: Cell) -> None:
    dimension = beam(cell).dimension
    geometry = BeamGeometry(dimension, 0.05, THICKNESS, WIDTH, 0.05, ((0.02,) + (0.0,) * (dimension - 1),))
    tagged = build_beam(COMM, geometry, BeamSizing(cell))
    assert integral(tagged, "gland") == pytest.approx(0.05 * (WIDTH if dimension == 3 else 1), rel=1e-12)
    assert nearest_vertex(tagged, geometry.points[0]) < 1e-12


def test_too_many_cells_are_refused() -> None:
    for cell in ("hexahedron", "tetrahedron"):
        with pytest.raises(MeshError, match="sizes that make about"):
            build_beam(COMM, beam(cell), BeamSizing(cell, cells_through_thickness=200, cells_across_width=200))


def test_gmsh_is_silent_and_finalized(capfd: pytest.CaptureFixture[str]) -> None:
    import gmsh

    build_beam(COMM, beam("triangle"), BeamSizing("triangle"))
    with pytest.raises(MeshError):
        build_beam(COMM, beam("triangle"), BeamSizing("triangle", size=-1.0))
    assert not gmsh.isInitialized()
    assert capfd.readouterr() == ("", "")


def test_callers_gmsh_session_comes_back() -> None:
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 8)
        gmsh.model.add("mine")
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        build_beam(COMM, beam("triangle"), BeamSizing("triangle"))
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.option.getNumber("Mesh.Algorithm") == 8
        assert len(gmsh.model.getEntities(2)) == 6
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("name", ["tube-holes", "tube-baffles", "bar-vblocks", "dovetail-slide"])
def test_facets_of_a_support_lie_on_the_surface_alone(name: str) -> None:
    """Each group covers its support once: facets as long along x as their layer, as many layers as the support has."""
    case = read_case(PROJECT / "cases" / f"{name}.toml")
    tagged = build_beam(COMM, geometry_of(case), sizing_of(case))
    for support in case.layout.supports:
        for face in support.faces:
            nodes = facet_nodes(tagged, face.name)
            lengths, corners = np.ptp(nodes[..., 0], axis=1), nodes[..., 0].min(axis=1)
            around = COMM.allreduce(np.count_nonzero(np.isclose(corners, support.start)))
            total = COMM.allreduce(float(lengths.sum()))
            assert COMM.allreduce(float(lengths.min(initial=np.inf)), MPI.MIN) > 0.0
            assert total == pytest.approx(around * (support.end - support.start), rel=1e-9)


def test_gmsh_failure_becomes_a_mesh_error(monkeypatch: pytest.MonkeyPatch) -> None:
    import gmsh

    def fail(_dimension: int) -> None:
        raise Exception("no luck today")  # gmsh raises nothing more specific

    monkeypatch.setattr(gmsh.model.mesh, "generate", fail)
    with pytest.raises(MeshError, match="no luck today"):
        build_beam(COMM, beam("tetrahedron"), BeamSizing("tetrahedron"))
    assert not gmsh.isInitialized()


def test_rank_zero_result_and_error_reach_all_ranks() -> None:
    assert on_rank_zero(COMM, lambda: {"rank": COMM.rank}) == {"rank": 0}

    def fail() -> None:
        raise MeshError("here", found="nothing", expected=f"something on rank {COMM.rank}")

    with pytest.raises(MeshError, match="something on rank 0"):
        on_rank_zero(COMM, fail)

    class Unpicklable(Exception):  # noqa: N818 - a local class cannot be pickled
        pass

    def fail_oddly() -> None:
        raise Unpicklable("odd")

    with pytest.raises(Unpicklable if COMM.rank == 0 else RuntimeError, match="odd"):
        on_rank_zero(COMM, fail_oddly)


def test_slices_are_balanced_and_ghosts_are_neighbors() -> None:
    """A row of ten cells on three ranks, half of them in the support, and a ghost on either side of each cut."""
    count = 10
    links = [[other for other in (cell - 1, cell + 1) if 0 <= other < count] for cell in range(count)]
    starts = np.cumsum([0, *map(len, links)]).astype(np.int32)
    row = adjacencylist(np.concatenate(links).astype(np.int64), starts)
    divide = slices(np.column_stack([np.arange(count), np.zeros((count, 2))]), 4.5)
    ranks = [divide(COMM, 3, row, False).links(cell)[0] for cell in range(count)]
    assert ranks == [0, 1, 1, 2, 2, 2, 1, 1, 0, 0]
    both = divide(COMM, 3, row, True)
    for cell in range(count):
        expected = {int(ranks[other]) for other in links[cell]} - {int(ranks[cell])}
        assert both.links(cell)[0] == ranks[cell]
        assert set(both.links(cell)[1:]) == expected


@pytest.mark.parametrize("parts", [1, 2, 3, 7, 100])
def test_every_rank_has_its_share_of_the_support(parts: int) -> None:
    """Layers of cells in any order: shares of the support and of the rest differ by less than two layers."""
    rng, layer, layers, supported = np.random.default_rng(3), 16, 60, 12
    places = np.stack(np.meshgrid(np.arange(layers), np.arange(4), np.arange(4), indexing="ij"), axis=-1).reshape(-1, 3)
    places = rng.permutation(places) * [0.01, 0.003, 0.003] + 1e-13 * rng.standard_normal((layers * layer, 3))
    within = places[:, 0] < (supported - 0.5) * 0.01
    found = owners(places, (supported - 0.5) * 0.01, parts)
    for some in (within, ~within):
        shares = np.bincount(found[some], minlength=parts)
        assert shares.max() - shares.min() < (2 if parts > 2 else 5) * layer
        assert len(shares) == parts
    if parts == 2:
        assert np.bincount(found[within]).tolist() == [6 * layer] * 2
        ends = [np.unique(np.round(places[~within & (found == rank), 0] / 0.01)) for rank in (1, 0)]
        assert [len(end) for end in ends] == [22, 26]  # the rank in the middle has two cuts
        assert ends[0].max() < ends[1].min()


@pytest.mark.skipif(COMM.size == 1, reason="there is only one rank")
def test_ghosts_across_shared_facets() -> None:
    """Every facet between two owned or ghost cells knows both: no facet that a rank owns lacks a cell."""
    tagged = build_beam(COMM, beam("hexahedron"), BeamSizing("hexahedron"))
    topology = tagged.mesh.topology
    topology.create_connectivity(2, 3)
    cells = topology.connectivity(2, 3)
    owned = topology.index_map(2).size_local
    on_surface = COMM.allreduce(sum(len(cells.links(facet)) == 1 for facet in range(owned)))
    layers = (58, 4, 4)
    assert on_surface == 2 * (layers[0] * layers[1] + layers[0] * layers[2] + layers[1] * layers[2])
