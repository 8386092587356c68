"""Generalized-alpha (Chung and Hulbert 1993), with Newmark (1959) and HHT-alpha (1977) as special cases.

    u1 = u0 + dt v0 + dt^2 ((1/2 - beta) a0 + beta a1),    v1 = v0 + dt ((1 - gamma) a0 + gamma a1)
    M a_m + C v_f + K u_f = f_f + G^T (w p_f),    x_m = (1-alpha_m) x1 + alpha_m x0,   x_f = (1-alpha_f) x1 + alpha_f x0

with the contact pressure weighted like the other forces, p_f = (1-alpha_f) p(d1, d1') + alpha_f p0. Unknown is a1.
Friction opposes v_f under p_f; the traction that a state shows is the law at its end, under p1 and v1.
"""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.law_tables import ENDPOINT
from gapbeam.solver.contact.solve.condensation import Condensed
from gapbeam.solver.contact.solve.friction_solve import Sliding, solve_contact_and_friction
from gapbeam.solver.integrators.effective_operator import hold, image_of_solution
from gapbeam.solver.integrators.time_scheme import (
    SOFT_CONTACT,
    KernelNumbers,
    NoiseBias,
    StiffnessRange,
    TimeScheme,
)
from gapbeam.solver.schema.table import Number
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, Stage, State, Step

SAFE_GAMMA = 0.65  # of Newmark's rule
SAFE_RADIUS = 0.5  # of generalized-alpha, at infinite frequency
SAFE_ALPHA = 0.2  # of HHT-alpha


