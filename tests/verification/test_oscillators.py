"""Oscillators with a stop against closed forms.

Sources: code_aster's validation cases SDND101 and SDND122 (parameters and closed forms); matrix exponentials per
phase with root finding for the forced one; textbook restitutions of the Kelvin-Voigt law.
"""

from __future__ import annotations

from math import acos, asin, exp, pi, sqrt

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from tests.shared.toys import SCHEMES, ledger_of, start, steps_of, stopped_oscillator

ORDER_TWO = ("discrete-gradient", "newmark", "generalized-alpha")


@pytest.mark.parametrize("name", ORDER_TWO)
def test_one_shock_sdnd101(name: str) -> None:
    """Mass 100, spring 1e4, stop 1e6 at rest position, v0 = 1: F_max = Kc v0 / w2, T = pi / w2, I = 2 M Kc/(K+Kc)."""
    mass, spring, stop = 100.0, 1e4, 1e6
    omega = sqrt((spring + stop) / mass)
    shock = pi / omega
    system = stopped_oscillator(mass, spring)
    law = kelvin_voigt(stop)
    count = 4000
    steps = steps_of(system, law, SCHEMES[name], start(system, v=1.0), shock / count, count + 8)
    force = np.array([step.stage.pressure[0] for step in steps])
    assert force.max() == pytest.approx(stop / omega, rel=2e-6)
    assert force.max() == pytest.approx(9950.37, abs=0.02)
    assert shock == pytest.approx(0.031260, abs=1e-6)
    impulse = force.sum() * shock / count
    assert impulse == pytest.approx(2.0 * stop / omega**2, rel=1e-5)
    assert np.count_nonzero(force > 0.0) == pytest.approx(count, abs=2)


@pytest.mark.slow(minutes=0.2)
def test_free_period_sdnd122() -> None:
    """M = 1, k = 10, stop 50 with gap 0.01: the period of the free oscillation with a given energy."""
    k, stop, gap, energy = 10.0, 50.0, 0.01, 0.00650108331626
    together = k + stop
    free_amplitude = sqrt(2.0 * energy / k)
    stiff_amplitude = sqrt(2.0 * (energy - k * stop * gap**2 / (2.0 * together)) / together)
    period = 2.0 * acos(-gap / free_amplitude) / sqrt(k) + 2.0 * acos((k * gap / together) / stiff_amplitude) / sqrt(
        together
    )
    assert 1.0 / period == pytest.approx(0.646631041, abs=1e-9)
    system = stopped_oscillator(1.0, k, gap)
    law = kelvin_voigt(stop)
    steps = steps_of(system, law, SCHEMES["discrete-gradient"], start(system, u=-free_amplitude), period / 20000, 20000)
    end = steps[-1].new
    assert end.u[0, 0] == pytest.approx(-free_amplitude, rel=1e-6)
    assert abs(end.v[0, 0]) < 1e-6


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", ORDER_TWO)
def test_forced_stop_converges_to_the_piecewise_solution(name: str) -> None:
    """X'' + 0.02 x' + x + 100 <x - 0.5> = 0.5 cos 0.7 t from rest, 18 events up to t = 40, order 2 in time."""
    system = stopped_oscillator(1.0, 1.0, 0.5, 0.01, lambda t: 0.5 * np.cos(0.7 * t))
    law = kelvin_voigt(100.0)
    errors = []
    for count in (8000, 16000):
        end = steps_of(system, law, SCHEMES[name], start(system), 40.0 / count, count)[-1].new
        errors.append(abs(end.u[0, 0] + 1.15731593))
    assert errors[1] < 8e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("zeta", [0.1, 0.5, 0.8])
@pytest.mark.parametrize("adhesive", [False, True])
@pytest.mark.parametrize("name", ["discrete-gradient", "implicit-midpoint", "newmark"])
def test_restitution_of_kelvin_voigt(zeta: float, adhesive: bool, name: str) -> None:
    """A mass meets a damped wall: e = exp(-pi z/s) adhesive, exp(-(z/s)(pi - 2 asin z)) clipped, s = sqrt(1-z^2)."""
    stiffness, speed = 1.0e4, 0.7
    s = sqrt(1.0 - zeta**2)
    expected = exp(-(zeta / s) * (pi if adhesive else pi - 2.0 * asin(zeta)))
    duration = pi / (sqrt(stiffness) * s)
    count = 4000
    law = kelvin_voigt(stiffness, 2.0 * zeta * sqrt(stiffness), adhesive, touch_depth=1e-9)
    system = stopped_oscillator()
    steps = steps_of(system, law, SCHEMES[name], start(system, u=-1e-6, v=speed), duration / count, int(1.6 * count))
    assert -steps[-1].new.v[0, 0] / speed == pytest.approx(expected, abs=3e-3)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_ledger_balances_and_knows_who_lost_energy(scheme: str) -> None:
    """Every scheme's residual is round-off; only the discrete gradient's algorithmic loss is round-off too."""
    system = stopped_oscillator(1.0, 1.0, 0.5, 0.02, lambda t: np.sin(t))
    law = kelvin_voigt(1.0e4, 5.0)
    state = start(system)
    ledger = ledger_of(system, law, state, steps_of(system, law, SCHEMES[scheme], state, 5e-3, 8000))
    assert abs(ledger.residual) < 1e-9 * ledger.exchanged
    assert ledger.structural > 0.0
    assert ledger.contact_loss > 0.0
    if scheme == "discrete-gradient":
        assert abs(ledger.algorithmic) < 1e-9 * ledger.exchanged
    else:
        assert abs(ledger.algorithmic) > 1e-6 * ledger.exchanged


@pytest.mark.slow(minutes=0.2)
def test_discrete_gradient_conserves_energy_at_any_step() -> None:
    """An undamped mass bouncing off a wall under a spring keeps its energy for steps from tiny to absurd."""
    for dt in (1e-4, 1e-2, 1.0):
        system = stopped_oscillator(1.0, 1.0, 0.1)
        law = kelvin_voigt(1.0e6)
        state = start(system, v=1.0)
        ledger = ledger_of(system, law, state, steps_of(system, law, SCHEMES["discrete-gradient"], state, dt, 3000))
        assert ledger.total == pytest.approx(0.5, rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_laws_do_not_decrease_with_penetration(seed: int) -> None:
    """The step has one solution because every clipped law is non-decreasing; slopes match differences."""
    rng = np.random.default_rng(seed)
    law = kelvin_voigt(1.0e3, 4.0, touch_depth=1e-3)
    old = rng.normal(size=40) * 1e-2
    new = np.sort(rng.normal(size=(400, 40)) * 2e-2, axis=0)
    for evaluate in (
        lambda depth: law.discrete_gradient(old, depth, 1e-2),
        lambda depth: law.implicit(old, depth, 1e-2),
        lambda depth: law.endpoint(depth, 0.1 + 200.0 * (depth - old), 200.0),
    ):
        pressures = np.array([evaluate(row).pressure for row in new])
        assert np.all(np.diff(pressures, axis=0) >= -1e-12)
        h = 1e-9
        stage = evaluate(new[7])
        difference = (evaluate(new[7] + h).pressure - evaluate(new[7] - h).pressure) / (2.0 * h)
        smooth = np.abs(difference - stage.slope) < 1e-3 * np.maximum(np.abs(stage.slope), 1.0)
        assert smooth.mean() > 0.95
