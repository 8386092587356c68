"""The operators of Nitsche's method against forms assembled by DOLFINx, and its trace bound against single cells."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from scipy.linalg import eigh
from scipy.sparse import csr_matrix

from solver.elasticity import lame, stress
from solver.errors import UserError
from solver.interface import nitsche_operator
from solver.nitsche import Nitsche, correction, stress_rows, trace_bounds
from solver.system import Springs
from tests.models import beam_model, spread, stiffness_of

WIDTH = 0.02  # m, of the slices in 2D
FACTOR = 2.0
BLOCK = {"beam": {"length": 0.05}, "support": {"length": 0.05}}
COARSE_BLOCK = {"support_size": 0.02, "edge_size": 0.02, "cells_through_thickness": 2, "cells_across_width": 1}
MESHES = {
    f"{cell} {plane} {degree}": {"cell": cell, "plane": plane, "degree": degree, "dimension": dimension}
    for cell, dimension, planes in (
        ("triangle", 2, ("stress", "strain")),
        ("quadrilateral", 2, ("stress", "strain")),
        ("tetrahedron", 3, ("stress",)),
        ("hexahedron", 3, ("stress",)),
    )
    for plane in planes
    for degree in (1, 2)
}
every_mesh = pytest.mark.parametrize("name", MESHES)


class Block:
    """A short beam with Nitsche's operators of one theta, and the same forms in UFL."""

    def __init__(self, name, theta=1, layers=2):
        settings = MESHES[name]
        cells = COARSE_BLOCK | {"cells_through_thickness": layers}
        if settings["dimension"] == 2:
            cells.pop("cells_across_width")
        contact = {"formulation": {"type": "nitsche", "theta": theta, "factor": FACTOR}}
        scheme = {"scheme": {"type": "implicit-midpoint"}}
        changes = BLOCK | {"mesh": {**cells, **settings, "size": 0.02}, "contact": contact, "time": scheme}
        self.model = beam_model(changes, loads=())
        self.space, self.tagged, self.theta = self.model.space, self.model.tagged, theta
        self.dimension = settings["dimension"]
        self.width = WIDTH if self.dimension == 2 else 1.0
        self.plane_stress = settings["plane"] == "stress" and self.dimension == 2
        self.degree = {"quadrature_degree": 2 * settings["degree"] + 2}
        self.ds = ufl.Measure("ds", self.space.mesh, subdomain_data=self.tagged.facets, metadata=self.degree)
        self.faces = {name: self.tagged.facets_of(name) for name in ("base", "gland")}

    @property
    def settings(self):
        return Nitsche(self.theta, FACTOR, lame(self.model.case.material, self.plane_stress), self.width)

    @property
    def contact(self):
        return self.model.system.contact

    def sigma(self, u):
        """Stress (UFL)."""
        return stress(u, self.model.case.material, self.plane_stress)

    def normal_stress(self, u):
        """Stress normal to both faces (UFL)."""
        axis = self.dimension - 1
        return self.sigma(u)[axis, axis]

    def of_face(self, integrand, name):
        return self.width * integrand * self.ds(self.tagged.groups[name])

    def operator(self):
        return nitsche_operator(
            self.space, self.faces, 1e-4, self.width, self.model.point_rule, self.settings
        )

    def stress_matrix(self):
        """S on the interface DOFs, from what the method adds to G: (G_N - G) gamma."""
        found = self.operator()
        return csr_matrix((found.operator.gap_matrix - found.operator.geometry_matrix).multiply(found.gamma[:, None]))

    def random_displacement(self, seed=0):
        """A displacement without symmetries."""
        u = fem.Function(self.space)
        u.x.array[:] = np.random.default_rng(seed).standard_normal(len(u.x.array))
        return u

    def traced(self, u):
        return self.contact.interface.trace(u.x.array, self.model.system.operators)


@cache
def block(name, theta=1, layers=2):
    """A block, kept: several tests look at the same."""
    return Block(name, theta, layers)


def assembled(form):
    """A bilinear form as a matrix."""
    return fem.assemble_matrix(fem.form(form)).to_scipy().tocsr()


