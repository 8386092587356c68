"""Errors of runs include the mesh of a file: closed forms of beams lie within them, however coarse the mesh is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse.linalg as sla

import gapbeam as gb
from gapbeam.solver.scene import finer_mesh
from gapbeam.solver.scene.mesh_files import read_mesh
from gapbeam.solver.scene.mesh_structure import mesh_model
from gapbeam.solver.scene.solid_cells import KINDS
from gapbeam.solver.scene_file.scene_reader import read_scene
from tests.scene.solid_grids import grid, with_sets

YOUNG, LENGTH, HIGH, FORCE = 7e10, 0.2, 0.02, 100.0
SOFT = gb.material(YOUNG, 2700.0, 0.0)  # without contraction a clamp holds nothing but the beam
KIND_NAMES = [name for name in KINDS if not name.endswith(("9", "27"))]


def block(folder: Path, kind: str, across: int, distortion: float = 0.0) -> Path:
    """Write a block, ten times as long as high, with `across` cells across."""
    counts = (5 * across, *(across,) * (KINDS[kind].dimension - 1))
    mesh = grid(kind, counts, (LENGTH, *(HIGH,) * (len(counts) - 1)), distortion)
    with_sets(mesh, ROOT=lambda x, *_: x == 0.0, TIP=lambda x, *_: x > 0.999 * LENGTH)
    file = folder / f"{kind}-{across}.vtk"
    mesh.point_data = {"side": np.select([mesh.points[:, 0] == 0.0, mesh.points[:, 0] > 0.999 * LENGTH], [1, 2])}
    mesh.point_sets = {}
    mesh.write(file)
    return file


def in_plane(kind: str) -> dict[str, Any]:
    """Return the keys of cells in the plane."""
    return {"plane": "stress", "thickness": HIGH} if KINDS[kind].dimension == 2 else {}


@pytest.mark.parametrize("kind", KINDS)
def test_a_finer_mesh_is_the_same_body(kind: str, tmp_path: Path) -> None:
    """Volume and clamped face are the same, cells have a volume, and the tip is softer, as all motions are kept."""
    file = block(tmp_path, kind, 2, 0.15)
    coarse = read_mesh(file)
    fine = finer_mesh.finer_mesh(coarse)
    rules = [one.made(1.0) for one in (coarse, fine)]
    volumes = [float((one.jacobians @ one.weights).sum()) for one in rules]
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-12)
    assert rules[1].jacobians.min() > 0.0
    assert fine.labels[: len(coarse.labels)] == coarse.labels
    assert len(fine.labels) > len(coarse.labels)
    held = [one for one, at in fine.nodes.places.items() if abs(at[0]) < 1e-9 * LENGTH]
    assert sorted(fine.nodes.sets["SIDE:1"]) == sorted(held)
    way = [0.0, 1.0, 0.0]
    softness = []
    for finer in (False, True):
        model = mesh_model(
            file,
            SOFT,
            units="m",
            place=None,
            name="",
            finer=finer,
            **{"plane": None, "thickness": None, **in_plane(kind)},
        )
        body, _ = model.structure({"tip": {"set": "side:2", "direction": way}}, ["side:1"], None)
        row = body["tip"].rows[0]
        softness.append(float(row @ sla.spsolve(body.K.tocsc(), row)))
    assert softness[0] < softness[1] < 1.01 * beam_softness()
    assert softness[1] > 0.7 * beam_softness()


def tables(file: Path, kind: str, **keys: Any) -> dict[str, Any]:
    """Return a clamped block whose tip a force presses onto a spring."""
    materials = [{"young_modulus": YOUNG, "poisson_ratio": 0.0, "density": 2700.0}]
    model = {"type": "mesh", "file": str(file), "units": "m", "materials": materials, **in_plane(kind)}
    law = {"type": "kelvin-voigt", "stiffness": 3e5}
    return {
        "structure": [{"name": "bar", "model": model, "reduce": {"modes": 6}, "ratio": 0.02}],
        "point": [{"name": "tip", "structure": "bar", "set": "side:2", "direction": [0.0, 1.0, 0.0]}],
        "joint": [{"type": "clamped", "structure": "bar", "nodes": "side:1"}],
        "pair": [
            {"name": "stop", "between": ["bar.tip"], "region": {"type": "half-plane", "clearance": 0.0}, "law": law}
        ],
        "load": [{"type": "constant_force", "point": "bar.tip", "amplitude": FORCE}],
        "time": {"end": 2e-3, "step": 1e-5},
        "start": {"state": "seat"},
    } | keys


def beam_softness() -> float:
    """Return the deflection of Timoshenko's cantilever by a unit force at its tip, m/N."""
    area, second = HIGH**2, HIGH**4 / 12.0
    return LENGTH**3 / (3.0 * YOUNG * second) + LENGTH / (5.0 / 6.0 * 0.5 * YOUNG * area)


def stop_force() -> float:
    """Return the force on the spring by beam theory, N."""
    return FORCE * 3e5 / (3e5 + 1.0 / beam_softness())


