"""Energy at any step: the default scheme neither creates nor takes any, whatever law, stiffness, step and walls are.

The balance is measured on the states: kinetic, strain and contact energy against the work of loads and what contact
damping took. What is left is round-off.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from mpi4py import MPI

import gapbeam
from gapbeam.solver.diagnostics.energy_gates import remedy_for
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, why_not_compiled
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.march.stepwise_march import March, march
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import State
from tests.shared.masses_in_holes import law_of, masses_in_holes
from tests.shared.models import beam_case

STEPS = 30
ROUND_OFF = 1.0e-9  # of the energy exchanged: what contact solves leave of stiff laws


def decades(lowest: int, highest: int) -> st.SearchStrategy[float]:
    """Return numbers that lie evenly over decades."""
    return st.floats(lowest, highest).map(lambda power: 10.0**power)


EXPONENTS = st.sampled_from([1.0, 1.5, 2.0, 3.0])
TABLES = st.one_of(
    st.just({"type": "kelvin-voigt"}),
    st.fixed_dictionaries(
        {
            "type": st.just("hunt-crossley"),
            "exponent": EXPONENTS,
            "restitution": st.sampled_from([1.0, 0.9, 0.5]),
        }
    ),
    st.fixed_dictionaries(
        {
            "type": st.just("lankarani-nikravesh"),
            "exponent": EXPONENTS,
            "restitution": st.sampled_from([0.9, 0.5]),
        }
    ),
    st.fixed_dictionaries(
        {
            "type": st.just("adams-impact"),
            "exponent": EXPONENTS,
            "damping": decades(-1, 4),
            "full_depth": decades(-6, -1),
        }
    ),
    st.fixed_dictionaries(
        {
            "type": st.just("piecewise-linear"),
            "depths": st.just([1.0e-3, 1.0e-2]),
            "factors": st.tuples(st.sampled_from([0.2, 5.0]), st.sampled_from([0.0, 20.0])).map(list),
        }
    ),
)


def balance_of(plan: March, start: State, compiled: bool) -> Ledger:
    """Return the ledger after a march."""
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    if compiled:
        for _ in CompiledLoop(plan).blocks(start, accounts=accounts):
            pass
    else:
        for step in march(plan, start):
            accounts.take(step)
    return accounts.ledger


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    table=TABLES,
    stiffness=decades(1, 8),
    damping=st.sampled_from([0.0, 1.0, 1.0e4]),
    adhesive=st.booleans(),
    dt=decades(-3, -1),
    holes=st.integers(1, 3),
    stops=st.integers(0, 2),
    seed=st.integers(0, 1000),
)
@example(
    table={"type": "adams-impact", "exponent": 2.0, "damping": 54.469541113323814, "full_depth": 3.217384289744086e-06},
    stiffness=3305.024082269077,
    damping=0.0,
    adhesive=False,
    dt=0.028458249176383794,
    holes=2,
    stops=0,
    seed=109,
)
@example(  # directions of contact that had not settled yet, and a stiff law that makes forces of their last change
    table={"type": "kelvin-voigt"},
    stiffness=1.0e7,
    damping=0.0,
    adhesive=False,
    dt=0.1,
    holes=2,
    stops=1,
    seed=166,
)
def test_no_energy_is_created(
    table: dict[str, Any],
    stiffness: float,
    damping: float,
    adhesive: bool,
    dt: float,
    holes: int,
    stops: int,
    seed: int,
) -> None:
    """Masses in round holes and before stops, every law, seven decades of stiffness and two of the step."""
    law = law_of(table, stiffness, damping if table["type"] == "kelvin-voigt" else 0.0, adhesive)
    plan, start = masses_in_holes(law, dt, holes, stops, seed, 3.0)
    plan = replace(plan, steps=STEPS)
    for compiled in (False, True)[: 1 + (why_not_compiled(plan) is None)]:
        ledger = balance_of(plan, start, compiled)
        assert abs(ledger.created) <= 10.0 * ledger.round_off + ROUND_OFF * ledger.exchanged
        assert abs(ledger.algorithmic) <= 10.0 * ledger.round_off + ROUND_OFF * ledger.exchanged


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(
    law=st.sampled_from(["kelvin-voigt", "hunt-crossley"]),
    exponent=EXPONENTS,
    restitution=st.sampled_from([1.0, 0.9]),
    stiffness=decades(8, 13),
    dt=decades(-3, -1),
    holes=st.integers(1, 3),
    seed=st.integers(0, 1000),
)
@example(law="hunt-crossley", exponent=1.5, restitution=1.0, stiffness=1.0e12, dt=0.05, holes=2, seed=1)
def test_the_stiffest_laws_in_round_holes_create_no_energy(
    law: str, exponent: float, restitution: float, stiffness: float, dt: float, holes: int, seed: int
) -> None:
    """K up to 1e13 N/m^n on 1 kg, restitution 1: what contact solves leave is below 1e-7 of the energy exchanged."""
    damped = {"exponent": exponent, "restitution": restitution} if law == "hunt-crossley" else {}
    plan, start = masses_in_holes(law_of({"type": law, **damped}, stiffness), dt, holes, 0, seed, 3.0)
    ledger = balance_of(replace(plan, steps=STEPS), start, compiled=False)
    assert abs(ledger.created) <= 10.0 * ledger.round_off + 1.0e-7 * ledger.exchanged
    assert abs(ledger.algorithmic) <= 10.0 * ledger.round_off + 1.0e-7 * ledger.exchanged


TUBE: dict[str, Any] = {
    "beam": {
        "length": 1.1365, "thickness": 0.035555, "width": 0.035555, "section": {"type": "tube", "wall": 0.0035555},
    },
    "material": {"young_modulus": 3.0e9, "poisson_ratio": 0.0, "density": 2700.0},
    "mesh": {
        "dimension": 3, "size": 0.14222, "support_size": 0.01871, "cells_through_thickness": 2,
        "cells_across_width": 2,
    },
    "model": {"type": "beam", "elements": 24},
    "contact": {"law": {"type": "lankarani-nikravesh", "restitution": 0.8}, "stiffness": 1.0e15},
    "time": {"end": 0.399, "step": 0.00133},
    "probe": [{"name": "tip", "point": 1.1365}],
    "support": [
        {
            "name": "s0", "from": 0.56825, "to": 0.58719, "clearance": 1.9759e-4, "offset": 5.2968e-5,
            "region": {"type": "polygon", "walls": [0, 90, 180, -90], "recesses": [0, 1e-5, 2e-5, 0]},
        },
        {"name": "s1", "from": 0.85237, "to": 0.87131, "clearance": 9.8795e-5},
        {
            "name": "s2", "from": 1.0418, "to": 1.0607, "clearance": 1.9759e-4, "lateral": 7.9036e-5,
            "tilt": -4.1933e-4, "region": {"type": "hole", "contact": "circle"},
        },
    ],
    "load": [
        {"type": "gravity"},
        {
            "type": "exciter", "name": "l0", "point": 0.6819, "amplitude": 17.381, "frequency": 18.763,
            "mass": 0.0, "stiffness": 1141.6, "damping": 0.54588,
        },
        {"type": "base_motion", "name": "l1", "quantity": "acceleration", "amplitude": 4.8285, "frequency": 18.763},
    ],
}  # fmt: skip


def test_a_tube_that_touches_along_its_way_keeps_its_energy() -> None:
    """A long step carries a section around the middle of its hole into the wall: 15.6 % of the energy was created."""
    simulation = Simulation(build_model(gapbeam.read_case(TUBE), MPI.COMM_SELF))
    seat = simulation.seat()
    ledger = balance_of(replace(simulation.plan, steps=110), simulation.start(seat), False)
    assert abs(ledger.created) <= 10.0 * ledger.round_off
    assert ledger.contact_loss > 0.01 * ledger.exchanged


@pytest.mark.parametrize(
    ("scheme", "formulation", "words", "other"),
    [
        ("discrete-gradient", "penalty", "smaller time.step or a softer contact.stiffness", "scheme"),
        ("implicit-midpoint", "penalty", "scheme discrete-gradient", "implicit-midpoint"),
        ("newmark", "nitsche", "smaller time.step", "softer"),
    ],
)
def test_a_remedy_is_never_the_scheme_in_use(scheme: str, formulation: str, words: str, other: str) -> None:
    """The message on created energy advises another scheme, or none."""
    remedy = remedy_for(beam_case({"time": {"scheme": {"type": scheme}}, "contact": {"formulation": formulation}}))
    assert words in remedy
    assert other not in remedy
