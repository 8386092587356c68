"""The operators of Nitsche's method against forms assembled by DOLFINx, and its trace bound against single cells."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from scipy.linalg import eigh, eigvalsh

from benchmarks.textbook import stress
from gapbeam.solver.assembly.contact_assembly import Nitsche, correction, nitsche_operator, trace_bounds
from gapbeam.solver.assembly.elasticity import lame
from gapbeam.solver.assembly.face_quadrature import face_points
from gapbeam.solver.case.beam_motions import axial_restraint, lateral_restraint
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.supports.support_tables import BaseAndGland
from gapbeam.solver.system.operators import Springs
from tests.shared.forms import compiled_form
from tests.shared.models import beam_model, spread, stiffness_of

pytestmark = pytest.mark.versions

WIDTH = 0.02  # m, of the slices in 2D
FACTOR = 2.0
THETAS = (1, 0, -1)
CELLS = {"support_size": 0.02, "edge_size": 0.02, "size": 0.02, "cells_through_thickness": 2}
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
    """A beam as long as its support, with symmetric Nitsche contact, and what its forms are in UFL."""

    def __init__(self, name, layers):
        settings = MESHES[name]
        self.dimension = settings["dimension"]
        across = {"cells_across_width": 1} if self.dimension == 3 else {}
        self.model = beam_model(
            {
                "beam": {"length": 0.05},
                "support": {"length": 0.05},
                "mesh": {**CELLS, **across, **settings, "cells_through_thickness": layers},
                "contact": {"formulation": {"type": "nitsche", "factor": FACTOR}},
            },
            loads=(),
        )
        self.space, self.tagged, self.contact = self.model.space, self.model.tagged, self.model.system.contact
        self.interface = self.contact.interface
        self.width, self.axis = WIDTH if self.dimension == 2 else 1.0, self.dimension - 1
        self.plane_stress = settings["plane"] == "stress" and self.dimension == 2
        rule = {"quadrature_degree": self.model.point_rule.degree}
        self.measure = ufl.Measure("ds", self.space.mesh, subdomain_data=self.tagged.facets, metadata=rule)
        self.faces = {face: self.tagged.facets_of(face) for face in ("base", "gland")}
        self.settings = Nitsche(1, FACTOR, lame(self.model.case.material, self.plane_stress), self.width)
        self.bounds = trace_bounds(self.space, self.points, self.settings)

    @property
    def points(self):
        """Contact points by face."""
        rule = self.model.point_rule
        return {face: face_points(self.space, facets, rule, self.width) for face, facets in self.faces.items()}

    @property
    def gamma(self):
        """Gamma of each cell, as a function that is constant in every cell."""
        gamma = fem.Function(fem.functionspace(self.space.mesh, ("DG", 0)))
        gamma.x.array[:] = 1.0
        for cell, bound in self.bounds.items():
            gamma.x.array[cell] = FACTOR * bound
        return gamma

    def sigma(self, u):
        """Stress."""
        return stress(u, self.model.case.material, self.plane_stress)

    def normal(self, u):
        """Stress along the normal of both faces."""
        return self.sigma(u)[self.axis, self.axis]

    def over(self, integrand, face):
        """Integral over a face, times the width."""
        return self.width * integrand * self.measure(self.tagged.groups[face])

    def over_both(self, integrand):
        """Integral over both faces."""
        return self.over(integrand, "base") + self.over(integrand, "gland")

    def operator(self, theta):
        """What is under test."""
        settings, rule = replace(self.settings, theta=theta), self.model.point_rule
        return nitsche_operator(
            self.space, self.faces, BaseAndGland(length=0.05, clearance=1e-4).faces, self.width, rule, settings
        )

    def stress_matrix(self):
        """S on the interface DOFs, from what the method adds to G: (G_N - G) gamma."""
        found = self.operator(1)
        return (found.operator.gap_matrix - found.operator.geometry_matrix).multiply(found.gamma[:, None]).tocsr()

    def plain_stiffness(self):
        """K of elasticity with the weak restraint."""
        u, v, case = ufl.TrialFunction(self.space), ufl.TestFunction(self.space), self.model.case
        springs = (axial_restraint(case).value, lateral_restraint(case).value)[: self.dimension - 1]
        held = sum(k / (2.0 * 0.05 * WIDTH) * u[i] * v[i] for i, k in enumerate(springs))
        return assembled(self.width * ufl.inner(self.sigma(u), ufl.grad(v)) * ufl.dx + self.over_both(held))

    def random_displacement(self):
        """A displacement without symmetries, and its interface values."""
        u = fem.Function(self.space)
        u.x.array[:] = np.random.default_rng(1).standard_normal(len(u.x.array))
        return u, self.interface.trace(u.x.array, self.model.system.operators)

    def spread(self, values):
        """Interface values as a vector."""
        total = np.zeros(self.model.dofs)
        self.interface.add(total, values)
        return total


@cache
def block(name, layers=2):
    """A block, kept: several tests look at the same."""
    return Block(name, layers)


def assembled(form):
    """A form as a vector or a matrix."""
    form = compiled_form(form)
    return fem.assemble_vector(form).array if form.rank == 1 else fem.assemble_matrix(form).to_scipy().tocsr()


def close(found, expected):
    """Whether two vectors agree to 1e-12."""
    return np.linalg.norm(expected) > 0.0 and np.linalg.norm(found - expected) < 1e-12 * np.linalg.norm(expected)


@every_mesh
def test_stress_operator_is_the_assembled_form(name: str) -> None:
    """G^T w S u is int sigma_n(u) v_n ds, assembled by DOLFINx for a random u and all v, to 1e-12.

    v_n opens the gap: it points upward at the base and downward at the gland.
    """
    body = block(name)
    (u, traced), v = body.random_displacement(), ufl.TestFunction(body.space)[body.axis]
    expected = assembled(body.over(body.normal(u) * v, "base") - body.over(body.normal(u) * v, "gland"))
    stress_there = body.stress_matrix() @ traced
    assert close(body.spread(body.contact.geometry_matrix.T @ (body.contact.weights * stress_there)), expected)


@pytest.mark.parametrize("theta", THETAS)
@every_mesh
def test_gap_and_force_operators_are_the_assembled_forms(name: str, theta: int) -> None:
    """H^T w p is int p (v_n + theta/gamma sigma_n(v)), p = gamma u_n + sigma_n(u), to 1e-12; H is G for theta = 1 only.

    Source: Chouly, Hild and Renard (2015), the last term of the method; assembled by DOLFINx for a random u.
    """
    body = block(name)
    (u, traced), v = body.random_displacement(), ufl.TestFunction(body.space)
    found, gamma, form = body.operator(theta), body.gamma, 0
    for face, sign in (("base", 1.0), ("gland", -1.0)):
        pressure = gamma * sign * u[body.axis] + body.normal(u)
        form += body.over(pressure * (sign * v[body.axis] + theta / gamma * body.normal(v)), face)
    contact = found.operator
    pressure = found.gamma * (contact.gap_matrix @ traced)
    assert close(body.spread(contact.resultant(contact.weights * pressure)), assembled(form))
    assert contact.symmetric == (theta == 1)


@pytest.mark.slow(minutes=0.1)
@every_mesh
def test_correction_of_the_stiffness_is_the_assembled_form(name: str) -> None:
    """K_N = K - theta/gamma int sigma_n sigma_n, assembled by DOLFINx, to 1e-12 of the largest entry of K.

    For `correction` with the same gamma at all points, for the gamma of the operator, and for the stiffness of the
    model.
    """
    body = block(name)
    u, v = ufl.TrialFunction(body.space), ufl.TestFunction(body.space)
    product, gamma, size = body.normal(u) * body.normal(v), 3.0e13, body.model.dofs
    plain, same = body.plain_stiffness(), assembled(body.over_both(product)) / gamma
    varying = assembled(body.over_both(product / body.gamma))
    for theta in THETAS:
        alike = correction(body.stress_matrix(), body.contact.weights, np.full(body.contact.size, gamma), theta)
        assert abs(spread(Springs(body.interface, alike), size) + theta * same).max() < 1e-12 * abs(plain).max()
        own = spread(body.operator(theta).correction, size)
        assert abs(own + theta * varying).max() < 1e-12 * abs(plain).max()
    assert abs(varying).max() > 1e-2 * abs(plain).max()
    assert abs(stiffness_of(body.model) - (plain - varying)).max() < 1e-12 * abs(plain).max()


@pytest.mark.parametrize("layers", [1, 2])
@every_mesh
def test_trace_bound_is_sharp(name: str, layers: int) -> None:
    """Int sigma_n^2 <= lambda a(u, u) on the contact cells for random u, and equal for the worst u within 1e-8.

    A cell's own forms, assembled by DOLFINx with tags for this cell alone; the largest eigenvalue by SciPy. With one
    layer of cells both faces press on the same cell, whose bound is that of both facets together.
    """
    body = block(name, layers)
    u, v, topology = ufl.TrialFunction(body.space), ufl.TestFunction(body.space), body.space.mesh.topology
    topology.create_connectivity(body.dimension - 1, body.dimension)
    owner = topology.connectivity(body.dimension - 1, body.dimension)
    both = set.intersection(*({int(owner.links(facet)[0]) for facet in facets} for facets in body.faces.values()))
    if layers == 1 and ("quadrilateral" in name or "hexahedron" in name):
        assert both
    cells, rigid = sorted(body.bounds), {2: 3, 3: 6}[body.dimension]
    random = np.random.default_rng(0)
    for cell in {cells[0], cells[-1], *list(both)[:1]}:
        one = np.array([cell], dtype=np.int32)
        tagged = mesh.meshtags(body.space.mesh, body.dimension, one, one * 0 + 1)
        mine = [facet for facets in body.faces.values() for facet in facets if owner.links(facet)[0] == cell]
        facets = np.array(mine, dtype=np.int32)
        sides = mesh.meshtags(body.space.mesh, body.dimension - 1, np.sort(facets), facets * 0 + 1)
        inside = ufl.Measure("dx", body.space.mesh, subdomain_data=tagged)(1)
        outside = ufl.Measure("ds", body.space.mesh, subdomain_data=sides)(1)
        dofs = body.space.dofmap.cell_dofs(cell)
        mine = (dofs[:, None] * body.dimension + np.arange(body.dimension)).reshape(-1)
        elastic, traced = (
            assembled(body.width * form)[mine][:, mine].toarray()
            for form in (ufl.inner(body.sigma(u), ufl.grad(v)) * inside, body.normal(u) * body.normal(v) * outside)
        )
        values, vectors = np.linalg.eigh(elastic)
        assert values[rigid - 1] < 1e-12 * values[-1] < values[rigid]
        vectors = vectors[:, rigid:]
        worst = eigh(vectors.T @ traced @ vectors, vectors.T @ elastic @ vectors, eigvals_only=True)[-1]
        assert body.bounds[cell] == pytest.approx(worst, rel=1e-8)
        for _ in range(20):
            x = random.standard_normal(len(mine))
            assert x @ traced @ x <= body.bounds[cell] * (x @ elastic @ x)


@pytest.mark.parametrize("layers", [1, pytest.param(2, marks=pytest.mark.slow)])
@every_mesh
def test_corrected_stiffness_is_semidefinite(name: str, layers: int) -> None:
    """K_N has no negative eigenvalue with the factors 2 and 1, and one with a factor of 0.3, for theta = 1.

    Source: the trace inequality, cell by cell; eigenvalues by LAPACK, to 1e-13 of the largest.
    """
    body = block(name, layers)
    plain, own = body.plain_stiffness(), spread(body.operator(1).correction, body.model.dofs)
    for factor, semidefinite in ((2.0, True), (1.0, True), (0.3, False)):
        values = eigvalsh((plain + own * (FACTOR / factor)).toarray())
        assert (values[0] > -1e-13 * values[-1]) == semidefinite
    # away from the bound: half of the elastic stiffness is left in every direction
    assert eigvalsh((0.5 * plain + own).toarray())[0] > -1e-13 * abs(plain).max()


@pytest.mark.parametrize("degree", [1, 2])
def test_high_cells_have_the_bound_of_a_column(degree: int) -> None:
    """Cells 2400 times as high as long: lambda = E / (1 - nu^2) (p^2 + (2 p + 1) nu^2) / height, to 1e-6.

    In a column the strains are free polynomials in y, eps_yy of degree p - 1 and eps_xx of degree p; Legendre's
    polynomial of degree k has the trace 2 k + 1. Stiff and soft modes of such cells are 1e13 apart.
    """
    cells = {"size": 0.02, "support_size": 0.0125, "edge_size": 2.5e-6, "cells_through_thickness": 2, "degree": degree}
    contact = {"formulation": {"type": "nitsche", "factor": FACTOR}}
    model = beam_model({"beam": {"length": 0.1}, "mesh": cells, "contact": contact}, loads=())
    exact = 2.1e11 / (1.0 - 0.3**2) * (degree**2 + (2 * degree + 1) * 0.3**2) / 6.0e-3
    assert model.law.stiffness == pytest.approx(FACTOR * exact, rel=1e-6)


@pytest.mark.parametrize(("theta", "least"), [(1, 1.0), (0, 0.25)])
def test_too_small_a_factor_is_refused(theta: int, least: float) -> None:
    """At (1 + theta)^2 / 4 the method is no longer monotone: said, not computed. theta = -1 takes any factor.

    Source: Chouly, Hild and Renard (2015): well posed for gamma above a bound, which falls to 0 with theta = -1.
    """
    with pytest.raises(UserError, match=f"factor = {least:g}; nitsche with theta = {theta:g} needs more"):
        Nitsche(theta, least, (1.0, 1.0), 1.0)
    assert Nitsche(theta, 1.01 * least, (1.0, 1.0), 1.0).factor > least
    assert Nitsche(-1, 1e-6, (1.0, 1.0), 1.0).theta == -1
