"""A cylinder pressed on a rigid plane against Hertz's line contact.

A user's mesh whose lower face is an arc: it starts with its own gaps. Under the force F per width

    a = sqrt(4 F R (1 - nu^2) / (pi E)),    p = p0 sqrt(1 - (x / a)^2),    p0 = 2 F / (pi a).

Source: Johnson (1985), Contact Mechanics, sections 4.2 and 5.5. The body is 40 times as large as a: what Hertz's
half-space misses is of the order (a / size)^2, 1e-3.
"""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import NamedTuple

import gmsh
import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from benchmarks.textbook import stress
from gapbeam.meshes.gmsh_model import gmsh_session
from tests.shared.forms import compiled_form
from tests.shared.models import beam_model, seat_of

SIZE, RADIUS, WIDTH = 0.1, 0.1, 0.02  # m
E, NU = 2.1e11, 0.3
HALF_WIDTH = 2.5e-3  # m, about what the interference below makes
INTERFERENCE = 1.2e-4  # m
FORMULATIONS = {
    "penalty": {"type": "penalty"},
    "nitsche 1": {"type": "nitsche", "theta": 1},
    "nitsche 0": {"type": "nitsche", "theta": 0},
    "nitsche -1": {"type": "nitsche", "theta": -1},
    "unilateral": {"type": "unilateral"},
}


def write_cylinder(path, cell, order):
    """Mesh a square of the beam frame with an arc below, with cells of this size where it is pressed."""
    middle, low, high = 0.5 * SIZE, -0.5 * SIZE, 0.5 * SIZE
    side = low + RADIUS - sqrt(RADIUS**2 - middle**2)
    with gmsh_session(MPI.COMM_SELF):
        model = gmsh.model.geo
        places = [(0.0, side), (middle, low), (SIZE, side), (SIZE, high), (0.0, high)]
        corners = [model.addPoint(x, y, 0.0) for x, y in places]
        center = model.addPoint(middle, low + RADIUS, 0.0)
        arcs = [model.addCircleArc(corners[k], center, corners[k + 1]) for k in (0, 1)]
        lines = [model.addLine(corners[k], corners[(k + 1) % 5]) for k in (2, 3, 4)]
        surface = model.addPlaneSurface([model.addCurveLoop([*arcs, *lines])])
        model.synchronize()
        for dimension, tags, name in ((2, [surface], "body"), (1, arcs, "base"), (1, [lines[1]], "gland")):
            gmsh.model.addPhysicalGroup(dimension, tags, name=name)
        field = gmsh.model.mesh.field
        field.add("MathEval", 1)
        distance = f"Sqrt((x-{middle})^2+(y-({low}))^2)"
        field.setString(1, "F", f"{cell}+0.25*Max(0,{distance}-{1.6 * HALF_WIDTH})")
        field.setAsBackgroundMesh(1)
        for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
            gmsh.option.setNumber(f"Mesh.{option}", 0)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))


class Pressed(NamedTuple):
    """Contact pressure of the cylinder and what Hertz says for its force.

    Attributes:
        x: Places from the middle, m.
        pressure: Pa.
        weights: m^2.
        force: F per width, N/m.
        half_width: a of Hertz, m.
        peak: p0 of Hertz, Pa.
    """

    x: np.ndarray
    pressure: np.ndarray
    weights: np.ndarray
    force: float
    half_width: float
    peak: float

    @property
    def peak_found(self):
        """p0 of the line through p^2 over x^2 in the inner 70 % of the contact."""
        inner = np.abs(self.x) < 0.7 * self.half_width
        fit = np.polyfit(self.x[inner] ** 2, self.pressure[inner] ** 2, 1, w=np.sqrt(self.weights[inner]))
        return sqrt(fit[1])

    @property
    def error(self):
        """Difference from Hertz's pressure in L2, relative."""
        exact = self.peak * np.sqrt(np.maximum(1.0 - (self.x / self.half_width) ** 2, 0.0))
        return sqrt(self.weights @ (self.pressure - exact) ** 2 / (self.weights @ exact**2))


