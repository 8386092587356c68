"""Moreau and Jean's scheme: contact as impulses, with a coefficient of restitution.

    M (v1 - v0) + dt (C vt + K ut) = dt f(t0 + theta dt) + H^T P,    vt = theta v1 + (1-theta) v0,
    u1 = u0 + dt vt,    ut = u0 + theta dt vt

Where the gap predicted at half a step is closed, the gap rate obeys Newton's law of impact,

    0 <= P  orthogonal to  g'1 + e g'0 >= 0    for g'0 <= 0;    elsewhere P = 0.

A face that opens at the start of the step, g'0 > 0, but would close in it, obeys theta g'1 + (1 - theta) g'0 >= 0: then
P does no work. Newton's law would push it apart at (1 - e) g'0 / 2, and make energy, up to a fifth of all that a rod
has in long steps. Impulses make no energy where theta <= 1 / (1 + e) (Acary 2016, prop. 4).

The unknown is vt: ((M / (theta dt) + C + theta dt K) vt = f + H^T P/dt + M v0 / (theta dt) - K u0. Friction opposes vt
under the impulses of the step. First order at impacts; gaps are not corrected, so a face penetrates by up to its
approach speed times half a step, and stays there.

Source: Jean (1999), Comput. Methods Appl. Mech. Eng. 177, 235-257; Acary and Brogliato (2008), ch. 10; Acary (2016),
Z. Angew. Math. Mech. 96, 585-603.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.solve.condensation import Condensed, CondensedOperator
from gapbeam.solver.contact.solve.friction_solve import Sliding, solve_contact_and_friction
from gapbeam.solver.integrators.effective_operator import hold, image_of_solution
from gapbeam.solver.integrators.time_scheme import SOFT_CONTACT, StiffnessRange, TimeScheme
from gapbeam.solver.schema.table import Number
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, Stage, State, Step

RIGID = 1.0e-10  # compliance of the rate constraint over the compliance of the contact points
ROUNDED = 1.0e-6  # of theta: what is lost by writing 1 / (1 + e) with a few digits


class MoreauJean(TimeScheme):
    """Moreau and Jean's scheme: contact as impulses with a restitution; for the formulation unilateral."""

    type: Literal["moreau-jean"] = Field(description="name of the scheme")
    theta: Number = Field(default=0.5, ge=0.5, le=1, description="weight of the new velocity, no unit")
    restitution: Number = Field(default=0.0, ge=0, le=1, description="coefficient of restitution, no unit")
    carries_acceleration: ClassVar[bool] = False
    contact_range: ClassVar[StiffnessRange] = SOFT_CONTACT  # impulses know no stiffness
    needs_factor: ClassVar[bool] = True
    impulses: ClassVar[bool] = True

    @property
    def excess(self) -> tuple[str, str, str] | None:
        """A theta above 1 / (1 + e): vt then leaves the stop at an impact, and the impulse does work on the body."""
        largest = 1.0 / (1.0 + self.restitution)
        if self.theta <= (1.0 + ROUNDED) * largest:
            return None
        found = f"theta = {self.theta:g} with restitution = {self.restitution:g}"
        return found, f"theta of at most 1 / (1 + restitution) = {largest:.6g}", f"theta = {largest:.6g}"

    @property
    def creates_energy(self) -> bool:
        """True for theta > 1 / (1 + e)."""
        return self.excess is not None

    def warnings(self) -> Iterator[str]:
        """Yield a warning of created energy."""
        if self.excess is not None:
            found, expected, _ = self.excess
            yield f"{found} makes energy at impacts; {expected} makes none"

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator."""
        return 1.0 / (self.theta * dt) + system.mass_damping, self.theta * dt + system.stiffness_damping, 1.0

    def amplification(self, angle: float) -> Array:
        """Return the matrix of a step without contact on (u, dt v): vt = theta v1 + (1 - theta) v0 moves u by dt vt."""
        theta, square = self.theta, angle * angle
        new = np.array([[1.0, -theta], [0.0, 1.0 + theta * theta * square]])
        old = np.array([[1.0, 1.0 - theta], [-square, 1.0 - theta * (1.0 - theta) * square]])
        return np.asarray(np.linalg.solve(new, old))

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step. Collective.

        Impulses follow from the rates alone: of the law, only its friction counts.
        """
        contact, operators, theta = system.contact, system.operators, self.theta
        factors = system.load_factors(old.time + theta * dt)
        right_side = system.combine_loads(factors) + old.v[MASS] / (theta * dt) - old.u[STIFFNESS]
        old_rate = contact.closing_speed(contact.interface.trace(old.v[VALUE], operators), old.time)
        closed = old.depth + 0.5 * dt * old_rate >= 0.0
        held = hold(system, right_side, np.where(closed, old.pressure, 0.0))
        started = time.perf_counter()
        free = condensed.solve_free(right_side)
        solved = time.perf_counter()
        free_trace = contact.interface.trace(free, operators)
        free_rate = -(contact.gap_matrix @ free_trace) - contact.walls.grown(old.time, old.time + dt) / dt
        allowed = (1.0 - theta - theta * self.restitution) * np.maximum(old_rate, 0.0)
        assert isinstance(condensed, CondensedOperator)  # impulses are solved for with a factor
        stiffness = 1.0 / (RIGID * dt * np.maximum(condensed.diagonal, 1e-300) * contact.weights)

        def impulses(excess: Array) -> StagePressure:
            pressed = closed & (excess > 0.0)
            pressure = np.where(pressed, stiffness * excess, 0.0)
            return StagePressure(pressure, np.where(pressed, stiffness, 0.0), np.zeros_like(pressure))

        solution = solve_contact_and_friction(
            Sliding.of(law, contact, 1.0, free_trace, old),
            condensed,
            dt,
            dt * (free_rate - allowed),
            contact.weights,
            impulses,
            held,
            max_iterations,
        )
        velocity = image_of_solution(
            system, condensed, free, right_side, solution.change, solution.friction, solution.response
        )
        new = State(
            time=old.time + dt,
            u=old.u + dt * velocity,
            v=np.asarray((velocity - (1.0 - theta) * old.v) / theta),
            depth=old.depth + solution.depth + dt * allowed,
            pressure=solution.forces / contact.weights,
            traction=solution.traction(contact.weights),
        )
        stage = Stage(
            load_factors=factors,
            inertia_and_elastic=(new.v[MASS] - old.v[MASS]) / dt + old.u[STIFFNESS] + theta * dt * velocity[STIFFNESS],
            velocity=velocity,
            pressure=new.pressure,
            elastic_pressure=np.zeros_like(new.pressure),
            traction=new.traction,
            unresolved=solution.unresolved,
        )
        return Step(old, new, stage, solution.iterations, timings={"back_substitution": solved - started})
