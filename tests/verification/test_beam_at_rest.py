"""A seated beam that nothing drives stays where it is."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.diagnostics.energy_gates import EnergyGates
from gapbeam.solver.diagnostics.energy_ledger import enter_step, open_ledger, restate
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from tests.shared.models import SOLID, beam_model, seat_of
from tests.shared.toys import IMPLICIT, SCHEMES


@pytest.mark.parametrize("scheme", IMPLICIT)
@pytest.mark.parametrize("dimension", [2, 3])
def test_seated_beam_stays_at_rest(dimension: int, scheme: str) -> None:
    """100 steps of 0.1 ms (2D) or 50 (3D) without forcing and damping move the seat by round-off only.

    Displacements change by less than 1e-7 of the seat's, velocities stay below 1e-6 of those of a free fall over the
    same time, the energy residual stays below the ledger's own estimate of round-off, the scheme neither creates nor
    takes energy to 1e-8 of the strain energy, and the gates see nothing.
    """
    integrator, dt, steps = SCHEMES[scheme], 1.0e-4, 100 if dimension == 2 else 50
    model = beam_model({"mesh": SOLID if dimension == 3 else {}})
    system, law = model.system, model.law
    seat = seat_of(model, integrator.carries_acceleration).state
    ledger = open_ledger(system, law, seat)
    gates = EnergyGates(Gates(), system.contact)
    moved, fastest = 0.0, 0.0
    for step in march(March(system, law, integrator, EffectiveOperators(system, integrator), dt, steps), seat):
        ledger = enter_step(system, law, ledger, step)
        if step.refreshed is not None:
            ledger = restate(system, law, ledger, step.refreshed)
        gates.check(step, ledger)
        moved = max(moved, float(np.max(np.abs(step.new.u[0] - seat.u[0]))))
        fastest = max(fastest, float(np.max(np.abs(step.new.v[0]))))
    assert moved < 1e-7 * np.max(np.abs(seat.u[0]))
    assert fastest < 1e-6 * 9.81 * dt * steps
    assert abs(ledger.residual) < ledger.round_off < 1e-5 * ledger.strain
    assert abs(ledger.algorithmic) < 1e-8 * ledger.strain
    assert gates.growth(ledger) == 0.0
    assert gates.impacts == 0
