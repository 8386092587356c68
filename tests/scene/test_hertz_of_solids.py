"""Hertz between two cylinders, each a mesh of solids: pressure and approach for a force, and their order in the mesh.

Both are quarters in plane strain: centers stay on their planes of symmetry, so that the approach is that of a cylinder
that is compressed along its diameter. Source: Johnson (1985), Contact Mechanics, eqs. 4.43, 4.45 and 5.57.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

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
        field = gmsh.model.mesh.field
        field.add("Distance", 1)
        field.setNumbers(1, "PointsList", [top])
        field.add("Threshold", 2)
        fine = HALF / cells
        for key, value in (("InField", 1), ("SizeMin", fine), ("SizeMax", 80.0 * fine), ("DistMin", 1.6 * HALF),
                           ("DistMax", 0.8 * RADIUS)):  # fmt: skip
            field.setNumber(2, key, value)
        field.setAsBackgroundMesh(2)
        for key in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
            gmsh.option.setNumber(f"Mesh.{key}", 0)
        gmsh.model.mesh.generate(2)
        tags, x, _ = gmsh.model.mesh.getNodes()
        row = np.zeros(int(tags.max()) + 1, dtype=int)
        row[tags.astype(int)] = np.arange(len(tags))
        triangles = row[gmsh.model.mesh.getElementsByType(2)[1].astype(int)].reshape(-1, 3)
    finally:
        gmsh.finalize()
    return np.reshape(x, (-1, 3)), triangles


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