@pytest.mark.parametrize("across", [1, 2])
@pytest.mark.parametrize("kind", KIND_NAMES)
def test_errors_cover_the_mesh(kind: str, across: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The force by beam theory is within the error of the force of the mesh."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    found = gb.run(tables(block(tmp_path, kind, across), kind), output=tmp_path / "run")
    force = next(one for one in found.figures if one["name"] == "stop largest recorded force")
    assert abs(force["value"] - stop_force()) <= force["error"] + 2e-3 * stop_force()
    assert force["error"] < (3e-2 if KINDS[kind].order == 2 else 2.0) * stop_force()
    assert not [one for one in found.summary["warnings"] if "leave out" in one or "left out" in one]


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_errors_cover_the_mesh_of_a_rattle(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each figure of a shaken coarse mesh is within its error of the figure of a fine mesh of order 2."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    found = []
    for name, across in ((kind, 2), ("quad8", 4)):
        given = tables(block(tmp_path, name, across), name, start={"state": "rest"}, time={"end": 0.03, "step": 2e-5})
        given["load"] = [{"type": "harmonic_force", "point": "bar.tip", "amplitude": FORCE, "frequency": 100.0}]
        given["pair"][0]["region"]["clearance"] = 1e-4
        found.append(gb.run(given, output=tmp_path / name).figures)
    right = {(one["span"], one["name"]): one for one in found[1]}
    compared = [one for one in found[0] if one["error"] is not None and (one["span"], one["name"]) in right]
    assert len(compared) >= 3
    for one in compared:
        exact = right[one["span"], one["name"]]
        assert abs(one["value"] - exact["value"]) <= one["error"] + (exact["error"] or 0.0), one["name"]


def test_meshes_whose_errors_are_left_out_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A mesh that is not reduced, or too large for a finer one, is a warning, and a finer one that fails is another."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    file = block(tmp_path, "quad", 1)
    whole, small = tables(file, "quad"), tables(file, "quad")
    del whole["structure"][0]["reduce"], whole["structure"][0]["ratio"]
    gb.scene(whole)
    assert "errors of figures leave out its mesh of 24 motions, as it is not reduced" in caplog.text
    monkeypatch.setattr(finer_mesh, "MOST_MOTIONS", 95)
    gb.scene(small)
    assert "its mesh of 24 motions, as it is too large for a finer one" in caplog.text
    monkeypatch.setattr(finer_mesh, "MOST_MOTIONS", 96)

    def failing(mesh: object) -> None:
        raise gb.UserError(f"found {type(mesh).__name__}, expected another")

    monkeypatch.setattr("gapbeam.solver.scene.mesh_structure.finer_mesh", failing)
    said = str(gb.run(small, output=tmp_path / "failed").summary["warnings"])
    assert "the comparison run with finer structures failed, and its errors are left out" in said


@pytest.mark.parametrize("slips", [0.0, 0.3])
@pytest.mark.parametrize(
    ("kind", "other"), [("quad8", "quad"), ("quad", "quad8"), ("triangle6", "quad"), ("hexahedron20", "hexahedron")]
)
def test_faces_of_finer_meshes_touch_at_the_same_points(kind: str, other: str, slips: float, tmp_path: Path) -> None:
    """A block that lies on another is pressed by its weight evenly: each corner carries its share, finer or not."""
    d = KINDS[kind].dimension
    bodies, weight = [], 9810.0
    for name, cells, across, low in (("lid", kind, 3, 1.0), ("base", other, 2, 0.0)):
        mesh = grid(cells, (across,) * d, (1.0,) * d)
        mesh.points[:, d - 1] += low
        up = mesh.points[:, d - 1] - low
        mesh.point_data = {"side": np.select([up == 0.0, up == 1.0], [1, 2])}
        mesh.write(tmp_path / f"{name}.vtk")
        material = {"young_modulus": 1e7, "poisson_ratio": 0.0, "density": 1000.0}
        model = {"type": "mesh", "file": str(tmp_path / f"{name}.vtk"), "units": "m", "materials": [material]}
        model |= {"plane": "stress", "thickness": 1.0} if d == 2 else {}
        bodies.append({"name": name, "model": model, "reduce": {"modes": 6}, "ratio": 0.1})
    joints = [{"type": "clamped", "structure": "base", "nodes": "side:1"}]
    face = {"between": ["lid.side:1", "base.side:2"], "at": "faces", "law": {"type": "kelvin-voigt", "stiffness": 1e9}}
    down = [0.0] * (d - 1) + [-1.0] + [0.0] * (3 - d)
    given = {
        "structure": bodies,
        "joint": joints,
        "pair": [{"name": "seat", **face, "friction": slips}],
        "load": [{"type": "gravity", "direction": down}],
        "time": {"end": 1e-2, "step": 1e-4},
        "start": {"state": "seat"},
    }
    read = read_scene(given)
    assert read.finer is not None
    for scene in (read.scene, read.finer().scene):
        force = -np.asarray(gb.seat(scene).F)[:, 0]
        share = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
        shares = share if d == 2 else np.outer(share, share).ravel()
        normal = np.sort(force[np.abs(force) > 1e-3 * weight])  # the others are friction
        assert normal == pytest.approx(np.sort(weight * shares), rel=1e-6)
