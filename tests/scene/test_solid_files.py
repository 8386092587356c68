"""Mesh files in files of structures: sets and groups of each format, and every slip refused by its key."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import gmsh
import meshio
import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.scene.mesh_files import read_mesh
from tests.scene.solid_grids import grid, with_sets
from tests.shared.slips import Tables, check_slip, put

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
PLY = {"young_moduli": [1e11, 1e10, 1e10], "poisson_ratios": [0.3, 0.3, 0.4], "shear_moduli": [4e9, 4e9, 3e9]}
Edit = Callable[[Tables, Path], None]


def block() -> meshio.Mesh:
    mesh = with_sets(grid("hexahedron", (4, 1, 1), (80.0, 20.0, 20.0)), ROOT=lambda x, *_: x == 0.0)
    mesh.cell_sets = {"LEFT": [np.array([0, 1])], "RIGHT": [np.array([2, 3])]}
    return mesh


def tables(folder: Path) -> Tables:
    """Return a sound file: a clamped block of two materials that hits a stop."""
    block().write(folder / "bracket.inp")
    model = {"type": "mesh", "file": str(folder / "bracket.inp"), "units": "mm"}
    materials = [{"group": "LEFT", **STEEL}, {"group": "right", "density": 1600.0, **PLY}]
    return {
        "structure": [{"name": "bracket", "model": {**model, "materials": materials}, "reduce": {"modes": 6}}],
        "point": [{"name": "tip", "structure": "bracket", "nearest": [0.08, 0, 0.02], "direction": [0, 0, 1.0]}],
        "joint": [{"type": "clamped", "structure": "bracket", "nodes": "ROOT"}],
        "pair": [
            {
                "name": "stop",
                "between": ["bracket.tip"],
                "region": {"type": "half-plane", "clearance": 1e-5},
                "law": {"type": "kelvin-voigt", "stiffness": 1e6},
            }
        ],
        "load": [
            {"type": "harmonic_force", "name": "push", "point": "bracket.tip", "amplitude": 500.0, "frequency": 300.0},
            {"type": "gravity"},
        ],
        "time": {"step": 1e-6, "end": 2e-3},
    }


def test_a_file_with_a_mesh_runs(tmp_path: Path) -> None:
    """Status 0, hits of the stop, and the motion of the structure that Python makes."""
    given = tables(tmp_path)
    outcome = gb.run(given, output=tmp_path / "results")
    assert outcome.exit_status == 0, outcome.message
    own = gb.from_mesh(
        tmp_path / "bracket.inp",
        {"left": gb.material(2.1e11, 7850.0), "RIGHT": gb.orthotropic(*PLY.values(), 1600.0)},  # type: ignore[arg-type]
        units="mm", clamped=["ROOT"], points={"tip": {"nearest": [0.08, 0, 0.02], "direction": [0, 0, 1]}},
    )  # fmt: skip
    own = gb.reduced_at_points(own, 6)
    stop = gb.Contact(own["tip"], gb.HalfPlane(1e-5), gb.KelvinVoigt(stiffness=1e6))
    push = gb.Force(own["tip"], lambda t: 500.0 * np.sin(600.0 * np.pi * t))
    scene = gb.Scene(own, contacts=[stop], loads=[push, gb.weight(own, 9.81, [0, 0, -1])])
    one, two = (gb.history(a, 1e-6, 2e-3).displacement["tip"] for a in (gb.scene(given), scene))
    assert np.abs(one - two).max() < 1e-9 * np.abs(two).max()
    assert outcome.summary["peak_contact_force"]["stop"] > 1.0


def test_groups_of_gmsh_are_sets(tmp_path: Path) -> None:
    """Physical groups of faces are sets of their nodes, of volumes groups of cells; of 2.2 and 4.1 alike."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="Body")
        gmsh.model.addPhysicalGroup(2, [1], name="Root")
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        for version in (2.2, 4.1):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.write(str(tmp_path / f"{version}.msh"))
        gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
        gmsh.write(str(tmp_path / "box.inp"))
    finally:
        gmsh.finalize()
    found = [read_mesh(tmp_path / name) for name in ("2.2.msh", "4.1.msh", "box.inp")]
    for mesh in found:
        assert mesh.kind == "tetra10"
        assert len(mesh.groups["BODY"]) == len(mesh.cells)
        x = np.array([mesh.nodes.places[one] for one in mesh.nodes.sets["ROOT"]])
        assert np.all(np.abs(x[:, 0]) < 1e-12)
        assert len(x) == sum(abs(at[0]) < 1e-9 for at in mesh.nodes.places.values())


