"""A user's own .msh file: what is read, and what is said about files that cannot be used."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable
from pathlib import Path

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BeamGeometry, ContactSpan
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.tagged_mesh import TaggedMesh
from gapbeam.meshes.user_mesh import user_mesh
from gapbeam.meshes.user_mesh.user_mesh import read_mesh
from tests.shared.mesh_figures import described
from tests.unit.test_meshes import integral

pytestmark = pytest.mark.versions

COMM = MPI.COMM_WORLD
LENGTH, THICKNESS, WIDTH, SUPPORT = 0.3, 0.012, 0.02, 0.06
NAMES = {"body": "body", "base": "base", "gland": "gland"}
Groups = dict[str, list[tuple[int, int]]]


def beam(dimension: int = 3) -> BeamGeometry:
    return BeamGeometry(dimension, LENGTH, THICKNESS, WIDTH, SUPPORT)


def user_file(
    path: Path,
    *,
    dimension: int = 3,
    names: dict[str, str] = NAMES,
    scale: float = 1.0,
    move: float = 0.0,
    order: int = 1,
    layers: int = 0,
    joined: bool = True,
    edit: Callable[[Groups], object] = lambda _groups: None,
    **options: float,
) -> Path:
    """Save the beam with gmsh as a user would; `layers` > 0: quadrilaterals or hexahedra."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.01 * scale)
        for name, value in options.items():
            gmsh.option.setNumber(f"Mesh.{name}", value)
        blocks = []
        for start, stop in ((0.0, SUPPORT), (SUPPORT, LENGTH)):
            across = ([(-WIDTH / 2, WIDTH)] if dimension == 3 else []) + [(-THICKNESS / 2, THICKNESS)]
            low = [start, *(side[0] for side in across)] + [0.0] * (3 - dimension)
            sides = [stop - start, *(side[1] for side in across)]
            add = gmsh.model.occ.addBox if dimension == 3 else gmsh.model.occ.addRectangle
            blocks.append((dimension, add(*(scale * v for v in low), *(scale * v for v in sides))))
        if joined:
            gmsh.model.occ.fragment(blocks, [])
        if move:
            gmsh.model.occ.translate(gmsh.model.occ.getEntities(dimension), move, 0, 0)
        gmsh.model.occ.synchronize()
        groups = _faces(dimension, scale, move)
        edit(groups)
        for name, entities in groups.items():
            if name in names and entities:
                tags = [tag for _, tag in entities]
                gmsh.model.addPhysicalGroup(entities[0][0], tags, name=names[name])
        if layers:
            _layers(dimension, layers)
        gmsh.model.mesh.generate(dimension)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


def _faces(dimension: int, scale: float, move: float) -> Groups:
    groups: Groups = {"body": gmsh.model.getEntities(dimension), "base": [], "gland": [], "tip": []}
    for dim, tag in gmsh.model.getEntities(dimension - 1):
        center = np.array(gmsh.model.occ.getCenterOfMass(dim, tag)) / scale
        x, height = center[0] - move / scale, center[dimension - 1]
        if x < SUPPORT and abs(abs(height) - THICKNESS / 2) < 1e-9:
            groups["base" if height < 0 else "gland"].append((dim, tag))
        elif abs(x - LENGTH) < 1e-9:
            groups["tip"].append((dim, tag))
    return groups


def _layers(dimension: int, count: int) -> None:
    for _, tag in gmsh.model.getEntities(1):
        gmsh.model.mesh.setTransfiniteCurve(tag, count + 1)
    for _, tag in gmsh.model.getEntities(2):
        gmsh.model.mesh.setTransfiniteSurface(tag)
        gmsh.model.mesh.setRecombine(2, tag)
    for _, tag in gmsh.model.getEntities(3) if dimension == 3 else []:
        gmsh.model.mesh.setTransfiniteVolume(tag)


def read(path: Path, dimension: int = 3) -> TaggedMesh:
    return read_mesh(COMM, path, beam(dimension))


