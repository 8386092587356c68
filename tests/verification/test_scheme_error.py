"""Numerical damping and period error of the time schemes: closed forms, and the measured decay of an oscillator."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.integrators.scheme_choice import scheme_names, scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme, carried_error, scheme_error
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.toys import start, steps_of, stopped_oscillator

KEYS = {
    "newmark": {"gamma": 0.7, "beta": 0.36},
    "hht-alpha": {"alpha": 0.3},
    "generalized-alpha": {"rho_inf": 0.0},
    "moreau-jean": {"theta": 0.8},
}
ALL = {name: scheme_of(name, **KEYS.get(name, {})) for name in scheme_names()}
SMALL = np.array([0.02])
PARASITE = 40  # steps after which the third root of generalized-alpha has died out


@pytest.mark.parametrize("angle", [0.05, 0.5, 1.5])
def test_trapezoidal_rule_and_central_difference(angle: float) -> None:
    """Their phases are 2 arctan(w dt / 2) and 2 arcsin(w dt / 2); neither damps."""
    at = np.array([angle])
    for name, phase in (
        ("discrete-gradient", 2.0 * np.arctan(angle / 2.0)),
        ("newmark", 2.0 * np.arctan(angle / 2.0)),
        ("central-difference", 2.0 * np.arcsin(angle / 2.0)),
    ):
        found = scheme_error(scheme_of(name), at)
        assert found.period_error[0] == pytest.approx(angle / phase - 1.0, rel=1e-9)
        assert abs(found.damping_ratio[0]) < 1e-13


def test_leading_terms() -> None:
    """Period error w^2 dt^2 / 12; damping ratio (gamma - 1/2) w dt / 2, or (theta - 1/2) w dt."""
    x = SMALL[0]
    assert scheme_error(scheme_of("discrete-gradient"), SMALL).period_error[0] == pytest.approx(x * x / 12, rel=1e-3)
    for gamma in (0.55, 0.7, 0.9):
        ratio = scheme_error(scheme_of("newmark", gamma=gamma, beta=0.25 * (gamma + 0.5) ** 2), SMALL).damping_ratio[0]
        assert ratio == pytest.approx(0.5 * (gamma - 0.5) * x, rel=2e-2)
    ratio = scheme_error(scheme_of("moreau-jean", theta=0.7), SMALL).damping_ratio[0]
    assert ratio == pytest.approx(0.2 * x, rel=2e-2)


def test_radius_at_infinite_frequency() -> None:
    """Generalized-alpha keeps the spectral radius that it is asked for (Chung and Hulbert 1993)."""
    for radius in (0.0, 0.3, 0.8, 1.0):
        values = np.linalg.eigvals(scheme_of("generalized-alpha", rho_inf=radius).amplification(1.0e4))
        assert np.max(np.abs(values)) == pytest.approx(radius, abs=2e-2)


@pytest.mark.parametrize("name", ALL)
def test_measured_decay(name: str) -> None:
    """A marched oscillator decays, and is late, as the amplification matrix says."""
    frequency, dt, steps = 10.0, 0.03, 400
    scheme: TimeScheme = ALL[name]
    system, law = stopped_oscillator(1.0, frequency**2, 1.0e3), kelvin_voigt(1.0)
    marched = steps_of(system, law, scheme, start(system, 1.0), dt, steps)
    place = np.array([1.0, *(step.new.u[VALUE][0] for step in marched)])
    found = scheme_error(scheme, np.array([frequency * dt]))
    n = np.arange(steps + 1)

    def fit(turned: float) -> float:
        """Return what is left of the motion after a decaying oscillation."""
        decay = float(found.damping_ratio[0]) * turned
        basis = np.exp(-decay * n)[:, None] * np.stack([np.cos(turned * n), np.sin(turned * n)], axis=1)
        later = slice(PARASITE, None)
        left = place[later] - basis[later] @ np.linalg.lstsq(basis[later], place[later], rcond=None)[0]
        return float(np.linalg.norm(left) / np.linalg.norm(place[later]))

    turned = frequency * dt / (1.0 + float(found.period_error[0]))
    assert fit(turned) < 1e-6
    assert fit(frequency * dt) > 1e-2
    # the envelope, measured from the peaks of the motion alone
    crossings = np.flatnonzero(place[:-1] * place[1:] < 0.0)
    times = crossings + place[crossings] / (place[crossings] - place[crossings + 1])
    assert 2.0 * np.mean(np.diff(times)) == pytest.approx(2.0 * np.pi / turned, rel=1e-3)
    peaks = np.array([np.max(np.abs(place[a + 1 : b + 1])) for a, b in pairwise(crossings)])
    measured = -np.polyfit(np.arange(len(peaks)), np.log(peaks), 1)[0] / np.pi
    assert measured == pytest.approx(found.damping_ratio[0], rel=0.05, abs=2e-4)


def test_no_oscillation_left() -> None:
    """Where a step ends the motion, or makes it grow without turning, it counts as wholly off."""
    scheme = scheme_of("central-difference")
    unstable = brentq(lambda x: float(np.max(np.abs(np.linalg.eigvals(scheme.amplification(x))))) - 1.5, 2.01, 4.0)
    assert scheme_error(scheme, np.array([unstable])).damping_ratio[0] == -np.inf
    assert carried_error(scheme, np.array([unstable]), np.array([1.0])) == (-1.0, 1.0)


def test_energy_is_what_weighs() -> None:
    """A thousandth of the energy at a frequency that is lost counts a thousandth."""
    scheme = scheme_of("newmark", gamma=0.7, beta=0.36)
    low, _ = carried_error(scheme, np.array([0.1]), np.array([1.0]))
    both, _ = carried_error(scheme, np.array([0.1, 1.0e3]), np.array([0.999, 0.001]))
    assert low < both < low + 2e-3
    assert carried_error(scheme, np.array([0.1]), np.array([0.0])) == (0.0, 0.0)