class Weights(NamedTuple):
    """alpha_m, alpha_f, beta and gamma of the family."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


class AlphaFamily(TimeScheme):
    """A scheme of the family, by its weights.

    Schemes whose weights dissipate little were caught at creating energy at impacts: gamma up to 0.6 of Newmark's rule,
    alpha up to 0.15 of HHT-alpha, rho_inf down to 0.6 of generalized-alpha. At the limits it is left to the gates.

    Source: docs/benchmarks/stability.md for these limits; Chung and Hulbert (1993), J. Appl. Mech. 60, 371-375, eqs.
    17, 20 and 25 for the weights.
    """

    carries_acceleration: ClassVar[bool] = True
    contact_range: ClassVar[StiffnessRange] = SOFT_CONTACT

    @property
    @abstractmethod
    def weights(self) -> Weights:
        """The weights."""

    @property
    def kernel(self) -> KernelNumbers:
        """The weights."""
        return KernelNumbers(ENDPOINT, *self.weights)

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator."""
        alpha_m, alpha_f, beta, gamma = self.weights
        new = 1.0 - alpha_f
        mass = (1.0 - alpha_m) + new * gamma * dt * system.mass_damping
        stiffness = new * (beta * dt * dt + gamma * dt * system.stiffness_damping)
        return mass, stiffness, new * gamma * dt

    def amplification(self, angle: float) -> Array:
        """Return the matrix of a step on (u, dt v, dt^2 a): both updates, and the balance a_m + w^2 u_f = 0."""
        alpha_m, alpha_f, beta, gamma = self.weights
        square = angle * angle
        new = np.array([[1.0, 0.0, -beta], [0.0, 1.0, -gamma], [(1.0 - alpha_f) * square, 0.0, 1.0 - alpha_m]])
        old = np.array([[1.0, 1.0, 0.5 - beta], [0.0, 1.0, 1.0 - gamma], [-alpha_f * square, 0.0, -alpha_m]])
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
        """Advance by one step. Collective."""
        law = law.touched_at(old.touch_speed)
        contact, operators = system.contact, system.operators
        alpha_m, old_share, beta, gamma = self.weights
        new_share = 1.0 - old_share
        assert old.a is not None
        u_guess = old.u + dt * old.v + dt * dt * (0.5 - beta) * old.a
        v_guess = old.v + dt * (1.0 - gamma) * old.a
        u_stage = new_share * u_guess + old_share * old.u
        v_stage = new_share * v_guess + old_share * old.v
        factors = new_share * system.load_factors(old.time + dt) + old_share * system.load_factors(old.time)
        right_side = (
            system.combine_loads(factors) - alpha_m * old.a[MASS] - system.damping_force(v_stage) - u_stage[STIFFNESS]
        )
        held = hold(system, right_side, old.pressure)
        started = time.perf_counter()
        free = condensed.solve_free(right_side)
        solved = time.perf_counter()
        trace = contact.interface.trace
        guess_depth = contact.depth(trace(u_guess[VALUE], operators), old.time + dt)
        guess_rate = contact.closing_speed(trace(v_guess[VALUE], operators), old.time + dt)
        scale = beta * dt * dt
        rate_slope = gamma / (beta * dt)

        def stage_law(depth: Array) -> StagePressure:
            end = law.endpoint(depth, guess_rate + rate_slope * (depth - guess_depth), rate_slope)
            return StagePressure(
                new_share * end.pressure + old_share * old.pressure, new_share * end.slope, end.elastic
            )

        free_trace, sliding = trace(free, operators), None
        if law.friction is not None:
            rate = new_share * gamma * dt
            sliding = Sliding.of(law, contact, rate, trace(v_stage[VALUE], operators) + rate * free_trace, old)
        solution = solve_contact_and_friction(
            sliding,
            condensed,
            scale,
            guess_depth - scale * (contact.gap_matrix @ free_trace),
            contact.weights,
            stage_law,
            held,
            max_iterations,
            law.augmented,
        )
        acceleration = image_of_solution(
            system, condensed, free, right_side, solution.change, solution.friction, solution.response
        )
        stage_pressure = solution.forces / contact.weights
        lasting = old_share * old.pressure
        new = State(
            time=old.time + dt,
            u=u_guess + beta * dt * dt * acceleration,
            v=v_guess + gamma * dt * acceleration,
            depth=solution.depth,
            # open points are left without the round-off of the difference
            pressure=np.where(solution.law.pressure == lasting, 0.0, (stage_pressure - lasting) / new_share),
            a=acceleration,
        )
        if law.friction is not None:
            slip = contact.slip(trace(new.v[VALUE], operators))
            new = replace(new, traction=law.friction.of_points(old.slides).traction(new.pressure, slip))
        old_elastic = law.static(old.depth).pressure
        stage = Stage(
            load_factors=factors,
            inertia_and_elastic=(1.0 - alpha_m) * acceleration[MASS]
            + alpha_m * old.a[MASS]
            + new_share * new.u[STIFFNESS]
            + old_share * old.u[STIFFNESS],
            velocity=new_share * new.v + old_share * old.v,
            pressure=stage_pressure,
            elastic_pressure=new_share * solution.law.elastic + old_share * old_elastic,
            traction=solution.traction(contact.weights),
            unresolved=solution.unresolved,
        )
        return Step(old, new, stage, solution.iterations, timings={"back_substitution": solved - started})


class Newmark(AlphaFamily):
    """Newmark (1959); creates energy with stiff contact."""

    type: Literal["newmark"] = Field(description="name of the scheme")
    beta: Number = Field(
        default=0.25, gt=0, le=1, description="weight of the new acceleration in the displacement, no unit"
    )
    gamma: Number = Field(
        default=0.5, ge=0.5, le=1, description="weight of the new acceleration in the velocity, no unit"
    )
    noise_bias: ClassVar[tuple[NoiseBias, ...]] = (
        NoiseBias(1.0, 0.44, 0.59, 0.3, 0.24, 0.031),
        NoiseBias(2.0, 0.02, 0.17, 0.0, -0.13, -0.014),
        NoiseBias(4.0, 0.0, 0.051, 0.0, -0.046, 0.0),
        NoiseBias(8.0, 0.0, 0.012, 0.0, -0.0093, 0.0),
        NoiseBias(16.0, 0.0, 0.0046, 0.0, 0.0, 0.0),
    )

    @property
    def weights(self) -> Weights:
        """Weights of Newmark's rule, whose balance is taken at the new state."""
        return Weights(0.0, 0.0, self.beta, self.gamma)

    @property
    def creates_energy(self) -> bool:
        """True for gamma < 0.65."""
        return self.gamma < SAFE_GAMMA

    def warnings(self) -> Iterator[str]:
        """Yield warnings of small steps, or of created energy."""
        if 2 * self.beta < self.gamma:
            yield f"beta = {self.beta:g} < gamma/2 is unstable unless the step is tiny"
        else:
            yield from super().warnings()


