"""The condensed step against a textbook Newton iteration that knows nothing of contact operators.

The same discrete-gradient step is written in UFL on the same space: contact as an integral over the facets of base
and gland, the Jacobian by symbolic differentiation, reassembled and refactored in every iteration.
"""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from scipy.sparse.linalg import splu

from gapbeam.solver.case.beam_motions import axial_restraint
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.contact.solve import condensation
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from tests.shared.forms import compiled_form
from tests.shared.models import COARSE, SOLID, beam_model, thrown

EPS = 5.0e11  # Pa/m
CLEARANCE = 0.107e-3  # m
DT = 5.0e-5  # s
STEPS = 60
E, NU, DENSITY, WIDTH, THICKNESS = 2.1e11, 0.3, 7919.0, 0.02, 0.012


def pressure_of(old, new, damping, implicit):
    """Mean pressure over a step (UFL): discrete gradient of eps <d>^2 / 2, or eps <d1>; plus c (<d1> - <d0>) / dt."""
    start, end = ufl.max_value(old, 0.0), ufl.max_value(new, 0.0)
    if implicit:
        pressure = EPS * end
    else:
        stays = ufl.And(ufl.gt(old, 0.0), ufl.gt(new, 0.0))
        crosses = ufl.Or(ufl.gt(old, 0.0), ufl.gt(new, 0.0))
        apart = ufl.conditional(ufl.Or(stays, ufl.Not(crosses)), 1.0, new - old)
        quotient = 0.5 * EPS * (end * end - start * start) / apart
        pressure = ufl.conditional(stays, 0.5 * EPS * (start + end), ufl.conditional(crosses, quotient, 0.0))
    damped = pressure + damping / DT * (end - start)
    return ufl.max_value(damped, 0.0) if damping else pressure


class TextbookStep:
    """One step of the midpoint rule for (u, v) -> (u1, v1) by Newton's method on all DOFs."""

    def __init__(self, model, damping, implicit):
        case, space, tagged = model.case, model.space, model.tagged
        self.old, self.new, self.speed = (fem.Function(space) for _ in range(3))
        self.shake = fem.Constant(space.mesh, 0.0)
        test = ufl.TestFunction(space)
        degree = {"quadrature_degree": 2 * case.mesh.degree + 2}
        facets = ufl.Measure("ds", domain=space.mesh, subdomain_data=tagged.facets)
        base, gland = (facets(tagged.groups[name], metadata=degree) for name in ("base", "gland"))
        middle, mean_speed = 0.5 * (self.old + self.new), (self.new - self.old) / DT
        bent = middle + case.damping.stiffness * mean_speed

        def elastic(u):
            strain = ufl.sym(ufl.grad(u))
            sigma = E / (1.0 - NU**2) * ((1.0 - NU) * strain + NU * ufl.tr(strain) * ufl.Identity(2))
            restraint = axial_restraint(case).value / (2.0 * case.support.length * WIDTH)
            return ufl.inner(sigma, ufl.grad(test)) * ufl.dx + restraint * u[0] * test[0] * (base + gland)

        acceleration = 2.0 / DT * (mean_speed - self.speed) + case.damping.mass * mean_speed
        residual = ufl.inner(DENSITY * acceleration, test) * ufl.dx + elastic(bent)
        residual += DENSITY * (9.81 + self.shake) * test[1] * ufl.dx
        pressures = (
            pressure_of(-self.old[1], -self.new[1], damping, implicit),
            pressure_of(self.old[1] - CLEARANCE, self.new[1] - CLEARANCE, damping, implicit),
        )
        residual -= pressures[0] * test[1] * base - pressures[1] * test[1] * gland
        self._residual = compiled_form(WIDTH * residual)
        self._jacobian = compiled_form(ufl.derivative(WIDTH * residual, self.new))

    def take(self, u, v, shake):
        """Return displacement and velocity one step later, the base accelerating by `shake` in the middle of it."""
        self.old.x.array[:], self.speed.x.array[:], self.shake.value = u, v, shake
        self.new.x.array[:] = u + DT * v
        for _iteration in range(40):
            residual = fem.assemble_vector(self._residual).array
            matrix = fem.assemble_matrix(self._jacobian).to_scipy().tocsc()
            update = splu(matrix).solve(residual)
            self.new.x.array[:] -= update
            if np.linalg.norm(update) < 1e-13 * np.linalg.norm(self.new.x.array):
                break
        else:
            pytest.fail("the textbook iteration did not converge")
        new = self.new.x.array.copy()
        return new, 2.0 / DT * (new - u) - v


