"""Moreau and Jean's scheme: impulses never make energy, and a body at a stop follows event solutions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface
from gapbeam.solver.system.semi_discrete import VALUE, SemiDiscreteSystem, State, imaged
from tests.shared.dense_beams import dense_beam, thrown_start
from tests.shared.toys import ledger_of, steps_of, stopped_oscillator
from tests.verification.test_rod import rod

IMPULSES = replace(kelvin_voigt(1e6), stores_energy=False)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    restitution=st.floats(0.0, 1.0),
    weight=st.one_of(st.just(0.0), st.floats(0.0, 1.0)),
    dt=st.floats(-4.0, -1.5).map(lambda power: 10.0**power),
)
@example(seed=51734, restitution=0.0, weight=0.0, dt=10**-3.5)
def test_impulses_never_make_energy(seed: int, restitution: float, weight: float, dt: float) -> None:
    """Drawn bodies between two faces, under loads, for every theta from 1/2 to 1 / (1 + e); faces open and close."""
    system = dense_beam(seed=seed, damping=0.0)
    theta = 0.5 + weight * (1.0 / (1.0 + restitution) - 0.5)
    scheme, begin = scheme_of("moreau-jean", theta=theta, restitution=restitution), thrown_start(system)
    ledger = ledger_of(system, IMPULSES, begin, steps_of(system, IMPULSES, scheme, begin, dt, 150))
    hidden = 1e-14 * np.linalg.cond(system.operators.mass)  # round-off of bodies that are nearly without mass
    assert not scheme.creates_energy
    assert ledger.created <= (1e-9 + hidden) * ledger.exchanged
    assert ledger.contact_gain <= (1e-9 + hidden) * ledger.exchanged


@pytest.mark.parametrize(
    ("seed", "restitution", "theta", "dt"), [(999999, 1.0, 1.0, 0.01), (834954, 0.8, 0.7, 0.0021051371644694107)]
)
def test_a_theta_above_its_bound_is_known_to_make_energy(
    seed: int, restitution: float, theta: float, dt: float
) -> None:
    """Above 1 / (1 + e) the ledger shows it, and the scheme says so."""
    system = dense_beam(seed=seed, damping=0.0)
    scheme, begin = scheme_of("moreau-jean", theta=theta, restitution=restitution), thrown_start(system)
    ledger = ledger_of(system, IMPULSES, begin, steps_of(system, IMPULSES, scheme, begin, dt, 150))
    assert ledger.created > 1e-3 * ledger.exchanged
    assert scheme.creates_energy
    assert [f"1 / (1 + restitution) = {1.0 / (1.0 + restitution):.6g}" in words for words in scheme.warnings()] == [
        True
    ]


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("cfl", [1.0, 5.0, 20.0])
def test_a_rod_that_falls_never_has_more_energy_than_at_the_start(restitution: float, cfl: float) -> None:
    """Its node leaves the wall and meets it again within long steps: no impulse then does work on it."""
    system, x = rod(200)
    u, dt = 0.5 * (1.0 - x), cfl / 200
    start = State(0.0, imaged(system.operators, u), imaged(system.operators, 0.0 * u), -u[:1], np.zeros(1))
    steps = steps_of(system, IMPULSES, scheme_of("moreau-jean", restitution=restitution), start, dt, round(12.0 / dt))
    works = [dt * step.stage.pressure[0] * step.stage.velocity[VALUE][0] for step in steps]
    assert min(works) < 0.0
    assert max(works) < 1e-12
    assert np.abs(sum(works) + ledger_of(system, IMPULSES, start, steps).contact_loss) < 1e-12


K = np.array([[900.0, -900.0], [-900.0, 1900.0]])
M = np.array([1.0, 3.0])


def two_masses() -> SemiDiscreteSystem:
    """A mass that a second one, held by a soft spring, drives against a stop."""
    stop = stopped_oscillator(gap=0.01).contact
    stop = replace(stop, interface=Interface(2, np.array([0, 1]), np.array([0, 1])), gap_matrix=csr_matrix([[-1.0, 0]]))
    return SemiDiscreteSystem(DenseOperators(np.diag(M), K), stop)


def from_impact_to_impact(restitution: float, end: float) -> tuple[np.ndarray, float, int]:
    """Return the places at the end, the energy that the impacts took, and their number."""
    y, t, lost, hits = np.array([0.0, 0.0, 2.0, 1.0]), 0.0, 0.0, 0

    def rates(t: float, y: Any) -> Any:  # noqa: ARG001
        return np.concatenate([y[2:], -K @ y[:2] / M])

    def meet(t: float, y: Any) -> float:  # noqa: ARG001
        return float(y[0] - 0.01)

    meet.terminal, meet.direction = True, 1.0  # type: ignore[attr-defined]
    while True:
        part = solve_ivp(rates, (t, end), y, "DOP853", events=meet, rtol=1e-11, atol=1e-14)
        y, t = part.y[:, -1].copy(), float(part.t[-1])
        if part.status == 0:
            return y[:2], lost, hits
        lost, hits = lost + 0.5 * M[0] * (1.0 - restitution**2) * y[2] ** 2, hits + 1
        y[2] *= -restitution


@pytest.mark.parametrize("restitution", [0.6, 1.0])
def test_a_body_at_a_stop_follows_an_integration_from_impact_to_impact(restitution: float) -> None:
    """Places and the energy that impacts took: the errors fall with the step, of order 1."""
    place, lost, hits = from_impact_to_impact(restitution, 1.2)
    system, errors, sizes = two_masses(), list[list[float]](), 1.6e-3 / 4.0 ** np.arange(3)
    still, thrown = (imaged(system.operators, np.array(one)) for one in ([0.0, 0.0], [2.0, 1.0]))
    start = State(0.0, still, thrown, np.array([-0.01]), np.zeros(1))
    for dt in sizes:
        scheme = scheme_of("moreau-jean", restitution=restitution)
        steps = steps_of(system, IMPULSES, scheme, start, dt, round(1.2 / dt))
        ledger = ledger_of(system, IMPULSES, start, steps)
        assert abs(ledger.algorithmic) < 1e-6 * ledger.exchanged
        errors.append([np.abs(steps[-1].new.u[VALUE] - place).max(), abs(ledger.contact_loss - lost)])
    found = np.array(errors) / [0.05, ledger.exchanged]
    assert hits > 5
    assert np.all(found[-1] < 0.03)
    for column in found.T[: 1 if restitution == 1.0 else 2]:
        assert np.polyfit(np.log(sizes), np.log(column), 1)[0] == pytest.approx(1.0, abs=0.5)
