"""Stress at the surface of beams and frames against beam theory, and the points that have none."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.scene.recorded_places import gauges_of
from gapbeam.solver.scene.surface_stress import von_mises
from tests.scene.solid_grids import PLY, grid, ply_stress, with_sets
from tests.shared.slips import check_refused, put

E, NU, RHO = 2e11, 0.3, 7800.0
STEEL = gb.material(E, RHO, NU)
DRAWN = range(4)


def pipe(draw: np.random.Generator) -> tuple[gb.SpaceSection, float, float, float]:
    """Return a tube or a round bar of any size with its A, I and D."""
    D = 10.0 ** draw.uniform(-3.0, 0.0)
    d = draw.choice([0.0, draw.uniform(0.6, 0.95) * D])
    section = gb.space_section("tube", D, wall=0.5 * (D - d)) if d else gb.space_section("round", D)
    return section, pi / 4 * (D**2 - d**2), pi / 64 * (D**4 - d**4), D


def axes_of(draw: np.random.Generator) -> np.ndarray:
    """Return three directions at right angles: along a member, and two across it."""
    found = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    return np.asarray(found * np.sign(np.linalg.det(found))).T


def stresses(scene: gb.Scene) -> dict[str, np.ndarray]:
    """Return axial stress and shear by twist of each gauge at rest under the loads."""
    q = gb.seat(scene).q[:, 0]
    return {name: (rows @ q)[[0, 5]] for name, rows in gauges_of(scene).items()}


@pytest.mark.parametrize("seed", DRAWN)
def test_forces_at_the_tip_bend_pull_and_twist_a_pipe_of_any_direction(seed: int) -> None:
    """A round cantilever with an arm at its end: N / A, M c / I on four sides, and the shear of the torque."""
    draw = np.random.default_rng(seed)
    section, A, second, D = pipe(draw)
    along, y, z = axes_of(draw)
    length, arm, at = 20.0 * D, 5.0 * D, float(draw.uniform(0.0, 0.9))
    start = draw.normal(size=3) * length
    end = start + length * along
    sides = {"right": y, "top": z, "skew": np.cos(0.7) * y + np.sin(0.7) * z, "bottom": -z}
    stem = gb.frame(
        [start.tolist(), end.tolist(), (end + arm * y).tolist()], section, STEEL,
        {"tip": (length + arm, [z, along])} | {key: (at * length, way) for key, way in sides.items()},
        clamped=[0.0], elements=int(draw.integers(3, 30)), gauges=list(sides),
    )  # fmt: skip
    up, pull = draw.uniform(1.0, 5.0, 2)
    loads = [gb.Force(stem["tip"], up, [1.0, 0.0]), gb.Force(stem["tip"], 20.0 * pull, [0.0, 1.0])]
    found, lever = stresses(gb.Scene(stem, loads=loads)), (1.0 - at) * length
    moment_up, moment_side = up * lever, -20.0 * pull * arm  # the pull beside the axis bends the side of the arm inward
    for key, way in sides.items():
        bent = -(moment_up * (way @ z) + moment_side * (way @ y)) * 0.5 * D / second
        shear = up * arm * 0.5 * D / (2.0 * second)
        size = abs(moment_up) * D / second
        assert found[key][0] == pytest.approx(20.0 * pull / A + bent, rel=1e-7, abs=1e-7 * size), key
        assert abs(found[key][1]) == pytest.approx(shear, rel=1e-7), key


@pytest.mark.parametrize("seed", DRAWN)
@pytest.mark.parametrize("shape", ["rectangle", "tube", "polygon"])
def test_a_straight_beam_is_pressed_on_the_side_to_which_its_tip_is_pushed(shape: str, seed: int) -> None:
    """Stress -F (L - x) c / I on the side of the motion; c is 2 h / 3 of a triangle that stands on its base."""
    draw = np.random.default_rng(seed)
    h = float(10.0 ** draw.uniform(-5.0, 0.0))
    b = h * float(draw.uniform(0.5, 2.0))
    if shape == "tube":
        section, second, c = gb.section("tube", h, wall=0.1 * h), pi / 64 * h**4 * (1.0 - 0.8**4), 0.5 * h
    elif shape == "rectangle":
        section, second, c = gb.section("rectangle", h, b), b * h**3 / 12.0, 0.5 * h
    else:
        corners = [[-0.5 * b, 0.0], [0.5 * b, 0.0], [0.0, h]]
        section, second, c = gb.section("polygon", h, b, points=corners), b * h**3 / 36.0, 2.0 * h / 3.0
    length, at, force = 30.0 * h, float(draw.uniform(0.0, 0.95)), 3.0 * E * b * h * 1e-9
    beam = gb.beam(length, section, STEEL, {"tip": length, "here": at * length}, clamped=[0.0], gauges=["here"])
    found = stresses(gb.Scene(beam, loads=[gb.Force(beam["tip"], force)]))["here"]
    assert found == pytest.approx([-force * (1.0 - at) * length * c / second, 0.0], rel=1e-6)


def test_a_spread_load_misses_its_moment_in_one_element() -> None:
    """Of a pipe under its weight: q (L - x)^2 / 2 less q l^2 / 12, so a quarter with half the elements' length."""
    section, A, second, D = pipe(np.random.default_rng(7))
    length, q = 30.0 * D, RHO * A * 9.81
    missed = []
    for elements in (6, 12):
        bar = gb.frame([[0, 0, 0], [length, 0, 0]], section, STEEL, {"root": (0.0, [0, 0, 1])}, clamped=[0.0],
                       elements=elements, gauges=["root"])  # fmt: skip
        scene = gb.Scene(bar, loads=[gb.BaseMotion(bar, 9.81, direction=[0, 0, 1])])
        exact = 0.5 * q * length**2 * 0.5 * D / second
        missed.append(1.0 - stresses(scene)["root"][0] / exact)
        assert missed[-1] == pytest.approx(1.0 / (6.0 * elements**2), rel=1e-6)
    assert missed[0] / missed[1] == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize("flexibility", [1.0, 8.0])
