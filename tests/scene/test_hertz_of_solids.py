"""Hertz between two cylinders, two spheres, and of a sphere on a flat, each a mesh of solids: pressure and its order.

Cylinders are quarters in plane strain: centers stay on their planes of symmetry, so that the approach is that of a
cylinder that is compressed along its diameter. The sphere is an eighth, held at its planes of symmetry; a stiff block
presses on it. Source: Johnson (1985), Contact Mechanics, eqs. 4.22, 4.24, 4.43, 4.45 and 5.57.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import gmsh
import meshio
import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.system.operators import Array

RADIUS, YOUNG, POISSON = 0.05, 2.0e11, 0.3
HALF = 1.0e-3  # half width of contact, m
STIFF = YOUNG / (2.0 * (1.0 - POISSON**2))  # of both together
FORCE = np.pi * STIFF * HALF**2 / (4.0 * 0.5 * RADIUS)  # N/m that makes this half width
PRESSURE = 2.0 * FORCE / (np.pi * HALF)
APPROACH = 2.0 * FORCE * (1.0 - POISSON**2) / (np.pi * YOUNG) * (2.0 * np.log(4.0 * RADIUS / HALF) - 1.0)


def graded(kind: int, focus: list[int], sizes: tuple[float, float], reach: tuple[float, float]) -> tuple[Array, Any]:
    """Return nodes and cells of a mesh of the present geometry.

    Args:
        kind: Kind of cells, as gmsh counts them: 2 triangles, 11 tetrahedra of degree 2.
        focus: Points of the geometry.
        sizes: Sizes of cells there, and far away, m.
        reach: Distances up to which the small size holds, and from which the large one does, m.
    """
    field = gmsh.model.mesh.field
    field.add("Distance", 1)
    field.setNumbers(1, "PointsList", focus)
    field.add("Threshold", 2)
    for key, value in zip(("InField", "SizeMin", "SizeMax", "DistMin", "DistMax"), (1, *sizes, *reach), strict=True):
        field.setNumber(2, key, value)
    field.setAsBackgroundMesh(2)
    for key in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
        gmsh.option.setNumber(f"Mesh.{key}", 0)
    _, dimension, order, nodes, _, _ = gmsh.model.mesh.getElementProperties(kind)
    gmsh.model.mesh.generate(dimension)
    gmsh.model.mesh.setOrder(order)
    tags, x, _ = gmsh.model.mesh.getNodes()
    row = np.zeros(int(tags.max()) + 1, dtype=int)
    row[tags.astype(int)] = np.arange(len(tags))
    return np.reshape(x, (-1, 3)), row[gmsh.model.mesh.getElementsByType(kind)[1].astype(int)].reshape(-1, nodes)


def quarter(cells: int) -> tuple[Array, Array]:
    """Return nodes and triangles of a quarter of a disc, with so many cells in half the width of contact."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        geo = gmsh.model.geo
        center, right, top = geo.addPoint(0, 0, 0), geo.addPoint(RADIUS, 0, 0), geo.addPoint(0, RADIUS, 0)
        lines = [geo.addLine(center, right), geo.addCircleArc(right, center, top), geo.addLine(top, center)]
        geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.synchronize()
        fine = HALF / cells
        return graded(2, [top], (fine, 80.0 * fine), (1.6 * HALF, 0.8 * RADIUS))
    finally:
        gmsh.finalize()


class Pressed(NamedTuple):
    """Force, N/m, and largest pressure, Pa, of two cylinders that are brought together."""

    force: float
    pressure: float
    half: float