def refused(path: Path, geometry: BeamGeometry | None = None) -> str:
    """The message of the error that reading raises, on all ranks the same; gmsh is finalized."""
    with pytest.raises(MeshError) as caught:
        read_mesh(COMM, path, geometry or beam())
    error = caught.value
    assert not gmsh.isInitialized()
    assert len(set(COMM.allgather(str(error)))) == 1
    assert path.name in error.where
    assert error.found
    assert error.expected
    return str(error)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    ("dimension", "layers", "cell"),
    [(2, 0, "triangle"), (2, 3, "quadrilateral"), (3, 0, "tetrahedron"), (3, 3, "hexahedron")],
)
def test_good_file(tmp_path: Path, dimension: int, layers: int, cell: str, order: int) -> None:
    path = user_file(tmp_path / "good.msh", dimension=dimension, layers=layers, order=order)
    tagged = read(path, dimension)
    figures = described(tagged)
    assert (figures["cell"], figures["geometry_order"]) == (cell, order)
    across = WIDTH if dimension == 3 else 1.0
    assert integral(tagged) == pytest.approx(LENGTH * THICKNESS * across, rel=1e-9)
    assert set(tagged.groups) == {"base", "gland"}
    for name in tagged.groups:
        assert integral(tagged, name) == pytest.approx(SUPPORT * across, rel=1e-9)
    if layers:
        assert figures["contact_facet_length"] == pytest.approx(SUPPORT / layers)


@pytest.mark.parametrize("options", [{"MshFileVersion": 2.2}, {"Binary": 1}, {"MshFileVersion": 2.2, "Binary": 1}])
def test_versions_and_binary(tmp_path: Path, options: dict[str, float]) -> None:
    tagged = read(user_file(tmp_path / "good.msh", **options))
    assert integral(tagged, "gland") == pytest.approx(SUPPORT * WIDTH, rel=1e-9)


def test_other_groups_are_ignored_and_the_tip_kept(tmp_path: Path) -> None:
    def overlap(groups: Groups) -> None:
        groups["all faces"] = gmsh.model.getEntities(2)

    tagged = read(user_file(tmp_path / "a.msh", names={**NAMES, "all faces": "all faces"}, edit=overlap))
    assert set(tagged.groups) == {"base", "gland"}
    tagged = read(user_file(tmp_path / "b.msh", names={**NAMES, "tip": "tip"}))
    assert integral(tagged, "tip") == pytest.approx(THICKNESS * WIDTH, rel=1e-9)


def test_missing_group_is_named_with_those_found(tmp_path: Path) -> None:
    message = refused(user_file(tmp_path / "a.msh", names={"body": "body", "base": "base"}))
    assert 'found the physical groups "base" (surfaces), "body" (volumes)' in message
    assert "expected also gland (surfaces)" in message
    assert "Rename" not in message
    assert "no physical groups" in refused(user_file(tmp_path / "b.msh", names={}))


@pytest.mark.parametrize(("name", "written"), [("base", "Base"), ("gland", " GLAND"), ("body", "bdy")])
def test_near_misses(tmp_path: Path, name: str, written: str) -> None:
    message = refused(user_file(tmp_path / "a.msh", names={**NAMES, name: written}))
    assert f'Rename "{written}" to "{name}".' in message


def test_group_of_curves(tmp_path: Path) -> None:
    def curves(groups: Groups) -> None:
        groups["base"] = gmsh.model.getEntities(1)

    assert '"base" is a group of curves' in refused(user_file(tmp_path / "a.msh", edit=curves))


def test_dimension(tmp_path: Path) -> None:
    message = refused(user_file(tmp_path / "plane.msh", dimension=2))
    assert "found a mesh of dimension 2; expected dimension 3" in message
    message = refused(user_file(tmp_path / "solid.msh"), beam(2))
    assert "found a mesh of dimension 3; expected dimension 2" in message


def test_millimeters(tmp_path: Path) -> None:
    message = refused(user_file(tmp_path / "mm.msh", scale=1000))
    assert "found a mesh of 300 x 20 x 12 m; expected 0.3 x 0.02 x 0.012 m" in message
    assert "in mm" in message
    assert "Mesh.ScalingFactor = 0.001" in message


