"""Condensed steps against the textbook's Newton, on the same beam from the same seat, side by side.

The solid beam of cases/li2013.toml (about 29 000 DOFs) with the scheme implicit-midpoint, which the textbook's residual
is written for, is shaken so hard that base and gland open and close within the steps measured.

    environment/run python3 -m benchmarks.textbook

The beam in its support as the demos of DOLFINx would have it: a residual in UFL, Newton, everything anew each time.

    rho (v1 - v0)/dt . w + (sigma(um) + c_K sigma(vm)) : eps(w) + c_M rho vm . w + restraint = gravity . w + p n . w,
    um = (u0 + u1)/2,   vm = (u1 - u0)/dt,   v1 = 2 vm - v0,   p = eps max(-g(u1), 0) on both faces

This is the scheme `implicit-midpoint` of gapbeam, with the same penalty and the same quadrature. The unknown is u1. In
each iteration the Jacobian, which UFL derives, is assembled and factored anew.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from benchmarks.table import Cell, Table, machine_words, options, seconds
from gapbeam.solver.assembly.elasticity import lame
from gapbeam.solver.case.beam_motions import axial_restraint, lateral_restraint
from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import March, march
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.semi_discrete import VALUE, State


def stress(u: Any, material: Material, plane_stress: bool) -> Any:
    """Return sigma(u) = lambda tr(eps) I + 2 mu eps (UFL), Pa; in plane."""
    first, second = lame(material, plane_stress)
    strain = ufl.sym(ufl.grad(u))
    return first * ufl.tr(strain) * ufl.Identity(len(u)) + 2.0 * second * strain


RELATIVE_TOLERANCE = (
    1.0e-8  # of residual or update; at DOLFINx's default of 1e-9 round-off makes it iterate for nothing
)
MOST_ITERATIONS = 40


class TextbookBeam:
    """A beam that is marched by Newton's method on the whole residual; penalty contact without damping, one rank.

    Args:
        case: The case of the model.
        model: Mesh, space, material and loads come from here; nothing of its operators is used but the pattern of
            point forces.
        start: The state to start from.
        factorization: "lu", as the demos have it, or "cholesky", which knows that the Jacobian is symmetric.
    """

    def __init__(self, case: Case, model: Model, start: State, factorization: str = "lu") -> None:
        self._case, self._model, self._dt, self.time = case, model, model.step, start.time
        self._old, self._old_velocity = fem.Function(model.space), fem.Function(model.space)
        self._new = fem.Function(model.space)
        self._old.x.array[:] = start.u[VALUE]
        self._old_velocity.x.array[:] = start.v[VALUE]
        residual = self._residual()
        self._residual_form = fem.form(residual)
        self._jacobian_form = fem.form(ufl.derivative(residual, self._new))
        self._vector = fem_petsc.assemble_vector(self._residual_form)
        self._matrix = fem_petsc.assemble_matrix(self._jacobian_form)
        self._matrix.assemble()
        self._update = self._matrix.createVecRight()
        self._solver = PETSc.KSP().create(model.space.mesh.comm)
        self._solver.setType("preonly")
        self._solver.getPC().setType(factorization)
        self._solver.getPC().setFactorSolverType("mumps")
        if factorization == "cholesky":
            self._matrix.setOption(PETSc.Mat.Option.SPD, True)

    @property
    def displacement(self) -> NDArray[np.float64]:
        """The displacement at the last accepted time, (n,), m."""
        return np.array(self._old.x.array)

    def advance(self) -> int:
        """Advance by one step, and return the Newton iterations: Jacobians assembled and factored.

        Raises:
            RuntimeError: Newton's method did not converge.
        """
        self._new.x.array[:] = self._old.x.array + self._dt * self._old_velocity.x.array
        first = size = self._assemble_residual()
        iterations, settled = 0, False
        while not settled and size > RELATIVE_TOLERANCE * first:
            if iterations == MOST_ITERATIONS:
                raise RuntimeError(f"Newton's method did not converge at t = {self.time:.6g} s: {size / first:.2e}")
            self._matrix.zeroEntries()
            fem_petsc.assemble_matrix(self._matrix, self._jacobian_form)
            self._matrix.assemble()
            self._solver.setOperators(self._matrix)
            self._solver.solve(self._vector, self._update)
            self._new.x.array[:] -= self._update.array_r
            size, iterations = self._assemble_residual(), iterations + 1
            settled = self._update.norm() <= RELATIVE_TOLERANCE * float(np.linalg.norm(self._new.x.array))
        velocity = 2.0 / self._dt * (self._new.x.array - self._old.x.array) - self._old_velocity.x.array
        self._old.x.array[:] = self._new.x.array
        self._old_velocity.x.array[:] = velocity
        self.time += self._dt
        return iterations

    def _assemble_residual(self) -> float:
        """Assemble the residual with the point forces, which UFL does not know, and return its norm."""
        self._vector.set(0.0)
        fem_petsc.assemble_vector(self._vector, self._residual_form)
        middle = self.time + 0.5 * self._dt
        for load, given in zip(self._model.system.loads, self._case.load, strict=True):
            if not given.static:
                self._vector.array[:] -= load.factor(middle) * load.pattern
        return float(self._vector.norm())

    def _residual(self) -> Any:
        """Return the residual of a step with gravity and contact, in UFL."""
        model, case, dt = self._model, self._case, self._dt
        mesh = model.space.mesh
        axis, plane = mesh.geometry.dim - 1, case.mesh.plane == "stress" and mesh.geometry.dim == 2
        width = case.beam.width if axis == 1 else 1.0
        # one quadrature for all that acts on a face: DOLFINx 0.9 confuses a form's integrals over the same two groups
        # with two quadratures each
        quadrature = {"quadrature_degree": model.point_rule.degree}
        faces = ufl.Measure("ds", domain=mesh, subdomain_data=model.tagged.facets, metadata=quadrature)
        base, gland = (faces(model.tagged.groups[name]) for name in ("base", "gland"))
        area = model.system.contact.area
        test = ufl.TestFunction(model.space)
        middle = 0.5 * (self._old + self._new)
        middle_velocity = (self._new - self._old) / dt
        acceleration = (2.0 / dt) * (middle_velocity - self._old_velocity)
        density, damping = case.material.density, model.system.mass_damping
        felt = middle + model.system.stiffness_damping * middle_velocity
        residual = density * ufl.inner(acceleration + damping * middle_velocity, test) * ufl.dx
        residual += ufl.inner(stress(felt, case.material, plane), ufl.sym(ufl.grad(test))) * ufl.dx
        for along, stiffness in enumerate((axial_restraint(case).value, lateral_restraint(case).value)[:axis]):
            residual += stiffness / area * felt[along] * test[along] * (base + gland)
        for load in case.load:
            if (weight := load.weight_acceleration) > 0.0:
                residual += density * weight * test[axis] * ufl.dx
        penalty, rise = model.law.stiffness, self._new[axis]
        residual -= penalty * ufl.max_value(-rise, 0.0) * test[axis] * base
        residual += penalty * ufl.max_value(rise - case.layout.clearance, 0.0) * test[axis] * gland
        return width * residual


@dataclass(frozen=True)
class Seated:
    """A model at rest in its support, ready to march.

    Attributes:
        model: The model.
        plan: Its march; the operators are made.
        start: The seat.
        seconds: Wall time of each part of the set-up.
    """

    model: Model
    plan: March
    start: State
    seconds: dict[str, float]


@dataclass(frozen=True)
class Marched:
    """Cost of some marched steps.

    Attributes:
        per_step: Mean wall time of a step with all that is kept of it: energy, gates, episodes, peaks; s.
        back_substitution: Mean wall time of the back-substitution in it, s.
        iterations: Mean iterations of the contact solve.
        active: Largest number of contact points under pressure.
        displacements: u after each step where asked for, else empty.
    """

    per_step: float
    back_substitution: float
    iterations: float
    active: int
    displacements: tuple[NDArray[np.float64], ...] = ()


def seated(case: Case, comm: MPI.Comm = MPI.COMM_SELF) -> Seated:
    """Mesh, assemble, seat and factor a case, by default on this process alone. Collective."""
    simulation = Simulation.of_case(case, comm)
    model, plan = simulation.model, simulation.plan
    clock = time.perf_counter()
    seat = simulation.seat()
    spent = {"seat": time.perf_counter() - clock}
    return Seated(model, plan, seat.state, model.body.seconds | spent | simulation.factor())


def marched(start: Seated, steps: int, keep: bool = False) -> Marched:
    """March some steps from the seat; `keep` keeps the displacements."""
    system, plan = start.model.system, replace(start.plan, steps=steps)
    accounts = Accounts.opened(system, start.model.law, start.start, plan.dt)
    back, iterations, active, kept, spent = 0.0, 0, 0, [], 0.0
    clock = time.perf_counter()
    for step in march(plan, start.start):
        accounts.take(step)
        spent += time.perf_counter() - clock
        back += step.timings["back_substitution"]
        iterations += step.iterations
        active = max(active, int(np.count_nonzero(step.new.pressure)))
        if keep and step.completes:
            kept.append((step.refreshed or step.new).u[VALUE].copy())
        clock = time.perf_counter()
    return Marched(spent / steps, back / steps, iterations / steps, active, tuple(kept))


CASE = Path(__file__).parents[1] / "cases" / "li2013.toml"
SHAKEN = (
    "time.scheme=implicit-midpoint",
    "load.shaker.ramp=0.0",
    "load.shaker.amplitude=500.0",
    "load.shaker.frequency=100.0",
)
STEPS, LONG = 14, 400  # of both ways; of the condensed steps against their back-substitution
FACTORIZATIONS = {"lu": STEPS, "cholesky": STEPS}  # steps of the textbook with each way to factor its Jacobian
AGREEMENT = 1.0e-8
WANTED_RATIO, WANTED_SHARE = 100.0, 1.5


def compare(case: Case, steps: dict[str, int], long: int) -> Table:
    """Return the table of a case.

    Args:
        case: The case, with the scheme implicit-midpoint, penalty contact and without contact damping.
        steps: Steps of the textbook with each way to factor its Jacobian.
        long: Steps for the ratio of a condensed step to its back-substitution.
    """
    start = seated(case)
    most = max(steps.values())
    marched(start, 2)
    condensed = marched(start, most, keep=True)
    rows: list[tuple[Cell, ...]] = []
    ratios: dict[str, float] = {}
    worst = 0.0
    for factorization, count in steps.items():
        textbook = TextbookBeam(case, start.model, start.start, factorization)
        spent, iterations, difference = 0.0, 0, 0.0
        beside: list[Marched] = []  # whole condensed marches, one after each step of the textbook, on the same load
        for expected in condensed.displacements[:count]:
            clock = time.perf_counter()
            iterations += textbook.advance()
            spent += time.perf_counter() - clock
            missed = np.max(np.abs(textbook.displacement - expected)) / np.max(np.abs(expected))
            difference = max(difference, float(missed))
            beside.append(marched(start, count))
        per_step = float(np.mean([one.per_step for one in beside]))
        ratios[factorization] = spent / count / per_step
        worst = max(worst, difference)
        rows.append(
            (f"textbook, {factorization}", count, seconds(spent / count), f"{iterations / count:.1f}", 1.0, difference)
        )
        rows.append(
            (
                "condensed, the same steps",
                count,
                seconds(per_step),
                f"{beside[0].iterations:.1f}",
                ratios[factorization],
                None,
            )
        )
    whole = marched(start, long)
    share = whole.per_step / whole.back_substitution
    rows.append(("condensed", long, seconds(whole.per_step), f"{whole.iterations:.1f}", None, None))
    rows.append(("- its back-substitution", long, seconds(whole.back_substitution), "-", None, None))
    model = start.model
    setup = {name: f"{value:.2g} s" for name, value in start.seconds.items()}
    return Table(
        "textbook",
        f"Condensed against textbook, {model.dofs} DOFs, {model.system.contact.size} contact points",
        ("way", "steps", "per step", "iterations", "times faster", "difference"),
        tuple(rows),
        (
            machine_words(),
            "the condensed march is repeated after each step of the textbook, so that both meet the same machine",
            f"up to {whole.active} contact points under pressure; set-up of the condensed way: "
            + ", ".join(f"{name} {value}" for name, value in setup.items()),
            "difference: largest in any displacement relative to the largest displacement, over all steps; "
            f"{worst:.1e} "
            f"{'is' if worst <= AGREEMENT else 'is NOT'} below {AGREEMENT:g}",
            f"times faster: {min(ratios.values()):.0f} or more, wanted {WANTED_RATIO:.0f}: "
            f"{'met' if min(ratios.values()) >= WANTED_RATIO else 'NOT met'}",
            f"the condensed step is {share:.2f} times its back-substitution, wanted at most {WANTED_SHARE}: "
            f"{'met' if share <= WANTED_SHARE else 'NOT met'}",
        ),
        {"difference": worst, "step_over_back_substitution": share}
        | {f"ratio_{name}": ratio for name, ratio in ratios.items()},
    )


def shaken(path: Path = CASE, overrides: Sequence[str] = ()) -> Case:
    """Return a case that rattles within a few steps."""
    return read_case(path, [*SHAKEN, *overrides])


if __name__ == "__main__":
    chosen = options(__doc__)
    compare(shaken(), FACTORIZATIONS, LONG).write(chosen.output)
