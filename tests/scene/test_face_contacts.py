"""Faces of two meshes that do not match: patch tests, and two rings under pressure against Lame's solution."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gmsh
import meshio
import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.scene.solid_cells import FACETS, KINDS, facet_of, rule_of, shapes_at
from gapbeam.solver.scene_file.scene_reader import read_scene
from gapbeam.solver.system.operators import Array
from tests.scene.solid_grids import grid, with_sets
from tests.shared.slips import Change, check_slip, put

YOUNG, POISSON, PRESSURE = 2e11, 0.3, 1e6
STEEL = gb.material(YOUNG, 7800.0, POISSON)
STIFF = 1e14  # Pa/m


def pressed(mesh: meshio.Mesh, kind: str, on: Array, nodal: dict[int, Array], pressure: float) -> None:
    """Add the nodal forces of a pressure on the facets whose nodes are all marked."""
    facet, local = facet_of(KINDS[kind])
    points, weights = rule_of(4, FACETS[facet].dimension, FACETS[facet].simplex)
    values, slopes = shapes_at(facet, points)
    every = np.concatenate([mesh.cells[0].data[:, list(one)] for one in local])
    for nodes in every[on[every].all(axis=1)]:
        along = np.einsum("pdn,nx->pdx", slopes, mesh.points[nodes])
        if along.shape[1] == 1:
            area = np.column_stack([along[:, 0, 1], -along[:, 0, 0], 0.0 * along[:, 0, 0]])
        else:
            area = np.cross(along[:, 0], along[:, 1])
        force = -pressure * np.einsum("p,pn,px->nx", weights, values, area)
        for node, one in zip(nodes, force, strict=True):
            nodal[int(node)] = nodal.get(int(node), np.zeros(3)) + one


def loads(one: gb.Structure, nodal: dict[int, Array]) -> gb.Load:
    """Return forces at nodes as a load."""
    assert one.geometry is not None
    pattern = np.zeros(3 * len(one.geometry.places))
    for node, force in nodal.items():
        pattern[3 * node : 3 * node + 3] = force
    return gb.Load(one, np.asarray(one.geometry.rows.T @ pattern), 1.0, name=f"pressure-{one.name}")


DEPTH = PRESSURE / STIFF
PER_AREA = [
    ("triangle", STIFF, DEPTH),
    ("quad8", STIFF, DEPTH),
    ("hexahedron", STIFF, DEPTH),
    ("tetra10", STIFF, DEPTH),
    ("quad8", gb.Cubic(stiffness=STIFF, scale=2.0 * DEPTH), 2.0 * DEPTH * 0.42385380),  # y + y^3 = 1/2
    ("quad8", gb.HuntCrossley(stiffness=STIFF / DEPTH**0.5, chi=1.0), DEPTH),
]


@pytest.mark.parametrize(("kind", "law", "depth"), PER_AREA)
def test_a_constant_pressure_crosses_flat_faces_of_other_meshes(
    tmp_path: Path, kind: str, law: Any, depth: float
) -> None:
    """Patch test: a column of two blocks whose facets do not match is as short as one, less what the law gives."""
    d, sizes = KINDS[kind].dimension, [(0.1, 0.04), (0.1, 0.06)]
    counts = [((3, 2), (5, 2)), ((2, 2, 1), (3, 3, 1))][d - 2]
    bodies, flat = [], {"plane": "stress", "thickness": 1.0} if d == 2 else {}
    up = d - 1
    for name, count, (wide, high) in zip("ab", counts, sizes, strict=True):
        size = (wide,) * up + (high,)
        mesh = with_sets(grid(kind, count, size, 0.0), TOP=lambda *x, high=high: x[up] > 0.999 * high,
                         BOTTOM=lambda *x: x[up] < 1e-9)  # fmt: skip
        shift = np.zeros(3)
        shift[up] = 0.0 if name == "a" else 0.04
        held = [f"{i + 1}.{k + 1}" for k in range(up) for i in np.flatnonzero(mesh.points[:, k] < 1e-9)]
        if name == "a":
            held += [f"{i + 1}.{d}" for i in np.flatnonzero(mesh.points[:, up] < 1e-9)]
        mesh.points[:, 0] *= 0.6 + 4.0 * mesh.points[:, 0]  # facets of several sizes, whose sides stay straight
        for k, one in enumerate(KINDS[kind].between, len(KINDS[kind].corners)):
            mesh.points[mesh.cells[0].data[:, k]] = mesh.points[mesh.cells[0].data[:, list(one)]].mean(axis=1)
        mesh.points += shift
        write(mesh, tmp_path / f"{name}.vtk")
        body = gb.from_mesh(tmp_path / f"{name}.vtk", STEEL, units="m", clamped=held, name=name, **flat)
        bodies.append((body, mesh))
    (a, _), (b, above) = bodies
    nodal: dict[int, Array] = {}
    pressed(above, kind, above.points[:, up] > 0.0999, nodal, PRESSURE)
    contacts = gb.face_contacts((b, "BOTTOM:1"), (a, "TOP:1"), law)
    scene = gb.Scene(a, b, contacts=contacts, loads=[loads(b, nodal)])
    state = gb.seat(scene)
    force = np.abs(state.F[:, 0])
    areas = np.array([one.law.values[0] for one in contacts]) / (law if law == STIFF else law.values[0])
    assert areas.sum() == pytest.approx(0.1**up, rel=1e-12)
    assert np.abs(force / areas / PRESSURE - 1.0).max() < 1e-8
    strain = PRESSURE / YOUNG
    for number, (body, mesh) in enumerate(bodies):
        assert body.geometry is not None
        q = state.q[scene.start[number] : scene.start[number + 1], 0]
        u = body.geometry.displacements(q if scene.is_large else body.modes[2] @ q)
        wanted = POISSON * strain * mesh.points
        wanted[:, up] = -strain * mesh.points[:, up] - number * depth
        assert np.abs(u - wanted)[:, :d].max() < 1e-8 * np.abs(wanted).max()


def write(mesh: meshio.Mesh, path: Path) -> None:
    """Write a mesh with its sets as marks, which are called "TOP:1"."""
    marks = {name: np.isin(np.arange(len(mesh.points)), some).astype(int) for name, some in mesh.point_sets.items()}
    meshio.Mesh(mesh.points, mesh.cells, point_data=marks).write(path)


def ring(folder: Path, name: str, kind: str, around: int, through: int, radii: tuple[float, float]) -> Any:
    """Return a quarter of a ring in plane strain, and its mesh, from a grid that is bent."""
    mesh = grid(kind, (through, around), (1.0, 1.0))
    r = radii[0] + (radii[1] - radii[0]) * mesh.points[:, 0]
    turn = 0.5 * np.pi * mesh.points[:, 1]
    inner, outer = mesh.points[:, 0] < 1e-9, mesh.points[:, 0] > 1.0 - 1e-9
    held = [f"{i + 1}.2" for i in np.flatnonzero(mesh.points[:, 1] < 1e-9)]
    held += [f"{i + 1}.1" for i in np.flatnonzero(mesh.points[:, 1] > 1.0 - 1e-9)]
    mesh.points = np.column_stack([r * np.cos(turn), r * np.sin(turn), 0.0 * r])
    mesh.point_sets = {"INNER": np.flatnonzero(inner), "OUTER": np.flatnonzero(outer)}
    write(mesh, folder / f"{name}.vtk")
    body = gb.from_mesh(folder / f"{name}.vtk", STEEL, units="m", clamped=held, name=name, plane="strain",
                        thickness=1.0)  # fmt: skip
    return body, mesh, inner


def opened(folder: Path, kind: str, n: int, whole: bool) -> float:
    """Return how far the opening of the bore of a bush in a housing is off Lame's answer, at its worst node."""
    a, b = 0.05, 0.1
    lame = PRESSURE * a * (1 + POISSON) / YOUNG * ((1 - 2 * POISSON) * a**2 + b**2) / (b**2 - a**2)
    bush, mesh, inner = ring(folder, "bush", kind, 4 * n, (5 if whole else 2) * n, (a, b if whole else 0.07))
    nodal: dict[int, Array] = {}
    pressed(mesh, kind, inner, nodal, PRESSURE)
    bodies, pairs = [bush], []
    if not whole:
        bodies.append(ring(folder, "house", kind, 3 * n, 2 * n, (0.07, b))[0])
        pairs = gb.face_contacts((bush, "OUTER:1"), (bodies[1], "INNER:1"), 1e6 * YOUNG / a, clearance=0.0)
    scene = gb.Scene(*bodies, contacts=pairs, loads=[loads(bush, nodal)])
    q = gb.seat(scene).q[: scene.start[1], 0]
    assert bush.geometry is not None
    u = bush.geometry.displacements(q if scene.is_large else bush.modes[2] @ q)
    found = (u[inner] * mesh.points[inner]).sum(axis=1) / a
    return float(np.abs(found / lame - 1.0).max())


