"""Harmonic balance against a known orbit, closed forms, shooting, and differences of its own Jacobian."""

from __future__ import annotations

from math import cos, pi

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.periodic.floquet import Judgment, stability_of
from gapbeam.solver.periodic.harmonic_balance import HarmonicBalance
from gapbeam.solver.periodic.harmonic_continuation import balanced_multipliers, climb
from gapbeam.solver.periodic.shooting import Fourier, shoot
from gapbeam.solver.system.modal_coordinates import modal_system
from tests.shared.toys import stopped_oscillator
from tests.verification.test_periodic_orbit import HARMONICS, MEAN, STATE
from tests.verification.test_shooting import LAWS, MULTIPLIER, chain, oscillator_map


def oscillator_modes(gap: float = 0.5, omega: float = 0.8, zeta: float = 0.05):
    """The oscillator with the known orbit, in modal coordinates."""
    return modal_system(stopped_oscillator(1.0, 1.0, gap, zeta, lambda t: cos(omega * t)))


def test_known_orbit_by_more_and_more_harmonics() -> None:
    """From nothing at all to the known orbit: mean and harmonics 1-5 come closer with H, to 1e-4 at H = 40.

    Source: as in tests/verification/test_periodic_orbit.py.
    """
    errors = []
    for harmonics in (5, 10, 20, 40, 160):
        found = climb(oscillator_modes(), kelvin_voigt(100.0), 0.8, harmonics)
        solution = found.solution
        assert solution.residual <= 1.0e-9
        words = solution.series.amplitudes(solution.coordinates)[:5, 0]
        errors.append(np.max(np.abs(words / HARMONICS - 1.0)))
        assert solution.coordinates[0, 0] == pytest.approx(MEAN, abs=10.0 * errors[-1])
    assert errors[0] > errors[1] > errors[2] > errors[3]
    assert errors[3] < 2e-4
    place, speed, _ = solution.motion(np.zeros(1))
    assert [place[0, 0], speed[0, 0]] == pytest.approx(STATE, abs=5e-4)
    assert errors[4] < 1e-4
    assert solution.truncated < 0.01
    assert found.change is not None
    assert found.change < 1e-3


def test_linear_oscillator() -> None:
    """Without contact one harmonic is exact: F / (1 - w^2 + 2 i zeta w)."""
    solution = climb(oscillator_modes(gap=100.0), kelvin_voigt(100.0), 0.8, 5).solution
    answer = 1.0 / (1.0 - 0.64 + 0.08j)
    exact = np.zeros(11)
    exact[1], exact[6] = answer.real, -answer.imag
    assert solution.coordinates[:, 0] == pytest.approx(exact, abs=1e-13)
    assert solution.truncated == 0.0


@pytest.mark.parametrize(
    "law", [LAWS["elastic"], LAWS["damped"], LAWS["stepped"]], ids=["elastic", "damped", "stepped"]
)
def test_jacobian_is_the_derivative(law: ContactLaw) -> None:
    """The Jacobian is the difference quotient of the residual."""
    modal = chain(law).modal
    balance = HarmonicBalance(modal, law, Fourier(4, 256, 6.0))
    y = 0.03 * np.random.default_rng(1).normal(size=(9, 2))
    step = 1.0e-8
    units = np.eye(y.size).reshape(-1, *y.shape)
    quotient = np.array([balance._residual(y + step * e)[0] - balance._residual(y - step * e)[0] for e in units])
    quotient = quotient.reshape(y.size, y.size).T / (2.0 * step)
    jacobian = balance._jacobian(y)
    assert np.max(np.abs(jacobian - np.eye(y.size))) > 1.0
    assert jacobian == pytest.approx(quotient, abs=1e-4 * np.max(np.abs(quotient)))


def test_agrees_with_shooting() -> None:
    """Three masses between stops, damped: harmonics 1-5 of all masses within 1 %, and 0.1 % of the largest."""
    period_map = chain(LAWS["damped"], steps=1000)
    x = np.zeros(6)
    orbit = None
    for _ in range(6):
        x = period_map.after(x)
    orbit = shoot(period_map, x, 1.0e-10)
    places, force = period_map.history(orbit.x)
    assert np.max(force) > 0.0
    marched = 2.0 * np.abs(np.fft.rfft(places[:-1], axis=0)[1:6]) / period_map.steps
    solution = climb(period_map.modal, period_map.law, 6.0, 60).solution
    balanced = period_map.modal.dofs(solution.coordinates)
    balanced = solution.series.amplitudes(balanced)[:5]
    assert balanced == pytest.approx(marched, rel=1e-2, abs=1e-3 * np.max(marched))


