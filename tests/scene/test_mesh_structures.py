"""Structures from mesh files of solids: beams, bars and patches whose answers are known, whatever the format."""

from __future__ import annotations

from math import pi, tan
from pathlib import Path

import meshio
import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse.linalg as sla
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from scipy.optimize import brentq

import gapbeam as gb
from gapbeam.solver.assembly.elasticity import CellStiffness, lame
from gapbeam.solver.scene.solid_cells import KINDS
from tests.scene.solid_grids import PLY, grid, ply_stress, with_sets

pytestmark = pytest.mark.versions

YOUNG, DENSITY = 2.1e11, 7850.0
SOFT = gb.material(YOUNG, DENSITY, 0.0)  # without contraction a clamp holds nothing but the beam
LENGTH, HIGH = 1.0, 0.1
SOLIDS = ("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27")


def cantilever(folder: Path, kind: str, across: int, meter: float = 1.0) -> gb.Structure:
    """Return a clamped block, ten times as long as high, with `across` cells across."""
    mesh = grid(kind, (5 * across, 1, across), (LENGTH / meter, HIGH / meter, HIGH / meter))
    with_sets(mesh, ROOT=lambda x, *_: x == 0.0, TIP=lambda x, *_: x > 0.999 * LENGTH / meter)
    file = folder / f"{kind}{across}.inp"
    if kind.endswith("27"):  # no element type of Abaqus
        file = file.with_suffix(".vtk")
        mesh.point_sets, mesh.point_data = {}, {"held": (mesh.points[:, 0] == 0.0).astype(int)}
        mesh.write(file)
        root = ["held:1"]
    else:
        mesh.write(file)
        root = ["ROOT"]
    unit = "m" if meter == 1.0 else "mm"
    return gb.from_mesh(file, SOFT, units=unit, clamped=root)


def first(structure: gb.Structure) -> float:
    """Return the first frequency, Hz."""
    return float(np.sqrt(sla.eigsh(structure.K, 1, structure.M, sigma=0.0)[0][0]) / (2.0 * pi))


def timoshenko() -> float:
    """Return the first frequency of Timoshenko's cantilever by transfer of (w, angle, moment, force), Hz."""
    area, second = HIGH**2, HIGH**4 / 12.0
    shear = 5.0 / 6.0 * YOUNG / 2.0 * area

    def clamped(w: float) -> float:
        m, j = DENSITY * area * w * w, DENSITY * second * w * w
        A = np.array([[0, 1, 0, 1 / shear], [0, 0, 1 / (YOUNG * second), 0], [0, -j, 0, -1], [-m, 0, 0, 0]])
        T = sl.expm(A * LENGTH)
        return float(np.linalg.det(T[2:, 2:]))

    return float(brentq(clamped, 2 * pi * 70.0, 2 * pi * 95.0)) / (2.0 * pi)


ORDERS = {"hexahedron": 2, "hexahedron20": 4, "hexahedron27": 4, "tetra": 2, "tetra10": 4}


@pytest.mark.parametrize("kind", SOLIDS)
def test_a_block_vibrates_as_a_beam(tmp_path: Path, kind: str) -> None:
    """Timoshenko's frequency within 0.1 %, from above, at the order of the cells."""
    counts = (2, 4) if ORDERS[kind] == 2 else (1, 2)
    truth = first(cantilever(tmp_path, "hexahedron27", 4))
    assert truth == pytest.approx(timoshenko(), rel=1e-3)
    errors = np.array([first(cantilever(tmp_path, kind, n)) for n in counts]) - truth
    assert np.all(errors > 0.0)
    slack = 0.9 if ORDERS[kind] == 4 else 0.3  # corners of the clamp are singular
    assert np.log2(errors[0] / errors[1]) > ORDERS[kind] - slack
    if kind == "tetra10":
        assert errors[1] < 2e-3 * truth