def test_another_beam(tmp_path: Path) -> None:
    path = user_file(tmp_path / "a.msh")
    longer = BeamGeometry(3, LENGTH * 1.02, THICKNESS, WIDTH, SUPPORT)
    assert "expected 0.306 x 0.02 x 0.012 m" in refused(path, longer)
    turned = BeamGeometry(3, LENGTH, WIDTH, THICKNESS, SUPPORT)
    assert "axes seem to be exchanged" in refused(path, turned)
    within = BeamGeometry(3, LENGTH * 1.005, THICKNESS, WIDTH, SUPPORT)
    assert read_mesh(COMM, path, within).upper[0] == pytest.approx(LENGTH)


def test_another_place_or_support(tmp_path: Path) -> None:
    message = refused(user_file(tmp_path / "moved.msh", move=0.1))
    assert "begins at (0.1, -0.01, -0.006) m" in message
    assert "Move it by (-0.1, 0, 0) m" in message
    path = user_file(tmp_path / "a.msh")
    message = refused(path, BeamGeometry(3, LENGTH, THICKNESS, WIDTH, 0.05))
    assert "group base: found facets from x = 0 m to x = 0.06 m; expected from x = 0 to x = 0.05 m" in message


def test_supported_end_at_the_far_end(tmp_path: Path) -> None:
    def far(groups: Groups) -> None:
        for name, z in (("base", -THICKNESS / 2), ("gland", THICKNESS / 2)):
            groups[name] = [
                entity
                for entity in gmsh.model.getEntities(2)
                if np.allclose(gmsh.model.occ.getCenterOfMass(*entity)[::2], ((LENGTH + SUPPORT) / 2, z))
            ]

    path = user_file(tmp_path / "a.msh", edit=far)
    assert "turn the mesh around" in refused(path, BeamGeometry(3, LENGTH, THICKNESS, WIDTH, LENGTH - SUPPORT))


def test_base_above_gland(tmp_path: Path) -> None:
    path = user_file(tmp_path / "a.msh", names={"body": "body", "base": "gland", "gland": "base"})
    assert '"base" and "gland" are exchanged' in refused(path)


def test_facets_inside_or_shared(tmp_path: Path) -> None:
    def inside(groups: Groups) -> None:
        groups["base"] = gmsh.model.getEntities(2)

    def shared(groups: Groups) -> None:
        groups["base"] = groups["gland"]

    assert "not on the surface of the body" in refused(user_file(tmp_path / "a.msh", edit=inside))
    assert "facets that are also in base" in refused(user_file(tmp_path / "b.msh", edit=shared))


def test_body_in_two_pieces(tmp_path: Path) -> None:
    """Two blocks that touch and share no nodes: they would fall apart."""
    message = refused(user_file(tmp_path / "a.msh", joined=False))
    assert "2 pieces that share no nodes" in message


def test_cells_outside_of_the_body(tmp_path: Path) -> None:
    def half(groups: Groups) -> None:
        groups["body"], groups["rest"] = groups["body"][:1], groups["body"][1:]

    message = refused(user_file(tmp_path / "a.msh", names={**NAMES, "rest": "rest"}, edit=half))
    assert "expected every cell of the file once" in message


def test_mixed_and_unsuitable_cells(tmp_path: Path) -> None:
    def mixed(_groups: Groups) -> None:
        gmsh.model.mesh.setRecombine(2, 1)

    message = refused(user_file(tmp_path / "a.msh", dimension=2, edit=mixed), beam(2))
    assert "mixed elements" in message
    serendipity = user_file(tmp_path / "b.msh", layers=3, order=2, SecondOrderIncomplete=1)
    assert "Mesh.SecondOrderIncomplete = 0" in refused(serendipity)
    assert "order 3" in refused(user_file(tmp_path / "c.msh", order=3))


def test_flat_cell(tmp_path: Path) -> None:
    """A quadrilateral whose corners are in the wrong order is folded."""
    path = user_file(tmp_path / "a.msh", dimension=2, layers=3, MshFileVersion=2.2)
    lines = path.read_text().splitlines()
    row = next(i for i, line in enumerate(lines) if line.split()[1:3] == ["3", "2"])
    words = lines[row].split()
    words[-1], words[-2] = words[-2], words[-1]
    lines[row] = " ".join(words)
    path.write_text("\n".join(lines) + "\n")
    assert "flat or folded cells, 1 of 18" in refused(path, beam(2))