@every_mesh
def test_stress_operator_is_the_assembled_form(name: str) -> None:
    """G^T w S u is int sigma_n(u) v ds, assembled by DOLFINx for a random u and all v, to 1e-12.

    With a gap that closes downward at the base and upward at the gland.
    """
    body = block(name)
    u, v, axis = body.random_displacement(), ufl.TestFunction(body.space), body.dimension - 1
    form = body.of_face(body.normal_stress(u) * v[axis], "base") - body.of_face(body.normal_stress(u) * v[axis], "gland")
    expected = fem.assemble_vector(fem.form(form)).array
    contact = body.contact
    found = np.zeros(len(expected))
    stress_there = body.stress_matrix() @ body.traced(u)
    contact.interface.add(found, contact.geometry_matrix.T @ (contact.weights * stress_there))
    assert np.linalg.norm(expected) > 0.0
    assert np.linalg.norm(found - expected) < 1e-12 * np.linalg.norm(expected)


@every_mesh
def test_force_operator_carries_theta_times_the_stress(name: str) -> None:
    """H^T w p is int p (G v + theta/gamma sigma_n(v)) for theta 1, 0, -1; G_N u is G u + sigma_n(u)/gamma.

    The pressure is that of a random displacement, gamma one number per cell; all forms assembled by DOLFINx, to 1e-12.
    """
    for theta in (1, 0, -1):
        body = block(name, theta)
        found, u, v = body.operator(), body.random_displacement(), ufl.TestFunction(body.space)
        axis, gamma = body.dimension - 1, cell_gamma(body)
        total, contact = 0, found.operator
        for face, sign in (("base", 1.0), ("gland", -1.0)):
            pressure = gamma * sign * u[axis] + body.normal_stress(u)
            total += body.of_face(pressure * (sign * v[axis] + theta / gamma * body.normal_stress(v)), face)
        expected = fem.assemble_vector(fem.form(total)).array
        pressure = found.gamma * (contact.gap_matrix @ body.traced(u))
        result = np.zeros(len(expected))
        contact.interface.add(result, contact.resultant(contact.weights * pressure))
        assert np.linalg.norm(result - expected) < 1e-12 * np.linalg.norm(expected)
        assert contact.symmetric == (theta == 1)


def cell_gamma(body):
    """Gamma as a function that is constant in every cell."""
    gamma = fem.Function(fem.functionspace(body.space.mesh, ("DG", 0)))
    gamma.x.array[:] = 1.0
    local = {face: points_of(body, face) for face in body.faces}
    for cell, bound in trace_bounds(body.space, local, body.settings).items():
        gamma.x.array[cell] = FACTOR * bound
    return gamma


def points_of(body, face):
    """Contact points of one face."""
    from solver.face_points import face_points

    return face_points(body.space, body.faces[face], body.model.point_rule, body.width)


@every_mesh
def test_correction_of_the_stiffness_is_the_assembled_form(name: str) -> None:
    """K_N = K - theta/gamma int sigma_n sigma_n, assembled by DOLFINx, to 1e-12 of its norm.

    `correction` with one gamma for all points, and the stiffness of the model with that of each cell; theta 1, 0, -1.
    """
    for theta in (1, 0, -1):
        body = block(name, theta)
        u, v = ufl.TrialFunction(body.space), ufl.TestFunction(body.space)
        product = body.normal_stress(u) * body.normal_stress(v)
        faces = [body.of_face(product, face) for face in body.faces]
        added = assembled(sum(faces[1:], faces[0]))
        gamma, contact = 3.0e14, body.contact
        same = np.full(contact.size, gamma)
        springs = Springs(contact.interface, correction(body.stress_matrix(), contact.weights, same, theta))
        found = spread(springs, added.shape[0])
        assert abs(found + theta / gamma * added).max() <= 1e-12 * abs(added).max() / gamma
        plain = Block.__dict__["plain_stiffness"](body) if hasattr(Block, "plain_stiffness") else plain_stiffness(body)
        varying = [body.of_face(product / cell_gamma(body), face) for face in body.faces]
        expected = plain - theta * assembled(sum(varying[1:], varying[0]))
        assert abs(stiffness_of(body.model) - expected).max() <= 1e-12 * abs(plain).max()


def plain_stiffness(body):
    """K of elasticity with the weak restraint, assembled from UFL."""
    u, v, case = ufl.TrialFunction(body.space), ufl.TestFunction(body.space), body.model.case
    elastic = body.width * ufl.inner(body.sigma(u), ufl.grad(v)) * ufl.dx
    area = 2.0 * case.support.length * WIDTH
    spring = sum(k / area * u[i] * v[i] for i, k in enumerate((case.restraint.axial, case.restraint.lateral)[: body.dimension - 1]))
    return assembled(elastic + body.of_face(spring, "base") + body.of_face(spring, "gland"))