@pytest.mark.parametrize(("kind", "order", "most"), [("quad", 1.9, 2e-3), ("quad9", 3.0, 1e-6)])
def test_a_bush_in_a_housing_is_as_stiff_as_one_mesh(tmp_path: Path, kind: str, order: float, most: float) -> None:
    """Curved faces, four facets to three: the error against Lame's solution, beside that of one mesh of both."""
    two, one = ([opened(tmp_path, kind, n, whole) for n in (1, 2, 4)] for whole in (False, True))
    assert two[-1] < most, two
    assert np.log2(two[0] / two[-1]) / 2.0 > order, two
    assert all(a < 2.0 * b for a, b in zip(two, one, strict=True)), (two, one)


def shell(folder: Path, name: str, radii: tuple[float, float], size: float) -> Any:
    """Return an eighth of a hollow sphere in tetrahedra of degree 2, its mesh, and the nodes of its inner face."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        inside, outside = ((3, gmsh.model.occ.addSphere(0, 0, 0, r, -1, 0.0, np.pi / 2, np.pi / 2)) for r in radii)
        gmsh.model.occ.cut([outside], [inside])
        gmsh.model.occ.synchronize()
        for key in ("MeshSizeMin", "MeshSizeMax"):
            gmsh.option.setNumber(f"Mesh.{key}", size)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        tags, x, _ = gmsh.model.mesh.getNodes()
        cells = gmsh.model.mesh.getElementsByType(11)[1].reshape(-1, 10)[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    finally:
        gmsh.finalize()
    used, cells = np.unique(cells, return_inverse=True)
    x = x.reshape(-1, 3)[np.argsort(tags)[np.searchsorted(np.sort(tags), used)]]
    inner, outer = (np.abs(np.linalg.norm(x, axis=1) - r) < 1e-9 for r in radii)
    mesh = meshio.Mesh(x, [("tetra10", cells.reshape(-1, 10))])
    mesh.point_sets = {"INNER": np.flatnonzero(inner), "OUTER": np.flatnonzero(outer)}
    write(mesh, folder / f"{name}.vtk")
    held = [f"{i + 1}.{k + 1}" for k in range(3) for i in np.flatnonzero(np.abs(x[:, k]) < 1e-9)]
    return gb.from_mesh(folder / f"{name}.vtk", STEEL, units="m", clamped=held, name=name), mesh, inner


@pytest.mark.slow(minutes=0.3)
def test_a_sphere_in_a_sphere_is_as_stiff_as_one(tmp_path: Path) -> None:
    """Faces curved both ways, whose facets do not match, against Lame's hollow sphere: 0.6 %, and order 2."""
    a, c, b, errors = 0.05, 0.07, 0.1, []
    lame = PRESSURE * a**3 / (YOUNG * (b**3 - a**3)) * ((1 - 2 * POISSON) * a + (1 + POISSON) * b**3 / (2 * a**2))
    for size in (0.024, 0.013):
        bush, mesh, inner = shell(tmp_path, "bush", (a, c), 0.8 * size)
        house = shell(tmp_path, "house", (c, b), size)[0]
        nodal: dict[int, Array] = {}
        pressed(mesh, "tetra10", inner, nodal, PRESSURE)
        pairs = gb.face_contacts((bush, "OUTER:1"), (house, "INNER:1"), 1e4 * YOUNG / a, clearance=0.0)
        state = gb.seat(gb.Scene(bush, house, contacts=pairs, loads=[loads(bush, nodal)]))
        assert bush.geometry is not None
        u = bush.geometry.displacements(state.q[: bush.size, 0])
        errors.append(np.abs((u[inner] * mesh.points[inner]).sum(axis=1) / a / lame - 1.0).max())
    assert errors[1] < 6e-3, errors
    assert np.log(errors[0] / errors[1]) / np.log(0.024 / 0.013) > 1.5, errors


