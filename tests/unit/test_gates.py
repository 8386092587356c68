"""Energy gates: a scheme that creates energy ends the run, or fails it at the end."""

from __future__ import annotations

from math import sin

import pytest

from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.diagnostics.assumption import WARNING, Assumption, Finding
from gapbeam.solver.diagnostics.energy_gates import EnergyGates, remedy_for
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.messages.errors import EnergyCreated, NotFinite
from tests.shared.models import beam_case
from tests.shared.toys import SCHEMES, start, stopped_oscillator

STIFF = kelvin_voigt(1.0e6)


def watched(scheme: str, limits: Gates, steps: int = 3000, dt: float = 0.02) -> tuple[EnergyGates, Ledger]:
    """March a forced mass against a stiff stop under gates."""
    system = stopped_oscillator(1.0, 1.0, 0.1, 0.0, lambda t: sin(0.8 * t))
    integrator, state = SCHEMES[scheme], start(system)
    remedy = remedy_for(beam_case({"time": {"scheme": scheme}}))
    gates, ledger = EnergyGates(limits, system.contact, remedy=remedy), open_ledger(system, STIFF, state)
    for step in march(March(system, STIFF, integrator, EffectiveOperators(system, integrator), dt, steps), state):
        ledger = enter_step(system, STIFF, ledger, step)
        if step.refreshed is not None:
            ledger = restate(system, STIFF, ledger, step.refreshed)
        gates.check(step, ledger)
    return gates, ledger


def test_newmark_with_a_stiff_stop_is_stopped() -> None:
    """Newmark's rule creates energy at a stiff stop though every step converges; the message says what to do."""
    with pytest.raises(EnergyCreated) as caught:
        watched("newmark", Gates())
    for part in ("at t = ", "created", "allowed: 5.0%", "discrete-gradient", "accept_energy_growth"):
        assert part in str(caught.value)
    assert caught.value.exit_status == 3


def test_growth_can_be_accepted_and_is_still_reported() -> None:
    """With accept_energy_growth the run goes to its end; growth and violations of the impact gate are on record."""
    gates, ledger = watched("newmark", Gates(accept_energy_growth=True))
    assert gates.growth(ledger) > 0.05
    assert gates.failed(ledger)
    assert gates.impacts > 5
    assert gates.violations > 0
    assert gates.largest_growth > 0.0025


def test_discrete_gradient_passes_every_gate() -> None:
    """The same stop under the conserving scheme: no impact gains or loses as much as 1e-8 of the energy."""
    gates, ledger = watched("discrete-gradient", Gates())
    assert gates.impacts > 5
    assert gates.violations == 0
    assert gates.largest_growth < 1e-8
    assert gates.largest_loss < 1e-8
    assert not gates.failed(ledger)


def test_dissipation_is_no_growth() -> None:
    """The contact-implicit midpoint loses energy at each impact: violations of the loss gate, but the run passes."""
    gates, ledger = watched("implicit-midpoint", Gates())
    assert gates.violations > 0
    assert gates.largest_loss > 0.008
    assert not gates.failed(ledger)


def test_infinite_energy_ends_the_run() -> None:
    """A state that is not finite is refused whatever the limits."""
    system = stopped_oscillator()
    state = start(system, v=1.0)
    integrator = SCHEMES["discrete-gradient"]
    step = next(march(March(system, STIFF, integrator, EffectiveOperators(system, integrator), 1e-3, 1), state))
    ledger = Ledger(float("inf"), 0.0, 0.0, 0.0, open_ledger(system, STIFF, state).load_work)
    with pytest.raises(NotFinite):
        EnergyGates(Gates(accept_energy_growth=True), system.contact).check(step, ledger)


@pytest.mark.parametrize("limit", [1.0, 0.125, 0.3, 2e-7])
@pytest.mark.parametrize("beyond", [1e-1, 1e-3, 1e-5, 1e-8])
def test_a_value_beyond_its_limit_reads_as_one(limit: float, beyond: float) -> None:
    """Both have as many digits as tell them apart: "1, limit 1" was a warning."""
    one = Assumption("basis", "frequency over the highest", "1", limit, None, "try more modes")
    finding = Finding(one, limit * (1.0 + beyond))
    assert finding.verdict == WARNING
    found, allowed = finding.words.removeprefix("basis: frequency over the highest ").split(", limit ")
    assert float(found) > float(allowed)
    assert float(allowed) == pytest.approx(limit, rel=1e-12)