def pressed(folder: Path, cells: int) -> Pressed:
    """Return the seat of two quarters that are APPROACH nearer than at touch."""
    x, triangles = quarter(cells)
    near = [int(i) for i in np.flatnonzero((np.hypot(*x[:, :2].T) > 0.9999999 * RADIUS) & (x[:, 0] < 2.5 * HALF))]
    near = [i for i in sorted(near, key=lambda i: x[i, 0]) if x[i, 1] > 0.0]
    bodies = []
    for name, sign in (("lower", 1.0), ("upper", -1.0)):
        # the upper one is turned upside down, so that its triangles turn round
        order = [0, 1, 2] if sign > 0.0 else [0, 2, 1]
        meshio.Mesh(x * [1.0, sign, 1.0], [("triangle", triangles[:, order])]).write(folder / f"{name}.vtk")
        held = [f"{i + 1}.2" for i in np.flatnonzero(x[:, 1] < 1e-12)]
        held += [f"{i + 1}.1" for i in np.flatnonzero(x[:, 0] < 1e-12)]
        bodies.append(
            gb.from_mesh(
                folder / f"{name}.vtk", gb.material(YOUNG, 7800.0, POISSON), units="m", plane="strain", thickness=1.0,
                clamped=held, points={f"n{i}": f"{i + 1}.2" for i in near}, name=name,
            )
        )  # fmt: skip
    law = gb.KelvinVoigt(stiffness=1e3 * YOUNG)
    gap = 2.0 * (RADIUS - np.sqrt(RADIUS**2 - x[near, 0] ** 2)) - APPROACH
    contacts = [
        gb.Contact((bodies[0][f"n{i}"], bodies[1][f"n{i}"]), gb.HalfPlane(float(g)), law, name=f"n{i}")
        for i, g in zip(near, gap, strict=True)
    ]
    felt = -gb.seat(gb.Scene(*bodies, contacts=contacts)).F[:, 0]
    place = x[near, 0]
    widths = np.gradient(place)
    widths[0] = 0.5 * (place[1] - place[0])
    return Pressed(2.0 * felt.sum(), float((felt / widths)[1:4].max()), float(place[felt > 0.0].max()))


@pytest.mark.slow(minutes=0.5)
def test_two_cylinders(tmp_path: Path) -> None:
    """Force within 0.5 % and pressure within 1 % of Hertz with 16 cells in half the width, order above 1.2."""
    found = {cells: pressed(tmp_path, cells) for cells in (4, 8, 16)}
    force = np.array([abs(one.force / FORCE - 1.0) for one in found.values()])
    pressure = np.array([abs(one.pressure / PRESSURE - 1.0) for one in found.values()])
    assert force[-1] < 0.005
    assert pressure.max() < 0.01
    assert np.all(np.log2(force[:-1] / force[1:]) > 1.2)
    assert found[16].half == pytest.approx(HALF, rel=0.1)


SPOT = 5.0e-3  # radius of contact of the sphere, m
LOAD = 4.0 * 2.0 * STIFF * SPOT**3 / (3.0 * RADIUS)  # N that makes this radius
HIGHEST = 3.0 * LOAD / (2.0 * np.pi * SPOT**2)
SWAPPED = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # the last two nodes of tetrahedra of gmsh in meshio