def test_an_elbow_carries_the_moment_of_the_force_at_its_end(flexibility: float) -> None:
    """The moment is that of statics whatever the elbow gives; along a bend of 90 degrees, on its outer side."""
    D, R, leg = 0.06, 0.2, 0.8
    section = gb.space_section("tube", D, wall=0.004)
    second, A = section.second_moment, section.area
    center, force = np.array([leg - R, R, 0.0]), 40.0
    angles = np.radians([10.0, 45.0, 75.0])
    ways = np.column_stack([np.sin(angles), -np.cos(angles), np.zeros(3)])
    points: dict[str, Any] = {f"g{k}": (tuple(center + R * way), way) for k, way in enumerate(ways)}
    points["tip"] = ((leg, leg, 0.0), [1.0, 0.0, 0.0])
    elbow = gb.frame([[0, 0, 0], [leg, 0, 0], [leg, leg, 0]], section, STEEL, points, bends=R, clamped=[0.0],
                     flexibility=flexibility, gauges=list(points)[:3])  # fmt: skip
    found = stresses(gb.Scene(elbow, loads=[gb.Force(elbow["tip"], force)]))
    for k, (angle, way) in enumerate(zip(angles, ways, strict=True)):
        y = (center + R * way)[1]
        exact = force * np.cos(angle) / A - force * (leg - y) * 0.5 * D / second  # the outer side is pressed
        assert found[f"g{k}"][0] == pytest.approx(exact, rel=2e-4), k
        assert abs(found[f"g{k}"][1]) < 1e-6 * abs(exact)