def cylinder(folder: Path, name: str, cell: float, degree: int):
    """The model, with cells of this size under the cylinder, m."""
    path = folder / "cylinder.msh"
    write_cylinder(path, cell, degree)
    return beam_model(
        {
            "beam": {"length": SIZE, "thickness": SIZE, "width": WIDTH},
            "material": {"young_modulus": E, "poisson_ratio": NU},
            "support": {"length": SIZE, "clearance": -INTERFERENCE},
            "mesh": {"file": str(path), "plane": "strain", "degree": degree},
            "contact": {
                "formulation": FORMULATIONS[name],
                "stiffness": 20.0 * E / cell if name == "penalty" else "auto",
            },
            "time": {"scheme": {"type": "implicit-midpoint"}},
        },
        loads=(),
    )


def press(folder: Path, name: str, cell: float, degree: int) -> Pressed:
    """Press the cylinder by an interference."""
    model = cylinder(folder, name, cell, degree)
    seat, contact = seat_of(model), model.system.contact
    base = contact.faces == contact.face_names.index("base")
    x, pressure, weights = contact.positions[base, 0] - 0.5 * SIZE, seat.state.pressure[base], contact.weights[base]
    force = float(weights @ pressure) / WIDTH
    a = sqrt(4.0 * force * RADIUS * (1.0 - NU**2) / (pi * E))
    return Pressed(x, pressure, weights, force, a, 2.0 * force / (pi * a))


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("name", FORMULATIONS)
def test_pressure_approaches_that_of_hertz(tmp_path: Path, name: str, degree: int) -> None:
    """Cells of a/2 and a/14: the error in L2 falls to a third or less; p0 is met to 0.4 %, by quadratic cells to 0.2 %.

    Source: Hertz's line contact for the force that the contact pressure adds up to; cells straight or curved.
    """
    coarse, fine = (press(tmp_path, name, HALF_WIDTH / parts, degree) for parts in (2, 16))
    assert 2.0e-3 < fine.half_width < 2.5e-3
    assert fine.error < coarse.error / 3.0
    assert fine.error < (0.08 if degree == 1 else 0.02)
    assert fine.peak_found == pytest.approx(fine.peak, rel=4e-3 if degree == 1 else 2e-3)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("degree", [1, 2])
def test_stress_on_a_face_that_is_not_flat(tmp_path: Path, degree: int) -> None:
    """G^T w S u is the assembled -int e . sigma(u) n v ds on the arc: the force along the bending axis, to 1e-12.

    Nitsche's method is consistent there as well: the face slides, and its tangential stress is not zero along the axis.
    """
    model = cylinder(tmp_path, "nitsche 1", HALF_WIDTH, degree)
    contact, space, tagged = model.system.contact, model.space, model.tagged
    u, v = fem.Function(space), ufl.TestFunction(space)
    u.x.array[:] = np.random.default_rng(0).standard_normal(len(u.x.array))
    rule = {"quadrature_degree": model.point_rule.degree}
    arc = ufl.Measure("ds", space.mesh, subdomain_data=tagged.facets, metadata=rule)(tagged.groups["base"])
    traction = ufl.dot(stress(u, model.case.material, False), ufl.FacetNormal(space.mesh))
    expected = fem.assemble_vector(compiled_form(-WIDTH * traction[1] * v[1] * arc)).array
    gamma = np.asarray(model.law.spring.stiffness)
    rows = (contact.gap_matrix - contact.geometry_matrix).multiply(gamma[:, None]).tocsr()
    base = contact.faces == contact.face_names.index("base")
    forces = contact.weights * base * (rows @ contact.interface.trace(u.x.array, model.system.operators))
    found = np.zeros(len(expected))
    contact.interface.add(found, contact.geometry_matrix.T @ forces)
    assert np.linalg.norm(found - expected) < 1e-12 * np.linalg.norm(expected)
