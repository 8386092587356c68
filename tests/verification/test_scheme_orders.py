"""Observed order in time of every scheme on linear systems, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from math import cos, exp, sin, sqrt

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.system.semi_discrete import imaged
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator

FAR = 1.0e6  # a stop that is never met


def closed_form(t: float, zeta: float, big_omega: float) -> tuple[float, float]:
    """Displacement and velocity of x'' + 2 zeta x' + x = sin(Omega t), x(0) = 0.3, x'(0) = -0.2."""
    omega = big_omega
    denominator = (1.0 - omega**2) ** 2 + (2.0 * zeta * omega) ** 2
    a, b = (1.0 - omega**2) / denominator, -2.0 * zeta * omega / denominator
    damped = sqrt(1.0 - zeta**2)
    c = 0.3 - b
    d = (-0.2 - a * omega + zeta * c) / damped
    decay, co, si = exp(-zeta * t), cos(damped * t), sin(damped * t)
    x = a * sin(omega * t) + b * cos(omega * t) + decay * (c * co + d * si)
    v = (
        a * omega * cos(omega * t)
        - b * omega * sin(omega * t)
        + decay * ((-zeta * c + d * damped) * co + (-zeta * d - c * damped) * si)
    )
    return x, v


@pytest.mark.parametrize("name", SCHEMES)
def test_order_two_on_a_forced_damped_oscillator(name: str) -> None:
    """Six levels; the order over each pair of the finer ones is 2 within 0.1, in displacement and velocity."""
    zeta, omega, end = 0.05, 1.7, 10.0
    system = stopped_oscillator(1.0, 1.0, FAR, zeta, lambda t: sin(omega * t))
    exact = np.array(closed_form(end, zeta, omega))
    errors = []
    for count in (100, 200, 400, 800, 1600, 3200):
        last = steps_of(system, kelvin_voigt(1.0), SCHEMES[name], start(system, 0.3, -0.2), end / count, count)[-1]
        errors.append(np.linalg.norm([last.new.u[0, 0] - exact[0], last.new.v[0, 0] - exact[1]]))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders[1:] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.8, 1.0])
def test_generalized_alpha_has_its_spectral_radius(rho: float) -> None:
    """Far above the step the eigenvalues of the amplification matrix have modulus rho_inf (Chung and Hulbert 1993)."""
    scheme = scheme_of("generalized-alpha", rho_inf=rho)
    system = stopped_oscillator(1.0, 1.0, FAR)
    dt = 1.0e5
    condensed = CondensedOperator(system, *scheme.coefficients(system, dt))
    columns = []
    for unit in np.eye(3):
        u, v, a = unit / np.array([1.0, dt, dt * dt])
        state = replace(start(system, u, v), a=imaged(system.operators, np.array([a])))
        new = scheme.advance(system, condensed, kelvin_voigt(1.0), state, dt).new
        assert new.a is not None
        columns.append([new.u[0, 0], new.v[0, 0] * dt, new.a[0, 0] * dt * dt])
    radius = np.max(np.abs(np.linalg.eigvals(np.array(columns).T)))
    assert radius == pytest.approx(rho, abs=2e-3)
