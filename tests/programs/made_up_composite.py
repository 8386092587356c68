"""A scheme of two stages a step that gapbeam does not have, as somebody would add one: TR-BDF2.

The trapezoidal rule up to t0 + c dt, c = 2 - sqrt(2), then BDF2 through t0, t0 + c dt and t1. Both stages have the same
effective operator. Of second order, and highest frequencies are gone after one step.

Source: Bank et al. (1985), IEEE Trans. Electron Devices 32; Bathe and Baig (2005) for structures.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.condensation import Condensed
from gapbeam.solver.contact.solve.friction_solve import Sliding, solve_contact_and_friction
from gapbeam.solver.integrators.effective_operator import hold, image_of_solution
from gapbeam.solver.integrators.midpoint import Midpoint
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, SemiDiscreteSystem, Stage, State, Step

FIRST = 2.0 - sqrt(2.0)  # c: part of the step that the first stage takes
NEWER, OLDER = 1.0 / (FIRST * (2.0 - FIRST)), (1.0 - FIRST) ** 2 / (FIRST * (2.0 - FIRST))
LAST = (1.0 - FIRST) / (2.0 - FIRST)  # weight of the forces at the end of the step


class CompositeScheme(Midpoint):
    """TR-BDF2: the trapezoidal rule, then BDF2, in each step."""

    type: Literal["tr-bdf2"] = Field(description="name of the scheme")
    has_period_map: ClassVar[bool] = False
    marches_sets: ClassVar[bool] = False

    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator of both stages."""
        return super().coefficients(system, FIRST * dt)

    def amplification(self, angle: float) -> Array:
        """Return the matrix of a step on (u, dt v)."""
        scale = np.diag([1.0, FIRST])  # the first stage takes and returns (u, c dt v)
        middle = np.linalg.inv(scale) @ super().amplification(FIRST * angle) @ scale
        last = np.array([[1.0, -LAST], [LAST * angle * angle, 1.0]])
        return np.asarray(np.linalg.solve(last, NEWER * middle - OLDER * np.eye(2)))

    @property
    def creates_energy(self) -> bool:
        """Yes, a little: BDF2 looks back across the touch."""
        return True

    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step; the stage is the mean of both balances. Collective."""
        first = super().advance(system, condensed, law, old, FIRST * dt, max_iterations)
        middle, size = first.new, LAST * dt
        contact, walls = system.contact, system.contact.walls
        base = {name: NEWER * getattr(middle, name) - OLDER * getattr(old, name) for name in ("u", "v", "depth")}
        factors = system.load_factors(old.time + dt)
        right_side = system.combine_loads(factors) + base["v"][MASS] / size - base["u"][STIFFNESS]
        held = hold(system, right_side, middle.pressure)
        free = condensed.solve_free(right_side)
        trace = contact.interface.trace(free, system.operators)
        opened = walls.grown(middle.time, old.time + dt) - OLDER * walls.grown(old.time, middle.time)
        touched = law.touched_at(old.touch_speed)
        solution = solve_contact_and_friction(
            Sliding.of(touched, contact, 1.0, trace, middle),
            condensed,
            size,
            base["depth"] - size * (contact.gap_matrix @ trace) - opened,
            contact.weights,
            lambda depth: touched.implicit(base["depth"], depth, size),
            held,
            max_iterations,
            touched.augmented,
        )
        velocity = image_of_solution(
            system, condensed, free, right_side, solution.change, solution.friction, solution.response
        )
        new = State(
            time=old.time + dt,
            u=base["u"] + size * velocity,
            v=velocity,
            depth=solution.depth,
            pressure=solution.forces / contact.weights,
            traction=solution.traction(contact.weights),
        )
        last = Stage(
            load_factors=factors,
            inertia_and_elastic=(new.v[MASS] - base["v"][MASS]) / size + new.u[STIFFNESS],
            velocity=velocity,
            pressure=new.pressure,
            elastic_pressure=solution.law.elastic,
            traction=new.traction,
            unresolved=solution.unresolved,
        )
        return Step(old, new, _mean(first.stage, last), first.iterations + solution.iterations)


def _mean(first: Stage, last: Stage) -> Stage:
    """Return the balance that the change of the state over the step satisfies: v1 - v0 and u1 - u0 have its weights."""
    names = ["load_factors", "inertia_and_elastic", "velocity", "pressure", "elastic_pressure"]
    names += ["traction"] if first.traction is not None else []
    mean = {name: NEWER * FIRST * getattr(first, name) + LAST * getattr(last, name) for name in names}
    return replace(last, **mean, unresolved=first.unresolved + last.unresolved)
