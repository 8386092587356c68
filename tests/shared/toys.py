"""Systems of one or two DOFs with a stop: the same types as the finite element models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.integrators.scheme_choice import scheme_names, scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, Step, imaged

SCHEMES: dict[str, TimeScheme] = {
    **{name: scheme_of(name) for name in scheme_names() if name not in scheme_names("impulses")},
    "generalized-alpha 0": scheme_of("generalized-alpha", rho_inf=0.0),
}
"""All schemes that take contact by a law, from the list of schemes itself."""

IMPLICIT = [name for name, scheme in SCHEMES.items() if not scheme.explicit]


def stopped_oscillator(
    mass: float = 1.0,
    spring: float = 0.0,
    gap: float = 0.0,
    damping_ratio: float = 0.0,
    force: Callable[[float], float] | None = None,
    other: float | None = None,
) -> SemiDiscreteSystem:
    """A mass on a spring that meets a stop when its displacement exceeds `gap`; where it is below `-other`, another."""
    sides, gaps = [-1.0] + [1.0] * (other is not None), [gap] + [other] * (other is not None)
    contact = ContactOperator(
        interface=Interface(1, np.array([0]), np.array([0])),
        gap_matrix=csr_matrix(np.array(sides)[:, None]),
        weights=np.ones(len(sides)),
        initial_gap=np.array(gaps, dtype=float),
        faces=np.arange(len(sides)),
        support=Support(
            tuple(Face(name, side) for name, side in zip(("stop", "other"), sides, strict=False)), area=1.0
        ),
        positions=np.zeros((len(sides), 3)),
    )
    loads = (Load("force", np.array([1.0]), force),) if force else ()
    mass_damping = 2.0 * damping_ratio * np.sqrt(spring / mass)
    return SemiDiscreteSystem(
        DenseOperators(np.array([[mass]]), np.array([[spring]])), contact, loads, mass_damping=mass_damping
    )


def start(system: SemiDiscreteSystem, u: float = 0.0, v: float = 0.0) -> State:
    """A state of an oscillator."""
    place, speed = np.array([u]), np.array([v])
    depth = system.contact.depth(place)
    return State(0.0, imaged(system.operators, place), imaged(system.operators, speed), depth, np.zeros(1))


def steps_of(
    system: SemiDiscreteSystem, law: ContactLaw, scheme: TimeScheme, state: State, dt: float, steps: int
) -> list[Step]:
    """March and keep every step."""
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), dt, steps)
    return list(march(plan, state))


def ledger_of(system: SemiDiscreteSystem, law: ContactLaw, state: State, steps: list[Step]) -> Ledger:
    """The ledger at the end of a march."""
    ledger = open_ledger(system, law, state)
    for step in steps:
        ledger = enter_step(system, law, ledger, step)
        if step.refreshed is not None:
            ledger = restate(system, law, ledger, step.refreshed)
    return ledger


def with_pressure(state: State, pressure: float) -> State:
    """The state with a contact pressure that acted last."""
    return replace(state, pressure=np.array([pressure]))