def test_sets_of_abaqus(tmp_path: Path) -> None:
    """Ranges, sets of sets, sets of elements, lines that go on, small letters, and numbers of nodes with gaps."""
    (tmp_path / "a.inp").write_text(
        "*Heading\n** a comment\n*Node, nset=all\n10, 0, 0, 0\n20, 1, 0, 0\n30, 1, 1, 0\n40, 0, 1, 0\n"
        "50, 0, 0, 1\n60, 1, 0, 1\n70, 1, 1, 1\n80, 0, 1, 1\n90, 7, 7, 7\n"
        "*Element, type=c3d8r, elset=e1\n1, 10, 20, 30, 40,\n 50, 60, 70, 80\n"
        "*Nset, nset=low, generate\n10, 40, 10\n*nset, nset=both\nlow, 50\n*Elset, elset=every\ne1\n"
    )
    mesh = read_mesh(tmp_path / "a.inp")
    assert mesh.labels == ["10", "20", "30", "40", "50", "60", "70", "80"]
    assert mesh.nodes.sets["BOTH"] == ["10", "20", "30", "40", "50"]
    assert list(mesh.groups["EVERY"]) == [0]
    one = gb.from_mesh(tmp_path / "a.inp", gb.material(1.0, 1.0), units="m", clamped=["low"], points={"p": "70.3"})
    assert one.size == 12


@pytest.mark.parametrize(
    "lines",
    [
        "*NSET, NSET=HELD, ELSET=LEFT\n",
        "*NSET, NSET=HELD, INSTANCE=BLOCK-1\nLEFT\n",
        "*NSET, NSET=HELD\nBlock-1.LEFT\n",
        "*NSET, NSET=HELD\nNODES\n",
        '*NSET, NSET="held"\nLEFT\n',
        '*NSET, NSET="Left end"\nLEFT\n*NSET, NSET=HELD\n"Left end",\n',
    ],
)
def test_sets_of_abaqus_as_programs_write_them(tmp_path: Path, lines: str) -> None:
    """Sets of elements, of instances and in quotes hold the nodes that NumPy finds in half of the block."""
    mesh = block()
    held = np.flatnonzero(mesh.points[:, 0] <= 40.0) + 1
    mesh.point_sets["LEFT"] = held - 1
    mesh.write(tmp_path / "a.inp")
    with (tmp_path / "a.inp").open("a") as file:
        file.write(lines.replace("NODES", "\n".join(f"PART-1-1.{node}," for node in held)))
    made = gb.from_mesh(tmp_path / "a.inp", gb.material(2e11, 7850.0), units="mm", clamped=["HELD"])
    assert made.size == 3 * (len(mesh.points) - len(held))


def test_properties_of_nastran_are_groups(tmp_path: Path) -> None:
    mesh = block()
    mesh.cell_sets, mesh.point_sets = {}, {}
    mesh.cell_data = {"nastran:ref": [np.array([7, 7, 8, 8])]}
    mesh.write(tmp_path / "a.bdf")
    found = read_mesh(tmp_path / "a.bdf")
    assert {name: list(some) for name, some in found.groups.items()} == {"7": [0, 1], "8": [2, 3]}
    assert len(found.nodes.sets["8"]) == 12