def octant(cells: float) -> tuple[Array, Array]:
    """Return nodes and tetrahedra of degree 2 of an eighth of a sphere, with so many cells in the radius of contact."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addSphere(0.0, 0.0, 0.0, RADIUS, -1, -0.5 * np.pi, 0.0, 0.5 * np.pi)
        gmsh.model.occ.synchronize()
        ends = [tag for _, tag in gmsh.model.getEntities(0)]
        focus = [one for one in ends if gmsh.model.getValue(0, one, [])[2] < -0.9 * RADIUS]
        x, tetrahedra = graded(11, focus, (SPOT / cells, RADIUS / 3), (1.2 * SPOT, 0.8 * RADIUS))
    finally:
        gmsh.finalize()
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    return x[used], tetrahedra.reshape(-1, 10)[:, SWAPPED]


def held(x: Array, count: int) -> list[str]:
    """Return the DOFs of the planes of symmetry x = 0, y = 0 and z = 0, of the first so many."""
    return [f"{i + 1}.{k + 1}" for k in range(count) for i in np.flatnonzero(np.abs(x[:, k]) < 1e-9)]


@pytest.mark.slow(minutes=0.4)
def test_a_sphere_on_a_flat(tmp_path: Path) -> None:
    """Pressure at the pole within 2.5 % with 4 cells in the radius of contact, 1 % with 6; the faces do not match."""
    errors = []
    for cells in (2, 4, 6):
        x, tetrahedra = octant(cells)
        pole = (np.linalg.norm(x, axis=1) > 0.999999 * RADIUS) & (np.hypot(*x[:, :2].T) < 1.6 * SPOT) & (x[:, 2] < 0.0)
        sphere = meshio.Mesh(x, [("tetra10", tetrahedra)], point_data={"pole": pole.astype(int)})
        corners = [[i, j, k] for k in (0.0, 1.0) for i, j in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))]
        y = 2.0 * SPOT * np.array(corners) - [0.0, 0.0, RADIUS + 2.0 * SPOT]
        flat = meshio.Mesh(y, [("hexahedron", np.arange(8)[None])], point_data={"top": np.repeat([0, 1], 4)})
        bodies = []
        for name, mesh, young, ways in (("sphere", sphere, YOUNG, 3), ("flat", flat, 1e4 * YOUNG, 2)):
            mesh.write(tmp_path / f"{name}.vtk")
            points = {f"n{i}": f"{i + 1}.3" for i in range(4 if name == "flat" else 0)}
            bodies.append(gb.from_mesh(tmp_path / f"{name}.vtk", gb.material(young, 7800.0, POISSON), units="m",
                                       clamped=held(mesh.points, ways), points=points, name=name))  # fmt: skip
        hard = 30.0 * YOUNG * cells / SPOT
        pairs = gb.face_contacts((bodies[0], "POLE:1"), (bodies[1], "TOP:1"), hard)
        push = [gb.Force(bodies[1][f"n{i}"], LOAD / 16.0, name=f"push{i}") for i in range(4)]
        force = np.abs(gb.seat(gb.Scene(*bodies, contacts=pairs, loads=push)).F[:, 0])
        areas = np.array([one.law.values[0] for one in pairs]) / hard
        assert force.sum() == pytest.approx(LOAD / 4.0, rel=5e-3)
        errors.append(abs((force / areas).max() / HIGHEST - 1.0))
    assert errors[1] < 0.025
    assert errors[2] < 0.01
    assert np.log(errors[0] / errors[2]) / np.log(3.0) > 2.0


@pytest.mark.slow(minutes=0.3)
def test_two_spheres(tmp_path: Path) -> None:
    """Pressure at the pole within 3 % with 4 cells in the radius of contact; cells of one are 1.4 times larger.

    Two spheres as stiff as each other, each pressed by the other, take the force of one twice as stiff on a flat.
    """
    errors = []
    for cells in (2.0, 4.0):
        bodies = []
        for name, sign, share in (("lower", -1.0, 1.0), ("upper", 1.0, 0.7)):
            x, tetrahedra = octant(share * cells)
            if sign < 0.0:  # upside down, so that its cells turn round
                x, tetrahedra = x * [1.0, 1.0, sign], tetrahedra[:, [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
            pole = (np.linalg.norm(x, axis=1) > 0.999999 * RADIUS) & (np.hypot(*x[:, :2].T) < 1.6 * SPOT)
            marks = {"pole": pole.astype(int), "middle": (np.abs(x[:, 2]) < 1e-9).astype(int)}
            meshio.Mesh(x, [("tetra10", tetrahedra)], point_data=marks).write(tmp_path / f"{name}.vtk")
            lower = name == "lower"
            bodies.append(
                gb.from_mesh(
                    tmp_path / f"{name}.vtk", gb.material(YOUNG, 7800.0, POISSON), units="m", name=name,
                    clamped=held(x, 3 if lower else 2), place=gb.Pose((0.0, 0.0, 0.0 if lower else 2.0 * RADIUS)),
                    points={} if lower else {"middle": {"set": "MIDDLE:1", "direction": (0.0, 0.0, -1.0)}},
                )
            )  # fmt: skip
        hard = 30.0 * YOUNG * cells / SPOT
        pairs = gb.face_contacts((bodies[0], "POLE:1"), (bodies[1], "POLE:1"), hard)
        push = gb.Force(bodies[1]["middle"], LOAD / 4.0, name="push")
        force = np.abs(gb.seat(gb.Scene(*bodies, contacts=pairs, loads=[push])).F[:, 0])
        areas = np.array([one.law.values[0] for one in pairs]) / hard
        assert force.sum() == pytest.approx(LOAD / 4.0, rel=5e-3)
        errors.append(abs((force / areas).max() / HIGHEST - 1.0))
    assert errors[1] < 0.03
    assert np.log2(errors[0] / errors[1]) > 2.0