def multipliers(stop: float, harmonics: int, gap: float = 0.5) -> Judgment:
    """Multipliers of the oscillator by harmonic balance, 500 steps in a period."""
    period_map = oscillator_map(500, stop=stop, gap=gap)
    found = climb(period_map.modal, period_map.law, 0.8, harmonics)
    place, speed, _ = found.solution.motion(np.zeros(1))
    _, tangent = period_map.with_tangent(np.concatenate([place[0], speed[0]]))
    return balanced_multipliers(period_map, found, stability_of(tangent))


@pytest.mark.parametrize("harmonics", [10, 20, 40])
def test_multipliers_that_have_not_converged_are_not_known(harmonics: int) -> None:
    """With a stop of 1e4 N/m the truth is 0.675, along the series with 10 to 80 harmonics it is 13 to 47: not known.

    The solutions with 20 and 40 agree to 2 %: more harmonics alone do not show it, a march from there does.
    Source of the truth: exp(-zeta T), as long as the multipliers are a pair: contact without damping takes nothing.
    """
    found = multipliers(1.0e4, harmonics)
    assert pytest.approx(np.exp(-0.05 * 2.0 * pi / 0.8), rel=1e-4) == MULTIPLIER
    assert found.stability.largest > 10.0
    assert not found.known
    assert found.error > 10.0


@pytest.mark.parametrize(("stop", "gap", "harmonics"), [(100.0, 0.5, 40), (100.0, 0.5, 80), (1.0e4, 100.0, 5)])
def test_multipliers_that_have_converged_are_known(stop: float, gap: float, harmonics: int) -> None:
    """With a stop of 100 N/m, 40 harmonics are enough; without contact one is."""
    found = multipliers(stop, harmonics, gap)
    assert found.known
    assert found.stability.stable
    assert found.stability.largest == pytest.approx(MULTIPLIER, rel=1e-3)


def test_one_number_of_harmonics_does_not_tell() -> None:
    """With contact and nothing to compare with, the multipliers are not known."""
    assert any("compare" in doubt for doubt in multipliers(100.0, 5).doubts)


def test_weightless_mean_is_found() -> None:
    """A free body that its weight presses on a stop has no stiffness of its own: K x = weight, whatever shakes it.

    A free mass of 1 kg under 10 N and 2 cos(w t) N on a stop of 400 N/m never lifts; it starts at its seat.
    Source: x = 10/400 + Re(2 e^iwt / (400 - w^2 + i w c)).
    """
    omega = 5.0
    system = stopped_oscillator(1.0, 0.0, 0.0, 0.0, lambda t: 10.0 + 2.0 * cos(omega * t))
    modal = modal_system(system)
    assert modal is not None
    seat = Fourier(0, 5, omega), modal.coordinates(np.array([0.025]))[None]
    solution = climb(modal, kelvin_voigt(400.0, 3.0), omega, 5, start=seat).solution
    answer = 2.0 / (400.0 - omega**2 + 3.0j * omega)
    exact = np.zeros(11)
    exact[0], exact[1], exact[6] = 10.0 / 400.0, answer.real, -answer.imag
    assert modal.dofs(solution.coordinates)[:, 0] == pytest.approx(exact, abs=1e-6)


def test_failures_are_reported() -> None:
    """Too many unknowns are a fault of the input, too few iterations end with status 4."""
    with pytest.raises(UserError, match="at most 3999 harmonics"):
        climb(oscillator_modes(), kelvin_voigt(100.0), 0.8, 4001, samples_per_harmonic=5)
    with pytest.raises(NotConverged) as caught:
        climb(oscillator_modes(), kelvin_voigt(1.0e6), 0.8, 10, max_iterations=1)
    assert caught.value.exit_status == 4


def test_series() -> None:
    """Coefficients of a product and of a derivative, against those of sampled functions."""
    series = Fourier(3, 64, 2.0 * pi)
    f, y = np.random.default_rng(2).normal(size=(2, 7))
    sampled = (series.waves @ f) * (series.waves @ y)
    product = series.multiplication(series.waves @ f) @ y
    assert product == pytest.approx(series.analyze(sampled[:, None])[:, 0], abs=1e-12)
    step = 1.0e-6
    ahead, behind = (series.waves_at(series.times + s) @ y for s in (step, -step))
    assert series.waves @ series.rates(y[:, None])[:, 0] == pytest.approx((ahead - behind) / (2.0 * step), abs=1e-6)
    sampled = (series.waves @ f) * (series.waves_at(series.times + 0.03) @ y)
    product = series.shifted_columns(series.multiplication(series.waves @ f), 0.03) @ y
    assert product == pytest.approx(series.analyze(sampled[:, None])[:, 0], abs=1e-12)