@pytest.mark.parametrize(
    ("damping", "implicit"), [(0.0, False), (2.0e7, False), (0.0, True)], ids=["conserving", "damped", "implicit"]
)
def test_condensed_march_is_the_textbook_march(damping: float, implicit: bool) -> None:
    """Displacement and velocity of all DOFs agree to 1e-8 through impacts on both faces, with all kinds of damping.

    A beam thrown at the gland turning, under gravity and a shaking base.
    """
    base = {"type": "base_motion", "amplitude": 400.0, "frequency": 200.0}
    model = beam_model(
        {
            "support": {"clearance": CLEARANCE},
            "mesh": COARSE,
            "damping": {"mass": 5.0, "stiffness": 1.0e-5},
        },
        ({"type": "gravity"}, base),
    )
    system = model.system
    contact, start = system.contact, thrown(model)
    u, v = start.u[0], start.v[0]
    scheme = scheme_of("implicit-midpoint" if implicit else "discrete-gradient")
    plan = March(system, kelvin_voigt(EPS, damping), scheme, EffectiveOperators(system, scheme), DT, STEPS)
    textbook = TextbookStep(model, damping, implicit)
    landings = {"base": 0, "gland": 0}
    closed = dict.fromkeys(landings, False)
    worst = [0.0, 0.0]
    for step in march(plan, start):
        u, v = textbook.take(u, v, system.loads[1].factor(step.old.time + 0.5 * DT))
        for face, name in enumerate(contact.face_names):
            pressed = bool(np.any(step.new.pressure[contact.faces == face] > 0.0))
            landings[name] += pressed and not closed[name]
            closed[name] = pressed
        worst = [
            max(was, float(np.linalg.norm(found - expected) / np.linalg.norm(expected)))
            for was, found, expected in zip(worst, (step.new.u[0], step.new.v[0]), (u, v), strict=True)
        ]
    assert min(landings.values()) >= 1
    assert sum(landings.values()) >= 3
    assert worst[0] < 1e-8
    assert worst[1] < 1e-7


@pytest.mark.parametrize("stiffness", [1.0e10, 1.0e12, 1.0e13])
def test_solves_by_way_of_the_interface_are_those_on_the_points(stiffness: float) -> None:
    """Many points on few interface DOFs: the same forces as of the matrix of all points, by numpy."""
    changes = {"contact": {"quadrature_degree": 19, "stiffness": stiffness}, "time": {"step": DT}}
    model = beam_model(changes | {"mesh": SOLID})
    contact, scheme = model.system.contact, scheme_of("discrete-gradient")
    condensed = EffectiveOperators(model.system, scheme).at(DT)
    points = np.flatnonzero(contact.faces == 1)
    compliance = 1.0 / (contact.weights[points] * stiffness)
    target = np.random.default_rng(0).standard_normal(len(points))
    found = condensed.solve_by_interface(DT, points, compliance, target)
    assert found is not None
    exact = np.linalg.solve(np.diag(compliance) + DT * condensed.delassus[np.ix_(points, points)], target)
    assert np.max(np.abs(found - exact)) <= 1e-10 * np.max(np.abs(exact))


def test_solves_by_way_of_the_interface_are_refused_where_they_cost_digits() -> None:
    """Nearly rigid contact, and few points: they are solved on the points."""
    model = beam_model({"contact": {"quadrature_degree": 19}, "mesh": SOLID})
    condensed = EffectiveOperators(model.system, scheme_of("discrete-gradient")).at(DT)
    points = np.flatnonzero(model.system.contact.faces == 1)
    rigid = np.full(len(points), 1.0e-20)
    assert condensed.solve_by_interface(DT, points, rigid, np.ones(len(points))) is None
    assert condensed.solve_by_interface(DT, points[:10], np.full(10, 1.0e-8), np.ones(10)) is None


def test_large_delassus_operators_are_made_where_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Among some points it is G A^-1 G^T by solves, whether the whole is kept or not; so is its diagonal."""
    model = beam_model({"contact": {"quadrature_degree": 9}, "mesh": SOLID})
    contact = model.system.contact
    condensed = EffectiveOperators(model.system, scheme_of("discrete-gradient")).at(DT)
    points = np.flatnonzero(contact.faces == 1)[::40]
    exact = []
    for point in points:
        force = np.zeros(contact.size)
        force[point] = 1.0
        right_side = np.zeros(model.system.operators.size)
        contact.interface.add(right_side, contact.resultant(force))
        moved = contact.interface.trace(condensed.solve_free(right_side), model.system.operators)
        exact.append((contact.gap_matrix @ moved)[points])
    size = np.max(np.abs(exact))
    assert np.max(np.abs(condensed.among(points) - exact)) <= 1e-10 * size
    monkeypatch.setattr(condensation, "_KEPT_WHOLE", 0.0)
    del condensed.delassus
    assert np.max(np.abs(condensed.among(points) - exact)) <= 1e-10 * size
    assert "delassus" not in vars(condensed)
    assert np.max(np.abs(condensed.diagonal[points] - np.diagonal(exact))) <= 1e-10 * size