def test_formats_and_units_give_the_same_matrices(tmp_path: Path) -> None:
    """Abaqus, gmsh, VTK and MED bit by bit; Nastran to the digits of its fields; millimeters to round-off."""
    for kind in ("tetra10", "hexahedron20", "hexahedron"):
        mesh = grid(kind, (3, 2, 2), (0.3, 0.2, 0.2), 0.2)
        found = {}
        for suffix in ("inp", "msh", "vtk", "vtu", "med", "bdf"):
            file = tmp_path / f"{kind}.{suffix}"
            mesh.write(file, **({"file_format": "gmsh22"} if suffix == "msh" else {}))
            found[suffix] = gb.from_mesh(file, SOFT, units="m")
        scaled = meshio.Mesh(1e3 * mesh.points, mesh.cells)
        scaled.write(tmp_path / "mm.vtk")
        found["mm"] = gb.from_mesh(tmp_path / "mm.vtk", SOFT, units="mm")
        one = found["inp"]
        assert one.rigid is not None
        assert one.rigid.shape == (3 * len(mesh.points), 6)
        for name, other in found.items():
            close = {"bdf": 1e-8, "mm": 1e-13}.get(name, 0.0)
            for A, B in ((one.K, other.K), (one.M, other.M)):
                assert abs(A - B).max() <= close * abs(A).max(), name
        assert one.inertia is not None
        assert one.inertia.sum(axis=0) == pytest.approx(DENSITY * 0.3 * 0.2 * 0.2, rel=1e-12)


def test_cells_of_med_may_be_mirrored(tmp_path: Path) -> None:
    """Salome orders nodes the other way round: the same matrices; elsewhere such cells are refused as inverted."""
    mesh = grid("tetra10", (2, 1, 1), (0.2, 0.1, 0.1))
    mesh.write(tmp_path / "one.med")
    mirrored = meshio.Mesh(mesh.points, [("tetra10", mesh.cells[0].data[:, KINDS["tetra10"].mirror()])])
    mirrored.write(tmp_path / "two.med")
    one, two = (gb.from_mesh(tmp_path / name, SOFT, units="m") for name in ("one.med", "two.med"))
    assert abs(one.K - two.K).max() <= 1e-14 * abs(one.K).max()
    mirrored.write(tmp_path / "two.vtk")
    with pytest.raises(gb.UserError, match="12 of 12 cells flat or inverted"):
        gb.from_mesh(tmp_path / "two.vtk", SOFT, units="m")


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron27", "quad9"])
def test_cells_are_those_of_dolfinx(tmp_path: Path, kind: str) -> None:
    """Spectrum of the stiffness of a unit block against cells that DOLFINx and basix make."""
    flat, counts = kind == "quad9", (2, 2) if kind == "quad9" else (2, 2, 2)
    grid(kind, counts, (1.0,) * len(counts)).write(tmp_path / "block.vtk")
    material, plane = gb.material(2.0, 1.0, 0.3), {"plane": "stress", "thickness": 1.0} if flat else {}
    own = gb.from_mesh(tmp_path / "block.vtk", material, units="m", **plane)  # type: ignore[arg-type]
    make = dolfinx_mesh.create_unit_square if flat else dolfinx_mesh.create_unit_cube
    cell = dolfinx_mesh.CellType[OF_DOLFINX[kind]]
    space = fem.functionspace(make(MPI.COMM_SELF, *counts, cell), ("Lagrange", 2, (len(counts),)))
    rows, count = space.dofmap.list, space.mesh.topology.index_map(len(counts)).size_local
    first, second = lame(material, plane_stress=flat)
    blocks = CellStiffness(space, np.full(count, first), np.full(count, second), 1.0).of_cells(np.arange(count))
    K = np.zeros(own.K.shape)
    for row, k in zip(rows, blocks, strict=True):
        at = (len(counts) * row[:, None] + np.arange(len(counts))).ravel()
        K[np.ix_(at, at)] += k
    wanted, found = np.linalg.eigvalsh(K), np.linalg.eigvalsh(own.K.toarray())
    assert np.abs(found - wanted).max() < 1e-12 * wanted.max()


OF_DOLFINX = {"tetra10": "tetrahedron", "hexahedron27": "hexahedron", "quad9": "quadrilateral"}