def test_a_hinged_end_carries_no_moment_and_a_round_beam_bends_in_two_planes() -> None:
    """A strut between a clamped post and its hinge; a round beam with a force across each of its planes."""
    section = gb.space_section("round", 0.02)
    strut = gb.Member([[0, 0, 1], [1, 0, 1]], section, STEEL, hinged=["start"])
    places: dict[str, Any] = {"middle": ((0.5, 0, 1), [0, 0, 1])}
    post = gb.frame([[0, 0, 0], [0, 0, 1]], section, STEEL, places, clamped=[0.0], pinned=[(1, 0, 1)],
                    up=[1.0, 0.0, 0.0], branches=[strut], gauges=["middle"])  # fmt: skip
    load = gb.Force(post["middle"], 10.0)
    middle = stresses(gb.Scene(post, loads=[load]))["middle"][0]
    # the top of the post, on which the hinge pulls, hardly moves: a bar on two hinges has F L / 4
    assert middle == pytest.approx(10.0 / 4.0 * 0.01 / section.second_moment, rel=1e-3)
    given = straight_file()
    given["point"].append({"name": "root", "structure": "bar", "at": 0.0, "stress": True})
    scene = gb.scene(given)
    loads = [gb.Force(scene.point("tip"), 2.0, [1.0, 0.0]), gb.Force(scene.point("tip"), 3.0, [0.0, 1.0])]
    found = stresses(gb.Scene(*scene.structures, loads=loads))
    unit = -0.4 * 0.005 / (pi / 64 * 0.01**4)
    assert found["root 1"] == pytest.approx([2.0 * unit, 0.0], rel=1e-6)
    assert found["root 2"] == pytest.approx([3.0 * unit, 0.0], rel=1e-6)


def straight_file() -> dict[str, Any]:
    """Return tables of a clamped round bar that moves in two planes."""
    return {
        "structure": [{"name": "bar", "model": {
            "type": "beam", "length": 0.4, "thickness": 0.01, "section": "round", "motions": 2,
            "material": {"young_modulus": E, "density": RHO, "poisson_ratio": NU}}}],
        "joint": [{"type": "clamped", "structure": "bar", "at": 0.0}],
        "point": [{"name": "tip", "structure": "bar", "at": 0.4}],
        "time": {"step": 1e-4, "end": 0.01},
    }  # fmt: skip


def shaken_pipe(elements: int, **changes: Any) -> dict[str, Any]:
    """Return tables of a clamped pipe that is shaken at its tip, with its stress."""
    given = {
        "structure": [{"name": "pipe", "model": {
            "type": "frame", "route": [[0, 0, 0], [2, 0, 0]], "thickness": 0.02, "elements": elements,
            "section": {"type": "tube", "wall": 0.002},
            "material": {"young_modulus": E, "density": RHO, "poisson_ratio": NU}}}],
        "joint": [{"type": "clamped", "structure": "pipe", "at": 0.0}],
        "point": [{"name": "tip", "structure": "pipe", "at": 2.0, "direction": [0, 0, 1]},
                  {"name": "mid", "structure": "pipe", "at": 0.7, "direction": [0, 0, 1], "stress": True}],
        "load": [{"name": "push", "type": "harmonic_force", "point": "pipe.tip", "amplitude": 5.0, "frequency": 2.5}],
        "time": {"step": 1e-3, "end": 0.4},
    }  # fmt: skip
    return given | changes