def test_faces_that_do_not_meet_are_refused(tmp_path: Path) -> None:
    """Unknown faces, faces that look away, and faces that lie in each other."""
    write(with_sets(grid("quad", (2, 2), (0.1, 0.1)), TOP=lambda *x: x[1] > 0.0999, LOW=lambda *x: x[1] < 1e-9),
          tmp_path / "a.vtk")  # fmt: skip

    def block(shift: float) -> gb.Structure:
        return gb.from_mesh(tmp_path / "a.vtk", STEEL, units="m", plane="strain", thickness=1.0,
                            place=gb.Pose((0.0, shift, 0.0)))  # fmt: skip

    a, b, inside = block(0.0), block(0.1), block(0.08)
    wrong: list[tuple[Any, Any, dict[str, Any], str]] = [
        ((a, "SIDE"), (b, "LOW:1"), {}, "one of TOP:0, TOP:1"),
        ((gb.mass(1.0), "TOP"), (b, "LOW:1"), {}, "from_mesh"),
        ((a, "TOP:1"), (b, "TOP:1"), {}, "do not lie before each other"),
        ((a, "TOP:1"), (inside, "LOW:1"), {}, "lie in each other by 0.02 m"),
        ((a, "TOP:1"), (b, "LOW:1"), {"stiffness": -1.0}, "stiffness"),
    ]
    for first, second, more, words in wrong:
        with pytest.raises(gb.UserError, match=words):
            gb.face_contacts(first, second, **{"stiffness": 1e13, **more})
    assert len(gb.face_contacts((a, "TOP:1"), (inside, "LOW:1"), 1e13, clearance=-1e-5)) == 3
    for argument in ("first", "second", "stiffness", "damping", "clearance", "name"):
        for value in (np.nan, "a", [], [1, 2], np.ones((1, 2)), abs, object()):
            given = {"first": (a, "TOP:1"), "second": (b, "LOW:1"), "stiffness": 1e13, argument: value}
            if argument != "name" or not isinstance(value, str):
                with pytest.raises(gb.UserError):
                    gb.face_contacts(**given)