@pytest.mark.parametrize("kind", SOLIDS)
def test_orthotropic_patch_test(tmp_path: Path, kind: str) -> None:
    """Constant strain on a distorted mesh: no force inside, and stress times area on a face, to 1e-10."""
    size = (0.3, 0.2, 0.1)
    mesh = grid(kind, (3, 3, 2), size, 0.25)
    mesh.write(tmp_path / "ply.vtk")
    found = gb.from_mesh(tmp_path / "ply.vtk", PLY, units="m")
    gradient = 1e-4 * np.random.default_rng(2).uniform(-1.0, 1.0, (3, 3))
    force = (found.K @ (mesh.points @ gradient.T).ravel()).reshape(-1, 3)
    outside = np.any([(x == 0.0) | (x > s - 1e-9) for x, s in zip(mesh.points.T, size, strict=True)], axis=0)
    assert np.abs(force[~outside]).max() < 1e-10 * np.abs(force).max()
    sigma = ply_stress(0.5 * (gradient + gradient.T))
    for way in range(3):
        # sum x f = sigma V: forces at edges belong to two faces
        assert (mesh.points[:, way] @ force) / np.prod(size) == pytest.approx(sigma[:, way], rel=1e-10)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("kind", ["triangle", "triangle6", "quad", "quad8", "quad9"])
def test_patch_test_in_the_plane(tmp_path: Path, kind: str, plane: str) -> None:
    """Stress of plane stress and plane strain by their formulas, times area and thickness."""
    E, nu, deep = 7e10, 0.33, 0.02
    mesh = grid(kind, (3, 3), (0.3, 0.2), 0.25)
    mesh.write(tmp_path / "sheet.vtk")
    found = gb.from_mesh(
        tmp_path / "sheet.vtk", gb.material(E, 2700.0, nu), units="m", plane=plane, thickness=deep,
    )  # type: ignore[arg-type] # fmt: skip
    gradient = np.array([[3e-4, 1e-4], [2e-4, -1e-4]])
    force = (found.K @ (mesh.points[:, :2] @ gradient.T).ravel()).reshape(-1, 2)
    x, y, shear = gradient[0, 0], gradient[1, 1], gradient[0, 1] + gradient[1, 0]
    if plane == "stress":
        sx, sy = E / (1 - nu**2) * (x + nu * y), E / (1 - nu**2) * (y + nu * x)
    else:
        sx, sy = (E / (1 + nu) / (1 - 2 * nu) * ((1 - nu) * a + nu * b) for a, b in ((x, y), (y, x)))
    wanted = np.array([[sx, E / 2 / (1 + nu) * shear], [E / 2 / (1 + nu) * shear, sy]])
    assert mesh.points[:, :2].T @ force / (0.3 * 0.2 * deep) == pytest.approx(wanted, rel=1e-10)
    assert found.rigid is not None
    assert found.rigid.shape[1] == 3
    assert found.inertia is not None
    assert found.inertia.sum(axis=0) == pytest.approx([2700.0 * 0.3 * 0.2 * deep] * 2 + [0.0], rel=1e-12)