def test_what_a_mesh_does_not_hold_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Ties and clamps of the file are named, as is the mass of what was read."""
    block().write(tmp_path / "a.inp")
    with (tmp_path / "a.inp").open("a") as file:
        file.write("*BOUNDARY\n1, 1, 3\n*TIE, NAME=a\nb, c\n")
    with caplog.at_level(logging.INFO, "gapbeam"):
        gb.from_mesh(tmp_path / "a.inp", gb.material(2e11, 7850.0), units="mm")
    assert "BOUNDARY, TIE not read" in caplog.text
    assert "4 hexahedron cells, 20 nodes, 0.08 x 0.02 x 0.02 m, 0.2512 kg" in caplog.text


def text(edit: Callable[[str], str]) -> Edit:
    def change(_: Tables, folder: Path) -> None:
        file = folder / "bracket.inp"
        file.write_text(edit(file.read_text()))

    return change


def other(mesh: Callable[[], meshio.Mesh], suffix: str = "vtk") -> Edit:
    """Return a change to another mesh in another format, of one material."""

    def change(given: Tables, folder: Path) -> None:
        mesh().write(folder / f"other.{suffix}")
        model = given["structure"][0]["model"]
        model["file"], model["materials"] = str(folder / f"other.{suffix}"), [dict(STEEL)]
        given["joint"] = []

    return change


def mixed() -> meshio.Mesh:
    mesh = block()
    rows = mesh.cells[0].data
    return meshio.Mesh(mesh.points, [("hexahedron", rows[:3]), ("tetra", rows[3:, [0, 1, 3, 4]])])


def shells(flat: bool) -> meshio.Mesh:
    mesh = grid("quad", (2, 2), (1.0, 1.0))
    if not flat:
        mesh.points[:, 2] = 0.1 * mesh.points[:, 0] ** 2
    return mesh


def fin() -> meshio.Mesh:
    mesh = block()
    points = np.vstack([mesh.points, [[80.0, 50.0, 0.0]]])
    return meshio.Mesh(points, [*mesh.cells, ("triangle", np.array([[0, 1, len(points) - 1]]))])


def twice() -> meshio.Mesh:
    mesh = block()
    both = np.vstack([mesh.points, mesh.points + np.array([0.0, 0.0, 50.0])])
    return meshio.Mesh(both, [("hexahedron", np.vstack([mesh.cells[0].data, mesh.cells[0].data + len(mesh.points)]))])


def folded() -> meshio.Mesh:
    mesh = block()
    mesh.points[mesh.cells[0].data[0, 6]] = -100.0  # a corner of two cells
    return mesh


def renamed(given: Tables, folder: Path) -> None:
    (folder / "a.xyz").write_text("1 2 3")
    given["structure"][0]["model"]["file"] = str(folder / "a.xyz")


MODEL = ("structure", 0, "model")
FILE = "bracket.*model.file"
GROUPS = "bracket.*model materials$"
SLIPS: dict[str, tuple[Edit, str, str]] = {
    "no file": (put(*MODEL, "file", value="none.inp"), FILE, "no file"),
    "no mesh": (text(lambda _: "hello\n"), FILE, "no solid cells"),
    "another suffix": (renamed, FILE, "cannot be read as a mesh"),
    "units": (put(*MODEL, "units", value="feet"), "units", "inch"),
    "no units": (put(*MODEL, "units", value=None), "units", "missing"),
    "shells of Abaqus": (text(lambda s: s + "*ELEMENT, TYPE=S4R\n99, 1, 2, 4, 3\n"), FILE,
                         r"1 element of type S4R \(shells\) at \(0, 0, 0\)"),
    "beams of Abaqus": (text(lambda s: s + "*ELEMENT, TYPE=B31\n99, 1, 2\n"), FILE, r"B31 \(beams\)"),
    "wedges": (text(lambda s: s + "*ELEMENT, TYPE=C3D6\n99, 1, 2, 3, 4, 5, 6\n"), FILE, r"C3D6 \(wedges\)"),
    "shells of a surface": (other(lambda: shells(False)), FILE, "out of a plane z = constant, which are shells"),
    "plane cells without thickness": (other(lambda: shells(True)), "bracket.*plane", "shells are no solids"),
    "a thickness of solids": (put(*MODEL, "thickness", value=0.1), "bracket.*thickness", "none in space"),
    "a fin": (other(fin), FILE, r"a triangle at .* on no face of the solids \(shells\)"),
    "shells of Nastran": (other(fin, "bdf"), FILE, r"shells, beams or springs \(triangle\)"),
    "two kinds of cells": (other(mixed), FILE, "hexahedron and tetra, the last at"),
    "an inverted cell": (other(folded), FILE, "2 of 4 cells flat or inverted, the first at .* of nodes 1,"),
    "two pieces": (other(twice), FILE, "2 pieces that share no nodes"),
    "a missing node": (text(lambda s: s.replace("\n20, ", "\n2000, ")), FILE, "node 20 in an element"),
    "a coordinate that is none": (text(lambda s: s.replace("8.0000000000000000e+01", "nan")), FILE, "not finite"),
    "an included file": (text(lambda s: s + "*INCLUDE, INPUT=b.inp\n"), FILE, "one file of one part"),
    "an unknown group": (put(*MODEL, "materials", 0, "group", value="LEFTT"), GROUPS, "LEFT, RIGHT"),
    "cells without a material": (put(*MODEL, "materials", value=[{"group": "LEFT", **STEEL}]), GROUPS,
                                 r"2 cells without a material, the first at \(50, 10, 10\)"),
    "two materials of cells": (text(lambda s: s.replace("*ELSET, ELSET=RIGHT\n", "*ELSET, ELSET=RIGHT\n1,\n")),
                               GROUPS, "1 cells in both LEFT and right"),
    "a group twice": (put(*MODEL, "materials", 1, "group", value="LEFT"), "group", "a second time"),
    "half a material": (put(*MODEL, "materials", 0, "poisson_ratio", value=None), "materials", "or young_moduli"),
    "both kinds of material": (put(*MODEL, "materials", 0, "shear_moduli", value=[1e9] * 3), "materials",
                               "young_modulus, poisson_ratio, shear_moduli"),
    "energy below 0": (put(*MODEL, "materials", 1, "poisson_ratios", value=[5.0, 0.3, 0.3]), "materials", "nu21"),
    "skew axes": (put(*MODEL, "materials", 1, "across", value=[1.0, 0.0, 0.1]), "materials", "at right angles"),
    "no such set": (put("joint", 0, "nodes", value="BASE"), "joint", "a set: LEFT, RIGHT, ROOT"),
    "a set without nodes": (text(lambda s: s.replace("NSET=ROOT", "NSET=OTHER") + "*NSET, NSET=ROOT\n"), "joint",
                            "the set 'ROOT' without a node"),
    "a set of unknown elements": (text(lambda s: s.replace("NSET=ROOT", "NSET=OTHER")
                                  + "*NSET, NSET=ROOT, ELSET=MIDDLE\n"), "joint", "'ROOT' without a node"),
    "a set of nodes of no cell": (text(lambda s: s.replace("NSET=ROOT", "NSET=OTHER")
                                  + "*NODE, NSET=ROOT\n99, 0, 0, 0\n"), "joint", "'ROOT' without a node"),
    "a set of an unknown set": (text(lambda s: s + "*NSET, NSET=MORE\nROOTS, 1\n"), FILE,
                                r"ROOTS below \*NSET\s+expected: a number or a set above: ROOT"),
    "no set of a point": (put("point", 0, value={"name": "tip", "structure": "bracket", "set": "TOP",
                          "direction": [0, 0, 1.0]}), "tip", "'TOP'"),
    "a clamped point": (put("point", 0, "nearest", value=[0.0, 0.0, 0.0]), "tip", "is clamped"),
    "x of a mesh": (put("point", 0, "at", value=0.1), "tip", "of a model mesh"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_are_refused_by_their_key(tmp_path: Path, slip: str) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given = tables(tmp_path)
    check_slip(given, SLIPS[slip], tmp_path)