@pytest.mark.parametrize("elements", [20, 105])
def test_stresses_of_a_run_are_those_of_the_forced_beam(
    elements: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cantilever that is shaken slowly: M = F (L - x) and inertia, by the modes of Euler-Bernoulli; sparse and dense.

    Records, error estimates and the Python history have the same stress.
    """
    given = shaken_pipe(elements)
    monkeypatch.delenv("GAPBEAM_ERRORS", raising=False)
    outcome = gb.run(given, output=tmp_path / "run")
    stress, von_mises = (outcome.history[name].values[:, 0] for name in ("axial_stress", "von_mises_stress"))
    assert list(outcome.history["gauge"].values) == ["mid"]
    np.testing.assert_allclose(von_mises, np.abs(stress), rtol=1e-9, atol=1e-9 * np.abs(stress).max())
    D, d, length = 0.02, 0.016, 2.0
    second, area, t = pi / 64 * (D**4 - d**4), pi / 4 * (D**2 - d**2), outcome.history["time"].values
    exact, x = np.zeros_like(t), 0.7
    w0 = 5.0 * pi
    for root in (1.875104068711961, 4.694091132974174, 7.854757438237613, 10.995540734875467, 14.13716839104647):
        b, c = root / length, (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))

        def shape(s: float, b: float = b, c: float = c) -> float:
            return float(np.cosh(b * s) - np.cos(b * s) - c * (np.sinh(b * s) - np.sin(b * s)))

        w = b**2 * np.sqrt(E * second / (RHO * area))
        curved = b**2 * (np.cosh(b * x) + np.cos(b * x) - c * (np.sinh(b * x) + np.sin(b * x)))
        q = shape(length) * 5.0 / (RHO * area * length) * (np.sin(w0 * t) - w0 / w * np.sin(w * t)) / (w**2 - w0**2)
        exact += -E * curved * 0.5 * D * q
    assert np.abs(stress - exact).max() < 0.01 * np.abs(exact).max()
    scene = gb.scene(given)
    moved = gb.history(scene, 1e-3, 0.4)
    np.testing.assert_allclose(moved.stress["mid"], stress[1:], rtol=1e-9, atol=1e-9 * np.abs(stress).max())
    errors = {one["name"]: one for one in outcome.summary["errors"]["figures"]}
    assert errors["mid peak-to-peak axial stress"]["value"] == pytest.approx(np.ptp(stress), rel=1e-9)


def test_stresses_pass_through_reduction_masses_and_places(tmp_path: Path) -> None:
    """A reduced pipe with a mass, in a gap: as all of its DOFs have, up to what its modes leave out."""
    given = shaken_pipe(20)
    given["pair"] = [{"name": "stop", "between": ["pipe.tip"], "region": {"type": "slot", "clearance": 1e-3},
                      "law": {"type": "kelvin-voigt", "stiffness": 2e4}}]  # fmt: skip
    given["mass"] = [{"point": "pipe.mid", "mass": 0.2}]
    whole = gb.run(given, output=tmp_path / "whole")
    given["structure"][0] |= {"reduce": {"modes": 40}}
    fewer = gb.run(given, output=tmp_path / "fewer")
    one, other = (run.history["axial_stress"].values[:400, 0] for run in (whole, fewer))
    assert np.abs(other - one).max() < 2e-3 * np.abs(one).max()


def test_contacts_that_move_along_a_beam_leave_its_stresses_recorded(tmp_path: Path) -> None:
    """A slow mass on a bridge of stiff steel: at mid-span P L / 4 as it passes, up to its inertia."""
    bridge = gb.beam(2.0, gb.section("rectangle", 0.05, 0.05), STEEL, {f"p{k}": 0.05 * k for k in range(41)},
                     pinned=[0.0, 2.0], gauges=["p20"], name="bridge")  # fmt: skip
    road = gb.moving_point([bridge[f"p{k}"] for k in range(41)], list(0.05 * np.arange(41)), lambda t: 0.9 + 0.4 * t)
    block = gb.mass(2.0, name="block")
    gap = gb.Contact((block["at"], road), gb.HalfPlane(0.0), gb.KelvinVoigt(1e6, 1e3), name="wheel")
    scene = gb.Scene(bridge, block, contacts=[gap], loads=[gb.BaseMotion(block, 9.81)])
    outcome = gb.run(scene, step=2e-4, end=0.5, output=tmp_path / "run")
    at_middle = float(outcome.history["axial_stress"].sel(time=0.25, method="nearest").values[0])
    force = float(outcome.history["contact_force"].sel(time=0.25, method="nearest").values[0])
    exact = force * 2.0 / 4.0 * 0.025 / (0.05**4 / 12.0)
    assert abs(at_middle) == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize(
    ("change", "where", "words"),
    [
        (put("point", 1, "at", value=0.0), '"mid"', "place farther from it"),
        (put("structure", 0, "model", "section", value="rectangle"), '"mid"', "type round or tube"),
        (put("point", 1, "direction", value=[1, 0, 0]), '"mid"', "direction across it"),
        (put("point", 1, "speed", value=0.1), '"mid".*stress', "a point that moves"),
        (put("point", 1, "stress", value=1), '"mid".*stress', "true or false"),
        (put("joint", 1, value={"type": "clamped", "structure": "pipe", "at": 0.7}), '"mid"', "jumps there"),
        (put("member", value=[{"structure": "pipe", "route": [[0.7, 0, 0], [0.7, 1, 0]]}]), '"mid"', "jumps there"),
    ],
    ids=["clamp that moves", "not round", "along", "moves", "no switch", "clamp inside", "branch"],
)
def test_stresses_that_are_not_known_are_refused(change: Any, where: str, words: str, tmp_path: Path) -> None:
    """At the key of the point, with what would work."""
    given = shaken_pipe(20)
    given["joint"].append({"type": "pinned", "structure": "pipe", "at": 2.0})
    given["joint"][0]["name"] = "foot"
    given["load"] = [{"name": "shake", "type": "support_motion", "support": "foot", "amplitude": 1e-3,
                      "frequency": 2.0, "direction": [0, 0, 1]}]  # fmt: skip
    change(given, tmp_path)
    check_refused(given, where, words)


@pytest.mark.parametrize("model", ["rigid", "mass"])
def test_models_without_a_bent_section_are_refused(model: str) -> None:
    """A rigid bar has no strain, a mass no section; from Python own figures need the distance of the surface."""
    given = straight_file()
    given["joint"] = []
    given["structure"][0]["model"] = (
        {"type": "mass", "mass": 1.0} if model == "mass" else
        {"type": "rigid", "length": 0.4, "thickness": 0.01, "material": given["structure"][0]["model"]["material"]}
    )  # fmt: skip
    given["point"][0]["stress"] = True
    check_refused(given, '"tip".*stress', "a model beam, frame or mesh")
    own = gb.CrossSection(1e-4, 1e-10)
    with pytest.raises(gb.UserError, match="distance of its surface"):
        gb.beam(1.0, own, STEEL, {"a": 0.5}, clamped=[0.0], gauges=["a"])
    with pytest.raises(gb.UserError, match="no point of it"):
        gb.beam(1.0, own, STEEL, {"a": 0.5}, clamped=[0.0], gauges=["b"])


def of_tensor(sigma: np.ndarray) -> float:
    """Return the von Mises stress by the deviator, sqrt(3 s : s / 2)."""
    s = sigma - np.trace(sigma) / 3.0 * np.eye(3)
    return float(np.sqrt(1.5 * np.sum(s * s)))


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27"])
def test_solids_have_the_stress_of_their_strain_along_any_direction(kind: str, tmp_path: Path) -> None:
    """Uniform strain of an orthotropic mesh that is turned in space: exact in cells of any shape and order."""
    draw = np.random.default_rng(3)
    mesh = grid(kind, (3, 2, 2), (0.3, 0.2, 0.1), 0.25)
    mesh.write(tmp_path / "ply.vtk")
    gradient = 1e-4 * draw.uniform(-1.0, 1.0, (3, 3))
    own, ways = ply_stress(0.5 * (gradient + gradient.T)), axes_of(draw)
    place = gb.Pose(origin=[1.0, 2.0, 3.0], axis=[0.0, 3.0, 4.0], across=[1.0, 0.0, 0.0])
    sigma = place.turn @ own @ place.turn.T
    points = {"one": {"node": 8, "direction": ways[:2]}, "other": {"node": 20, "direction": ways[2]}}
    found = gb.from_mesh(tmp_path / "ply.vtk", PLY, units="m", place=place, points=points, gauges=list(points))
    u = (mesh.points @ gradient.T).ravel()
    for key, some in (("one", ways[:2]), ("other", ways[2:])):
        stress = (found.gauges[key] @ u).reshape(-1, 6)
        assert stress[:, 0] == pytest.approx([way @ sigma @ way for way in some], rel=1e-9)
        assert von_mises(stress) == pytest.approx([of_tensor(sigma)] * len(some), rel=1e-9)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("kind", ["triangle6", "quad9"])
def test_cells_of_order_two_in_a_plane_have_linear_stresses(kind: str, plane: str, tmp_path: Path) -> None:
    """Pure bending, u_x = k x y: the stress across the plane is 0, or nu times the sum."""
    E, nu, k = 7e10, 0.33, 2e-3
    mesh = grid(kind, (3, 3), (0.3, 0.2))
    mesh.write(tmp_path / "sheet.vtk")
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    node = int(np.abs(np.hypot(x - 0.1, y - 0.2)).argmin())
    found = gb.from_mesh(
        tmp_path / "sheet.vtk", gb.material(E, 2700.0, nu), units="m", plane=plane, thickness=0.01,
        points={"top": {"node": node + 1, "direction": [1.0, 0.0, 0.0]}}, gauges=["top"],
    )  # type: ignore[arg-type] # fmt: skip
    u = np.column_stack([k * x * y, np.zeros_like(x)]).ravel()
    xx, xy = k * y[node], k * x[node]
    if plane == "stress":
        sx, sy = E / (1.0 - nu**2) * xx, nu * E / (1.0 - nu**2) * xx
        sz = 0.0
    else:
        factor = E / (1.0 + nu) / (1.0 - 2.0 * nu)
        sx, sy = factor * (1.0 - nu) * xx, factor * nu * xx
        sz = nu * (sx + sy)
    shear = E / 2.0 / (1.0 + nu) * xy
    sigma = np.array([[sx, shear, 0.0], [shear, sy, 0.0], [0.0, 0.0, sz]])
    stress = found.gauges["top"] @ u
    assert stress[0] == pytest.approx(sx, rel=1e-9)
    assert von_mises(stress) == pytest.approx(of_tensor(sigma), rel=1e-9)


def block_file(folder: Path) -> dict[str, Any]:
    """Return tables of a clamped block of two groups of cells, with a stress at its upper surface."""
    mesh = grid("hexahedron20", (20, 1, 2), (0.4, 0.02, 0.02))
    middle = mesh.points[mesh.cells[0].data[:, :8], 0].mean(axis=1)
    mesh.cell_sets = {"NEAR": [np.flatnonzero(middle < 0.3)], "FAR": [np.flatnonzero(middle > 0.3)]}
    with_sets(mesh, ROOT=lambda x, *_: x == 0.0, TIP=lambda x, *_: x > 0.399)
    mesh.write(folder / "block.inp")
    steel = {"young_modulus": E, "poisson_ratio": NU, "density": RHO}
    return {
        "structure": [{"name": "block", "reduce": {"modes": 10}, "model": {
            "type": "mesh", "file": str(folder / "block.inp"), "units": "m",
            "materials": [{"group": "NEAR", **steel}, {"group": "FAR", **steel, "young_modulus": 0.5 * E}]}}],
        "joint": [{"type": "clamped", "structure": "block", "nodes": "ROOT"}],
        "point": [{"name": "tip", "structure": "block", "set": "TIP", "direction": [0, 0, 1]},
                  {"name": "top", "structure": "block", "nearest": [0.1, 0.01, 0.02], "direction": [1, 0, 0],
                   "stress": True}],
        "load": [{"name": "push", "type": "constant_force", "point": "block.tip", "amplitude": 100.0}],
        "start": {"state": "seat"},
        "time": {"step": 1e-4, "end": 0.01},
    }  # fmt: skip


def test_a_meshed_cantilever_has_the_stress_of_its_beam(tmp_path: Path) -> None:
    """M c / I within 1 % at a quarter of its length, away from clamp and force, at rest, from a file, reduced."""
    history = gb.run(block_file(tmp_path), output=tmp_path / "run").history
    exact = -100.0 * 0.3 * 0.01 / (0.02**4 / 12.0)
    found = history["axial_stress"].values[:, 0]
    np.testing.assert_allclose(found, exact, rtol=0.01)
    np.testing.assert_allclose(history["von_mises_stress"].values[:, 0], abs(exact), rtol=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (put("point", 1, "nearest", value=[0.3, 0.01, 0.02]), "several materials meet"),
        (
            put("point", 1, value={"name": "top", "structure": "block", "dof": "393.1", "stress": True}),
            "single DOFs",
        ),
    ],
    ids=["two materials", "single DOF"],
)
def test_stresses_of_meshes_that_are_not_known_are_refused(change: Any, words: str, tmp_path: Path) -> None:
    """At the key of the point, with what would work."""
    given = block_file(tmp_path)
    change(given, tmp_path)
    check_refused(given, '"top"', words)
