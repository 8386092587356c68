"""Central difference in the form of velocity Verlet: explicit, with a lumped mass matrix.

    v_h = v0 + dt/2 a0,   u1 = u0 + dt v_h,   v1 = v_h + dt/2 a1,
    M a1 + c_M M v1 + c_K K v_h + dashpots v1 + K u1 = f(t1) + H^T (w p1)

The contact pressure is the law at d1 with the gap rate over the step. Stable up to a step that depends on mesh, damping
and contact stiffness (`gapbeam.solver.integrators.stable_step`).

Massless DOFs (`assembly.mass_redistribution`) are in static equilibrium at t1; their displacement and the pressure on
them follow from the contact problem on K_cc, the stiffness of these DOFs, so the contact does not limit the step.

Source: Belytschko, Liu, Moran and Elkhodary (2014), ch. 6; Doyen, Ern and Piperno (2011), SIAM J. Sci. Comput. 33, for
massless contact nodes in explicit schemes.
"""

from __future__ import annotations

import time
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.condensation import Condensed
from gapbeam.solver.contact.solve.contact_solve import solve_contact
from gapbeam.solver.integrators.effective_operator import hold
from gapbeam.solver.integrators.time_scheme import STIFF_CONTACT, StiffnessRange, TimeScheme
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, Stage, State, Step, imaged


class CentralDifference(TimeScheme):
    """Central difference with a lumped mass matrix: explicit, tiny steps."""

    type: Literal["central-difference"] = Field(description="name of the scheme")
    carries_acceleration: ClassVar[bool] = True
    contact_range: ClassVar[StiffnessRange] = STIFF_CONTACT
    needs_massless_contact: ClassVar[bool] = True
    explicit: ClassVar[bool] = True
    needs_factor: ClassVar[bool] = True

    @property
    def creates_energy(self) -> bool:
        """False: contact nodes with mass create energy on stiff contact, not the scheme itself."""
        return False

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, 0, c_d): the operator is M with dashpots, and K on the massless DOFs."""
        return 1.0 + 0.5 * dt * system.mass_damping, 0.0, 0.5 * dt

    def amplification(self, angle: float) -> Array:
        """Return the matrix of a step on (u, dt v), half of the acceleration -w^2 u before, half after u has moved."""
        half = 0.5 * angle * angle
        return np.array([[1.0 - half, 1.0], [half * half - angle * angle, 1.0 - half]])

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step; massless DOFs, if any, have to be all that gaps depend on. Collective."""
        law = law.touched_at(old.touch_speed)
        contact, operators = system.contact, system.operators
        assert old.a is not None
        middle = old.v + 0.5 * dt * old.a
        u = old.u + dt * middle
        lag = system.stiffness_damping
        factors = system.load_factors(old.time + dt)
        force = system.combine_loads(factors) - system.mass_damping * middle[MASS]
        if system.dashpots is not None:
            force -= system.dashpots.apply(middle[VALUE], operators)
        depth = contact.depth(contact.interface.trace(u[VALUE], operators), old.time + dt)
        seconds, iterations, unresolved = 0.0, 0, 0.0
        if system.contact_is_massless:
            right_side = force - u[STIFFNESS] - lag * middle[STIFFNESS]
            held = hold(system, right_side, old.pressure)
            started = time.perf_counter()
            free = condensed.solve_free(right_side)
            seconds = time.perf_counter() - started
            scale = 1.0 / (1.0 + lag / dt)
            solution = solve_contact(
                condensed,
                scale,
                depth - scale * (contact.gap_matrix @ contact.interface.trace(free, operators)),
                contact.weights,
                lambda end: law.implicit(old.depth, end, dt),
                held,
                max_iterations,
                law.augmented,
            )
            moved = np.where(operators.massless, scale * condensed.correct(free, solution.change), 0.0)
            correction = imaged(operators, moved)
            u, middle = u + correction, middle + correction / dt
            depth, forces, closed = solution.depth, solution.forces, solution.law
            iterations, unresolved = solution.iterations, solution.unresolved
        else:
            closed = law.endpoint(depth, np.asarray((depth - old.depth) / dt), 0.0)
            forces = contact.weights * closed.pressure
        right_side = force - u[STIFFNESS] - lag * middle[STIFFNESS]
        contact.interface.add(right_side, contact.resultant(forces))
        started = time.perf_counter()
        acceleration = imaged(operators, np.where(operators.massless, 0.0, condensed.solve_free(right_side)))
        seconds += time.perf_counter() - started
        pressure = forces / contact.weights
        new = State(
            time=old.time + dt,
            u=u,
            v=middle + 0.5 * dt * acceleration,
            depth=depth,
            pressure=pressure,
            a=acceleration,
            lagged=middle[STIFFNESS],
        )
        # the mean of the balances at t0 and t1: what the elastic and the inertia forces do over the step
        old_lagged = old.v[STIFFNESS] if old.lagged is None else old.lagged
        stage = Stage(
            load_factors=0.5 * (system.load_factors(old.time) + factors),
            inertia_and_elastic=0.5 * (old.a[MASS] + acceleration[MASS] + old.u[STIFFNESS] + u[STIFFNESS]),
            velocity=np.stack([*(0.5 * (old.v + new.v))[:STIFFNESS], 0.5 * (old_lagged + middle[STIFFNESS])]),
            pressure=0.5 * (old.pressure + pressure),
            elastic_pressure=0.5 * (law.static(old.depth).pressure + closed.elastic),
            unresolved=unresolved,
        )
        return Step(old, new, stage, iterations, timings={"back_substitution": seconds})
