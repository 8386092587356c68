"""The midpoint rule, with the contact pressure as a discrete gradient or fully implicit.

    M (v1 - v0)/dt + C vm + K um = f(tm) + G^T (w p),   um = (u0 + u1)/2,   vm = (v0 + v1)/2 = (u1 - u0)/dt

Unknown is vm:  (2/dt M + C + dt/2 K) vm = f + G^T (w p) + 2/dt M v0 - K u0. Second order; no algorithmic damping.

* Discrete gradient: p does exactly the work that the contact potential loses, so energy is conserved at any step.
* Contact-implicit: p is the law at t1; a convex potential then only loses energy (Kane et al. 1999).

Friction opposes vm with the pressure of the step, so that it loses energy at any step.

Source: Simo and Tarnow (1992); Gonzalez (1996); Kane, Repetto, Ortiz and Marsden (1999).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.law_tables import IMPLICIT, MEAN
from gapbeam.solver.contact.solve.condensation import Condensed
from gapbeam.solver.contact.solve.friction_solve import Sliding, solve_contact_and_friction
from gapbeam.solver.integrators.effective_operator import hold, image_of_solution
from gapbeam.solver.integrators.time_scheme import (
    STIFF_CONTACT,
    KernelNumbers,
    NoiseBias,
    StiffnessRange,
    TimeScheme,
)
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, SemiDiscreteSystem, Stage, State, Step

PressureOverStep = Callable[[Array, Array, float], StagePressure]


class Midpoint(TimeScheme):
    """The midpoint rule; `implicit` schemes take the contact pressure at the end of the step."""

    carries_acceleration: ClassVar[bool] = False
    contact_range: ClassVar[StiffnessRange] = STIFF_CONTACT
    has_period_map: ClassVar[bool] = True
    marches_sets: ClassVar[bool] = True

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator."""
        return 2.0 / dt + system.mass_damping, 0.5 * dt + system.stiffness_damping, 1.0

    def amplification(self, angle: float) -> Array:
        """Return the matrix of a step on (u, dt v): u1 - u0 = dt (v0 + v1)/2, v1 - v0 = -dt w^2 (u0 + u1)/2."""
        half = 0.5 * angle * angle
        return np.asarray(np.linalg.solve(np.array([[1.0, -0.5], [half, 1.0]]), np.array([[1.0, 0.5], [-half, 1.0]])))

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step; the stage pressure is the mean over the step. Collective."""
        law = law.touched_at(old.touch_speed).yielded_by(old.plastic_set)
        pressure_over_step: PressureOverStep = law.implicit if self.implicit else law.discrete_gradient
        contact, operators = system.contact, system.operators
        factors = system.middle_factors(np.array([old.time]), dt)[0]
        right_side = system.combine_loads(factors) + (2.0 / dt) * old.v[MASS] - old.u[STIFFNESS]
        held = hold(system, right_side, old.pressure)
        started = time.perf_counter()
        free = condensed.solve_free(right_side)
        solved = time.perf_counter()
        free_trace = contact.interface.trace(free, operators)
        opened = contact.walls.grown(old.time, old.time + dt)
        free_depth = old.depth - dt * (contact.gap_matrix @ free_trace) - opened
        solution = solve_contact_and_friction(
            Sliding.of(law, contact, 1.0, free_trace, old),
            condensed,
            dt,
            free_depth,
            contact.weights,
            lambda depth: pressure_over_step(old.depth, depth, dt),
            held,
            max_iterations,
            law.augmented,
        )
        middle_velocity = image_of_solution(
            system, condensed, free, right_side, solution.change, solution.friction, solution.response
        )
        new = State(
            time=old.time + dt,
            u=old.u + dt * middle_velocity,
            v=2.0 * middle_velocity - old.v,
            depth=solution.depth,
            pressure=solution.forces / contact.weights,
            traction=solution.traction(contact.weights),
        )
        stage = Stage(
            load_factors=factors,
            inertia_and_elastic=(new.v[MASS] - old.v[MASS]) / dt + 0.5 * (new.u[STIFFNESS] + old.u[STIFFNESS]),
            velocity=middle_velocity,
            pressure=new.pressure,
            elastic_pressure=solution.law.elastic,
            traction=new.traction,
            unresolved=solution.unresolved,
        )
        return Step(old, new, stage, solution.iterations, timings={"back_substitution": solved - started})

    @property
    def creates_energy(self) -> bool:
        """No: the potential of the contact is convex."""
        return False

    @property
    def kernel(self) -> KernelNumbers:
        """The form of the law."""
        return KernelNumbers(IMPLICIT if self.implicit else MEAN)


class DiscreteGradient(Midpoint):
    """Midpoint rule with the discrete gradient of the contact potential: conserves energy at any step."""

    type: Literal["discrete-gradient"] = Field(default="discrete-gradient", description="name of the scheme")
    needs_potential: ClassVar[bool] = True
    conserves_energy: ClassVar[bool] = True
    noise_bias: ClassVar[tuple[NoiseBias, ...]] = (
        NoiseBias(1.0, 0.01, 0.5, -0.089, -0.56, -0.044),
        NoiseBias(2.0, 0.0025, 0.16, -0.028, -0.28, -0.015),
        NoiseBias(4.0, 0.0, 0.056, 0.0, -0.091, 0.0),
        NoiseBias(8.0, 0.0, 0.014, 0.0, -0.023, 0.0),
        NoiseBias(16.0, 0.0, 0.0046, 0.0, 0.0, 0.0),
    )


class ImplicitMidpoint(Midpoint):
    """Midpoint rule with the contact pressure fully implicit: cheap, dissipates at impacts."""

    type: Literal["implicit-midpoint"] = Field(description="name of the scheme")
    implicit: ClassVar[bool] = True
    noise_bias: ClassVar[tuple[NoiseBias, ...]] = (
        NoiseBias(1.0, -0.24, 0.36, -0.5, -0.8, -0.17),
        NoiseBias(2.0, -0.25, 0.03, -0.47, -0.71, -0.14),
        NoiseBias(4.0, -0.22, -0.06, -0.37, -0.57, -0.1),
        NoiseBias(8.0, -0.16, -0.066, -0.25, -0.39, -0.072),
        NoiseBias(16.0, -0.11, -0.042, -0.15, -0.24, -0.041),
    )
