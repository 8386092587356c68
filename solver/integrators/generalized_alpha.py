"""Generalized-alpha (Chung and Hulbert 1993), with Newmark (1959) and HHT-alpha (1977) as special cases.

    u1 = u0 + dt v0 + dt^2 ((1/2 - beta) a0 + beta a1),    v1 = v0 + dt ((1 - gamma) a0 + gamma a1)
    M a_m + C v_f + K u_f = f_f + G^T (w p_f),    x_m = (1-alpha_m) x1 + alpha_m x0,   x_f = (1-alpha_f) x1 + alpha_f x0

with the contact pressure weighted like the other forces, p_f = (1-alpha_f) p(d1, d1') + alpha_f p0. Unknown is a1.
Friction opposes v_f under p_f; the traction that a state shows is the law at its end, under p1 and v1.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from solver.contact.friction_solve import solve_contact_and_friction
from solver.contact.law import ContactLaw, StagePressure
from solver.contact.sliding import Sliding
from solver.integrators.effective import hold, image_of_solution
from solver.matrix_free import Condensed
from solver.operators import Array
from solver.system import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, Stage, State, Step


@dataclass(frozen=True)
class GeneralizedAlpha:
    """The coefficients of the family."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    carries_acceleration = True

    @classmethod
    def newmark(cls, beta: float = 0.25, gamma: float = 0.5) -> GeneralizedAlpha:
        """Return Newmark's scheme."""
        return cls(0.0, 0.0, beta, gamma)

    @classmethod
    def from_spectral_radius(cls, rho_inf: float) -> GeneralizedAlpha:
        """Return the second-order scheme with spectral radius rho_inf at infinite frequency (their eqs. 17, 20, 25)."""
        alpha_m = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0)
        alpha_f = rho_inf / (rho_inf + 1.0)
        shift = 1.0 - alpha_m + alpha_f
        return cls(alpha_m, alpha_f, 0.25 * shift * shift, 0.5 - alpha_m + alpha_f)

    @classmethod
    def hht(cls, alpha: float) -> GeneralizedAlpha:
        """Return Hilber, Hughes and Taylor's scheme (1977), alpha in [0, 1/3] (theirs is negative)."""
        return cls(0.0, alpha, 0.25 * (1.0 + alpha) ** 2, 0.5 + alpha)

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator."""
        new = 1.0 - self.alpha_f
        mass = (1.0 - self.alpha_m) + new * self.gamma * dt * system.mass_damping
        stiffness = new * (self.beta * dt * dt + self.gamma * dt * system.stiffness_damping)
        return mass, stiffness, new * self.gamma * dt

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step; arguments, errors and collectivity as in `Midpoint.advance`."""
        law = law.touched_at(old.touch_speed)
        contact, operators = system.contact, system.operators
        new_share, old_share = 1.0 - self.alpha_f, self.alpha_f
        assert old.a is not None
        u_guess = old.u + dt * old.v + dt * dt * (0.5 - self.beta) * old.a
        v_guess = old.v + dt * (1.0 - self.gamma) * old.a
        u_stage = new_share * u_guess + old_share * old.u
        v_stage = new_share * v_guess + old_share * old.v
        factors = new_share * system.load_factors(old.time + dt) + old_share * system.load_factors(old.time)
        right_side = (
            system.combine_loads(factors)
            - self.alpha_m * old.a[MASS]
            - system.damping_force(v_stage)
            - u_stage[STIFFNESS]
        )
        held = hold(system, right_side, old.pressure)
        started = time.perf_counter()
        free = condensed.solve_free(right_side)
        solved = time.perf_counter()
        trace = contact.interface.trace
        guess_depth = contact.depth(trace(u_guess[VALUE], operators))
        guess_rate = -(contact.gap_matrix @ trace(v_guess[VALUE], operators))
        scale = self.beta * dt * dt
        rate_slope = self.gamma / (self.beta * dt)

        def stage_law(depth: Array) -> StagePressure:
            end = law.endpoint(depth, guess_rate + rate_slope * (depth - guess_depth), rate_slope)
            return StagePressure(
                new_share * end.pressure + old_share * old.pressure, new_share * end.slope, end.elastic
            )

        free_trace, sliding = trace(free, operators), None
        if law.friction is not None:
            rate = new_share * self.gamma * dt
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
            u=u_guess + self.beta * dt * dt * acceleration,
            v=v_guess + self.gamma * dt * acceleration,
            depth=solution.depth,
            # open points are left without the round-off of the difference
            pressure=np.where(solution.law.pressure == lasting, 0.0, (stage_pressure - lasting) / new_share),
            a=acceleration,
        )
        if law.friction is not None:
            slip = contact.slip(trace(new.v[VALUE], operators))
            new = replace(new, traction=law.friction.traction(new.pressure, slip))
        old_elastic = law.spring.pressure(old.depth)
        stage = Stage(
            load_factors=factors,
            inertia_and_elastic=(1.0 - self.alpha_m) * acceleration[MASS]
            + self.alpha_m * old.a[MASS]
            + new_share * new.u[STIFFNESS]
            + old_share * old.u[STIFFNESS],
            velocity=new_share * new.v + old_share * old.v,
            pressure=stage_pressure,
            elastic_pressure=new_share * solution.law.elastic + old_share * old_elastic,
            traction=solution.traction(contact.weights),
            unresolved=solution.unresolved,
        )
        return Step(old, new, stage, solution.iterations, timings={"back_substitution": solved - started})