MATERIAL = {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": 7800.0}


def sled(folder: Path, kind: str = "quad") -> dict[str, Any]:
    """Return the tables of a block that lies on a base; a force pulls at its face from t = 0 on, in space askew."""
    flat = kind == "quad"
    counts, z = (((5, 2), (4, 2)), 1) if flat else (((2, 2, 1), (3, 2, 1)), 2)
    for name, count, high in zip(("sled", "base"), counts, (0.02, 0.04), strict=True):
        sets = {"TOP": lambda *x, high=high: x[z] > 0.999 * high, "LOW": lambda *x: x[z] < 1e-9}
        write(with_sets(grid(kind, count, (*(0.1,) * z, high)), **sets), folder / f"{name}.vtk")
    body = {"type": "mesh", "units": "m", "materials": [MATERIAL]}
    body |= {"plane": "strain", "thickness": 0.1} if flat else {}
    up = [0.0, 1.0, 0.0] if flat else [0.0, 0.0, 1.0]
    return {
        "structure": [
            {"name": "sled", "model": body | {"file": str(folder / "sled.vtk")},
             "place": {"origin": [0.04 * x for x in up]}},
            {"name": "base", "model": body | {"file": str(folder / "base.vtk")}, "reduce": {"modes": 8}},
        ],
        "point": [{"name": "face", "structure": "sled", "set": "LOW:1",
                   "direction": [1.0, 0.0, 0.0] if flat else [0.6, 0.8, 0.0]}],
        "joint": [{"type": "clamped", "structure": "base", "nodes": "LOW:1"}],
        "contact": {"law": {"type": "kelvin-voigt", "stiffness": 1e13}, "friction": 0.2},
        "pair": [{"name": "under", "between": ["sled.LOW:1", "base.TOP:1"], "at": "faces"}],
        "load": [{"type": "gravity", "structure": "sled", "direction": [-x for x in up]},
                 {"type": "step_force", "name": "pull", "point": "sled.face", "amplitude": 1.0, "ramp": 1e-3}],
        "time": {"step": 1e-5 if flat else 5e-5, "end": 0.02},
        "start": {"state": "seat"},
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["quad", pytest.param("hexahedron", marks=pytest.mark.slow(minutes=0.1))])
@pytest.mark.parametrize("pull", [0.5, 3.0])
def test_a_pair_of_faces_in_a_file_sticks_and_slides(tmp_path: Path, pull: float, kind: str) -> None:
    """Pulled by half of what friction holds a sled stays; pulled by three times as much it moves by Newton's law.

    Its mesh is marched whole, and the base in modes and static responses at the contacts.
    """
    tables, weight = sled(tmp_path, kind), 0.1 * 0.02 * 0.1 * 7800.0 * 9.81
    tables["load"][1]["amplitude"] = force = pull * 0.2 * weight
    read = read_scene(tables)
    found = gb.history(read.scene, tables["time"]["step"], 0.02, read.start())
    felt = np.array([found.force[one.name] for one in read.scene.contacts])
    assert -felt[:, :, 0].sum(axis=0).mean() == pytest.approx(weight, rel=1e-2)
    assert read.scene.structures[1].size < 40
    if pull < 1.0:
        assert np.linalg.norm(felt[:, -1, 1:].sum(axis=0)) == pytest.approx(force, rel=1e-2)
        assert np.abs(found.displacement["face"]).max() < 1e-8
    else:
        gained = force * (0.02 - 0.5e-3) - 0.2 * weight * (0.02 - 0.5e-3)  # N s; the pull takes 1 ms to rise
        wanted = 0.5 * gained * 9.81 / weight * (0.02 - 0.5e-3)
        assert found.displacement["face"][-1] == pytest.approx(wanted, rel=2e-2)


def test_figures_of_a_whole_pair_have_the_sum_over_its_contacts(tmp_path: Path) -> None:
    """The force on a pair of faces is the weight on it, and so is an impulse over time; no contact presses deeper."""
    tables, weight = sled(tmp_path), 0.1 * 0.02 * 0.1 * 7800.0 * 9.81
    tables["load"][1]["amplitude"] = 1e-3 * weight
    asked = {"total": ("contact_force", "mean"), "push": ("impulse", "maximum"), "deep": ("penetration", "maximum"),
             "one": ("penetration", "maximum")}  # fmt: skip
    tables["figure"] = [
        {"name": name, "quantity": quantity, "place": "under-0" if name == "one" else "under", "statistic": statistic}
        for name, (quantity, statistic) in asked.items()
    ]
    found = gb.run(tables, output=tmp_path / "run").summary["figures"]
    assert found["total"]["value"] == pytest.approx(weight, rel=1e-3)
    assert found["push"]["value"] == pytest.approx(0.02 * weight, rel=1e-2)
    assert found["one"]["value"] <= found["deep"]["value"] < 3.0 * weight / (1e13 * 0.1 * 0.1)


@pytest.mark.parametrize("place", ["unde", "under-", "under-99", "TOP"])
def test_figures_of_no_pair_are_refused(tmp_path: Path, place: str) -> None:
    given = sled(tmp_path)
    given["figure"] = [{"name": "total", "quantity": "contact_force", "place": place}]
    check_slip(given, (put("time", "end", value=0.02), "place", '"under"'), tmp_path)


def test_a_closing_slot_has_the_force_of_both_sides(tmp_path: Path) -> None:
    """A block on a spring in a slot that closes: figures of the slot are the sum of those of its sides."""
    given: dict[str, Any] = {
        "structure": [{"name": "block", "model": {"type": "mass", "mass": 1.0, "stiffness": 1e4, "damping": 5.0}}],
        "pair": [{"name": "gap", "between": ["block.at"], "region": {"type": "slot", "clearance": 1e-3},
                  "law": {"type": "kelvin-voigt", "stiffness": 1e5}}],
        "load": [{"type": "harmonic_force", "point": "block.at", "amplitude": 60.0, "frequency": 9.0},
                 {"type": "clearance_change", "support": "gap", "times": [0.0, 0.5], "changes": [0.0, -5e-4]}],
        "time": {"step": 1e-4, "end": 1.0},
        "figure": [{"name": f"on-{place}", "quantity": "contact_force", "place": place, "statistic": "mean"}
                   for place in ("gap", "gap-0", "gap-1")],
    }  # fmt: skip
    found = {name: one["value"] for name, one in gb.run(given, output=tmp_path / "run").summary["figures"].items()}
    assert min(abs(found["on-gap-0"]), abs(found["on-gap-1"])) > 0.0
    assert found["on-gap"] == pytest.approx(found["on-gap-0"] + found["on-gap-1"], rel=1e-12)


PAIR = ("pair", 0)
SLIPS: dict[str, tuple[Change, str, str]] = {
    "one face": (put(*PAIR, "between", value=["sled.LOW:1"]), "under", "two faces"),
    "a point": (put(*PAIR, "between", value=["sled", "base.TOP:1"]), "under", "no face"),
    "no such face": (put(*PAIR, "between", value=["sled.SIDE", "base.TOP:1"]), "under", "one of .*LOW:1"),
    "the same face": (put(*PAIR, "between", value=["sled.LOW:1"] * 2), "under", "twice"),
    "faces that look away": (put(*PAIR, "between", value=["sled.TOP:1", "base.TOP:1"]), "under", "face each other"),
    "a face of a mass": (put("structure", 1, value={"name": "base", "model": {"type": "mass", "mass": 1.0}}),
                         "under", "of a model mass"),
    "a slot": (put(*PAIR, "region", value={"type": "slot", "clearance": 1e-3}), "under.*region", "half plane"),
    "pressed by the region": (put(*PAIR, "region", value={"type": "half-plane", "clearance": -1e-6}), "under.*region",
                              "interference"),
    "an offset": (put(*PAIR, "offset", value=1e-3), "under.*offset", "of the meshes"),
    "Nitsche": (put("contact", "formulation", value="nitsche"), "contact.*formulation", "have no stress"),
    "multipliers": (put("contact", "formulation", value="augmented-lagrangian"), "formulation", "unilateral"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_of_pairs_of_faces_are_refused(tmp_path: Path, slip: str) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given = sled(tmp_path)
    if slip == "a face of a mass":
        given["joint"] = []
    check_slip(given, SLIPS[slip], tmp_path)