def test_a_bar_of_two_materials(tmp_path: Path) -> None:
    """Springs in series under a load, and frequencies of Z2 tan(k1 a) tan(k2 b) = Z1 of a rod of two parts."""
    one, two, a, b = (2e11, 8000.0), (1e10, 1200.0), 0.4, 0.6
    mesh = grid("hexahedron20", (20, 1, 1), (1.0, 0.1, 0.1))
    middle = mesh.points[mesh.cells[0].data[:, :8], 0].mean(axis=1)
    mesh.cell_sets = {"Steel": [np.flatnonzero(middle < a)], "Rubber": [np.flatnonzero(middle > a)]}
    with_sets(mesh, ROOT=lambda x, *_: x == 0.0, TIP=lambda x, *_: x > 0.999)
    mesh.write(tmp_path / "bar.inp")
    across = [f"{node}.{way}" for node in range(1, len(mesh.points) + 1) for way in (2, 3)]
    bar = gb.from_mesh(
        tmp_path / "bar.inp", {"steel": gb.material(*one, 0.0), "": gb.material(*two, 0.0)}, units="m",
        clamped=["ROOT", *across], points={"tip": {"set": "TIP", "direction": [1, 0, 0]}},
    )  # fmt: skip
    force = np.zeros(len(mesh.points))
    tip = bar["tip"].rows[0]
    # a uniform pull has other forces at corners and middles of edges: its mean motion follows from energy, f . u
    face = mesh.points[:, 0] > 0.999
    corners = face & (np.abs(np.abs(mesh.points[:, 1] - 0.05) - 0.05) < 1e-9) & (
        np.abs(np.abs(mesh.points[:, 2] - 0.05) - 0.05) < 1e-9)  # fmt: skip
    force[face], force[corners] = 1.0 / 3.0, -1.0 / 12.0
    free = mesh.points[:, 0] > 0.0
    u = sla.spsolve(bar.K.tocsc(), force[free])
    assert tip @ u == pytest.approx((a / one[0] + b / two[0]) / 0.01, rel=1e-9)
    speeds = [np.sqrt(E / rho) for E, rho in (one, two)]
    ratio = np.sqrt(two[0] * two[1] / (one[0] * one[1]))
    most = 0.499 * pi * speeds[1] / b
    w = brentq(lambda w: ratio * tan(w * a / speeds[0]) * tan(w * b / speeds[1]) - 1.0, 100.0, most)
    assert first(bar) == pytest.approx(w / (2.0 * pi), rel=1e-6)


def test_a_mesh_meets_its_gap_as_its_matrices_do(tmp_path: Path) -> None:
    """The same block from its mesh and from Matrix Market with names of rows and nodes: motions to 1e-9."""
    mesh = with_sets(
        grid("hexahedron20", (6, 1, 1), (300.0, 30.0, 20.0)), ROOT=lambda x, *_: x == 0.0, TIP=lambda x, *_: x > 299.0
    )
    mesh.write(tmp_path / "bracket.inp")
    steel = gb.material(2.1e11, 7850.0)
    points = {
        "tip": {"set": "TIP", "direction": [0, 0, 1]}, "side": {"nearest": [0.15, 0, 0.02], "direction": [0, 0, 1]}
    }  # fmt: skip
    whole = gb.from_mesh(tmp_path / "bracket.inp", steel, units="mm")
    files = gb.write_structure(whole, tmp_path / "b")
    (tmp_path / "b.dof").write_text("\n".join(f"{i}.{k}" for i in range(1, len(mesh.points) + 1) for k in (1, 2, 3)))
    lines = [f"{i}, {x:.17g}, {y:.17g}, {z:.17g}" for i, (x, y, z) in enumerate(1e-3 * mesh.points, 1)]
    root, tip = (", ".join(str(i + 1) for i in mesh.point_sets[name]) for name in ("ROOT", "TIP"))
    text = "\n".join(["*NODE", *lines, "*NSET, NSET=ROOT", root, "*NSET, NSET=TIP", tip])
    (tmp_path / "nodes.inp").write_text(text + "\n")
    one = gb.from_mesh(tmp_path / "bracket.inp", steel, units="mm", points=points, clamped=["ROOT"])
    two = gb.read_structure(
        files["stiffness"], files["mass"], units="m-kg-s", dofs=tmp_path / "b.dof", nodes=tmp_path / "nodes.inp",
        points=points, clamped=["ROOT"], place=gb.Pose(),
    )  # fmt: skip
    found = []
    for bracket in (one, two):
        stop = gb.Contact(bracket["tip"], gb.Slot(2e-4), gb.KelvinVoigt(stiffness=1e6, damping=10.0), name="stop")
        shaker = gb.Force(bracket["side"], lambda t: 400.0 * np.sin(700.0 * t))
        scene = gb.Scene(bracket, contacts=[stop], loads=[shaker, gb.weight(bracket, 9.81, [0, 0, -1])])
        found.append(gb.history(scene, 2e-5, 0.02))
    assert np.abs(found[0].force["stop"]).max() > 10.0
    for name, x in found[0].displacement.items():
        assert np.abs(found[1].displacement[name] - x).max() < 1e-9 * np.abs(x).max()