def test_files_that_are_no_meshes(tmp_path: Path) -> None:
    """Refused without gmsh: it would take a script for its own, and run it."""
    trace = tmp_path / "trace"
    for name, content, message in (
        ("empty", b"", "an empty file"),
        ("junk", random.Random(1).randbytes(10_000), "something else than $MeshFormat"),
        ("script", f'SystemCall "touch {trace}";\n'.encode(), "something else than $MeshFormat"),
    ):
        path = tmp_path / f"{name}.msh"
        path.write_bytes(content)
        assert message in refused(path)
    assert not trace.exists()
    assert "no such file" in refused(tmp_path / "missing.msh")
    assert "found a folder" in refused(tmp_path)


def test_damaged_files(tmp_path: Path) -> None:
    """Cut off anywhere, or filled with junk: a message."""
    good = user_file(tmp_path / "good.msh").read_bytes()
    path = tmp_path / "damaged.msh"
    for share in (0.1, 0.5, 0.9):
        path.write_bytes(good[: int(share * len(good))])
        assert "stops in the middle" in refused(path)
        path.write_bytes(good[: int(share * len(good))] + b"\n$EndElements\n")
        refused(path)
    path.write_bytes(good[: good.index(b"$Elements")])
    assert "no cells" in refused(path)
    path.write_bytes(good[: good.index(b"$Elements") + 40] + random.Random(2).randbytes(500) + b"\n$EndElements\n")
    assert "damaged" in refused(path)


@pytest.mark.parametrize(
    ("program", "message", "seconds"),
    [
        ("import os; os.abort()", "crashes while reading", 120.0),
        ("import time; time.sleep(600)", "does not finish", 1.0),
    ],
)
def test_gmsh_crashes_or_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str, message: str, seconds: float
) -> None:
    """A damaged file can do that to gmsh; it happens in another process, and not for long."""
    monkeypatch.setattr(user_mesh, "_REHEARSAL", program)
    monkeypatch.setattr(user_mesh, "_SECONDS", seconds)
    assert message in refused(user_file(tmp_path / "a.msh"))


SEVERAL = BeamGeometry(
    2,
    LENGTH,
    THICKNESS,
    WIDTH,
    LENGTH,
    spans=(
        ContactSpan("front_below", True, 0.0, SUPPORT),
        ContactSpan("front_above", False, 0.0, SUPPORT),
        ContactSpan("stop_above", False, SUPPORT, LENGTH),
    ),
)


def with_stop(groups: Groups) -> None:
    """Add the upper surface behind the first support."""
    for dim, tag in gmsh.model.getEntities(1):
        x, height, _ = gmsh.model.occ.getCenterOfMass(dim, tag)
        if SUPPORT < x < LENGTH and height > 0.49 * THICKNESS:
            groups.setdefault("stop_above", []).append((dim, tag))


def test_groups_of_several_supports_are_called_as_their_faces(tmp_path: Path) -> None:
    """Each face of a support is a group of the file; one that is missing, misplaced or upside down is named."""
    names = {"body": "body", "base": "front_below", "gland": "front_above", "stop_above": "stop_above"}
    path = user_file(tmp_path / "several.msh", dimension=2, layers=3, names=names, edit=with_stop)
    tagged = read_mesh(COMM, path, SEVERAL)
    assert {name: count for name, count in tagged.facet_counts.items() if count} == {
        "front_below": 3,
        "front_above": 3,
        "stop_above": 3,
    }
    missing = user_file(tmp_path / "missing.msh", dimension=2, names={**NAMES, "base": "front_below"})
    message = refused(missing, SEVERAL)
    assert "front_above (curves) and stop_above (curves)" in message
    turned = {**names, "base": "front_above", "gland": "front_below"}
    message = refused(user_file(tmp_path / "turned.msh", dimension=2, names=turned, edit=with_stop), SEVERAL)
    assert 'Perhaps the names "front_below" and "front_above" are exchanged.' in message
    short = SEVERAL.spans[2]._replace(start=0.1)
    elsewhere = dataclasses.replace(SEVERAL, spans=(*SEVERAL.spans[:2], short))
    assert "from x = 0.1 to x = 0.3 m" in refused(path, elsewhere)