class GeneralizedAlpha(AlphaFamily):
    """Generalized-alpha, Chung and Hulbert (1993)."""

    type: Literal["generalized-alpha"] = Field(description="name of the scheme")
    rho_inf: Number = Field(default=0.5, ge=0, le=1, description="spectral radius at infinite frequency, no unit")
    noise_bias: ClassVar[tuple[NoiseBias, ...]] = (
        NoiseBias(1.0, 0.065, 0.51, -0.04, -0.6, -0.058),
        NoiseBias(2.0, -0.032, 0.17, -0.081, -0.45, -0.039),
        NoiseBias(4.0, -0.017, 0.059, -0.025, -0.19, -0.0075),
        NoiseBias(8.0, -0.0046, 0.015, -0.004, -0.054, -0.0047),
        NoiseBias(16.0, -0.0019, 0.0055, 0.0, -0.0089, 0.0),
    )

    @property
    def weights(self) -> Weights:
        """Weights of the second-order scheme with this spectral radius at infinite frequency (eqs. 17, 20, 25)."""
        alpha_m = (2.0 * self.rho_inf - 1.0) / (self.rho_inf + 1.0)
        alpha_f = self.rho_inf / (self.rho_inf + 1.0)
        shift = 1.0 - alpha_m + alpha_f
        return Weights(alpha_m, alpha_f, 0.25 * shift * shift, 0.5 - alpha_m + alpha_f)

    @property
    def creates_energy(self) -> bool:
        """True for rho_inf > 1/2."""
        return self.rho_inf > SAFE_RADIUS

    def warnings(self) -> Iterator[str]:
        """Yield a warning of created energy."""
        if self.creates_energy:
            yield f"rho_inf = {self.rho_inf:g} creates energy at impacts; 0.5 or less hardly does"


class HHTAlpha(AlphaFamily):
    """HHT-alpha, Hilber, Hughes and Taylor (1977); creates energy with stiff contact."""

    type: Literal["hht-alpha"] = Field(description="name of the scheme")
    alpha: Number = Field(
        default=0.05, ge=0, le=0.3333333333333333, description="weight of the old forces, no unit; 0 is Newmark's rule"
    )
    noise_bias: ClassVar[tuple[NoiseBias, ...]] = (
        NoiseBias(1.0, 0.29, 0.56, 0.18, -0.07, 0.0),
        NoiseBias(2.0, 0.0, 0.17, -0.029, -0.22, -0.021),
        NoiseBias(4.0, -0.0071, 0.054, -0.0087, -0.084, 0.0),
        NoiseBias(8.0, -0.0026, 0.013, 0.0, -0.02, 0.0),
        NoiseBias(16.0, 0.0, 0.0048, 0.0, 0.0, 0.0),
    )

    @property
    def weights(self) -> Weights:
        """Weights of Hilber, Hughes and Taylor's scheme; their alpha is negative."""
        return Weights(0.0, self.alpha, 0.25 * (1.0 + self.alpha) ** 2, 0.5 + self.alpha)

    @property
    def creates_energy(self) -> bool:
        """True for alpha < 0.2."""
        return self.alpha < SAFE_ALPHA
