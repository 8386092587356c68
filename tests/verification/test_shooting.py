"""Shooting and Floquet multipliers against closed forms, an independent code, differences, and other ways there."""

from __future__ import annotations

from math import cos, pi

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.periodic.floquet import FOLD, NEIMARK_SACKER, PERIOD_DOUBLING, STABLE, ordered, stability_of
from gapbeam.solver.periodic.period_map import MarchedMap, ModalMap, shoot_marched
from gapbeam.solver.periodic.shooting import shoot
from gapbeam.solver.supports.support import Support
from gapbeam.solver.supports.support_tables import BaseAndGland
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem
from tests.shared.toys import stopped_oscillator
from tests.verification.test_periodic_orbit import HARMONICS, LARGEST_FORCE, MEAN, STATE

MULTIPLIER = 0.67523191  # absolute value of both; source as in tests/verification/test_periodic_orbit.py


def oscillator_map(
    steps: int, omega: float = 0.8, zeta: float = 0.05, gap: float = 0.5, stop: float = 100.0, force: float = 1.0
) -> ModalMap:
    """The period map of x'' + 2 zeta x' + x + stop <x - gap> = force cos(omega t)."""
    system = stopped_oscillator(1.0, 1.0, gap, zeta, lambda t: force * cos(omega * t))
    modal = modal_system(system)
    assert modal is not None
    return ModalMap(modal, kelvin_voigt(stop), scheme_of("discrete-gradient"), 2.0 * pi / omega / steps, steps)


def physical(period_map: ModalMap, x: np.ndarray) -> np.ndarray:
    """Displacement and velocity of an oscillator."""
    return np.concatenate([period_map.modal.dofs(part) for part in np.split(x, 2)])


def chain(
    law: ContactLaw, implicit: bool = False, steps: int = 60, last: float = 100.0, damping: float = 0.002
) -> ModalMap:
    """Three masses on springs with a force on the last, the first two between stops at two sides."""
    stiffness = np.array([[300.0, -100.0, 0.0], [-100.0, 100.0 + last, -last], [0.0, -last, last]])
    rows = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, -0.9, 0.0]])
    everywhere = np.arange(3)
    contact = ContactOperator(
        interface=Interface(3, everywhere, everywhere),
        gap_matrix=csr_matrix(rows),
        weights=np.array([1.0, 0.5, 2.0, 1.0]),
        initial_gap=np.array([0.02, 0.04, 0.03, 0.05]),
        faces=np.array([0, 1, 0, 1]),
        support=Support(BaseAndGland(length=1.0, clearance=0.0).faces, area=1.0),
        positions=np.zeros((4, 3)),
    )
    load = Load("force", np.array([0.0, 0.0, 1.0]), lambda t: 5.0 * cos(6.0 * t))
    system = SemiDiscreteSystem(DenseOperators(np.eye(3), stiffness), contact, (load,), 1.0, damping)
    modal = modal_system(system)
    assert modal is not None
    return ModalMap(
        modal, law, scheme_of("implicit-midpoint" if implicit else "discrete-gradient"), 2.0 * pi / 6.0 / steps, steps
    )


STEPPED = Spring(2.0e4, 1.5)
LAWS = {
    "elastic": kelvin_voigt(800.0),
    "damped": kelvin_voigt(800.0, 6.0),
    "adhesive": kelvin_voigt(800.0, 6.0, adhesive=True),
    "stepped": ContactLaw(STEPPED, Damper("adams-impact", 20.0, (0.01,))),
}


def test_linear_oscillator() -> None:
    """Without contact the orbit and the multipliers are closed forms: those of the rule exactly, of time with order 2.

    Source: x = Re(F e^(i w t) / (1 - w^2 + 2 i zeta w)); multipliers exp(lambda T), lambda = -zeta +- i sqrt(1-zeta^2).
    """
    omega, zeta = 0.8, 0.05
    answer = 1.0 / (1.0 - omega**2 + 2.0j * zeta * omega)
    exact = np.array([answer.real, (1j * omega * answer).real])
    rate = -zeta + 1j * np.sqrt(1.0 - zeta**2)
    errors, drifts = [], []
    for steps in (100, 200):
        period_map = oscillator_map(steps, omega, zeta, gap=100.0)
        orbit = shoot(period_map, np.zeros(2), 1.0e-11)
        assert orbit.iterations == 1
        half = 0.5 * period_map.dt * rate
        of_rule = ((1.0 + half) / (1.0 - half)) ** steps
        found = period_map.stability(orbit.monodromy).multipliers
        assert sorted(found, key=lambda mu: mu.imag) == pytest.approx(
            sorted([of_rule, of_rule.conjugate()], key=lambda mu: mu.imag), abs=1e-12
        )
        drifts.append(min(abs(found - np.exp(rate * period_map.period))))
        errors.append(np.max(np.abs(physical(period_map, orbit.x) - exact)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.02)
    assert np.log2(drifts[0] / drifts[1]) == pytest.approx(2.0, abs=0.02)


def test_known_orbit() -> None:
    """From a poor start to the known orbit: state, multipliers, mean, harmonics and force, by two steps to their limit.

    Source: as in tests/verification/test_periodic_orbit.py.
    """
    states, multipliers, spectra, forces = [], [], [], []
    for steps in (1000, 2000):
        period_map = oscillator_map(steps)
        orbit = shoot(period_map, np.array([0.6, -1.4]), 1.0e-11)
        assert period_map.stability(orbit.monodromy).stable
        states.append(physical(period_map, orbit.x))
        multipliers.append(np.sqrt(abs(np.linalg.det(orbit.monodromy))))
        x, force = period_map.history(orbit.x)
        spectrum = np.fft.rfft(x[:-1, 0]) / steps
        spectra.append([spectrum[0].real, *2.0 * np.abs(spectrum[1:6])])
        forces.append(np.max(force))
    limit = (4.0 * states[1] - states[0]) / 3.0
    assert limit == pytest.approx(STATE, abs=1e-5)
    assert (4.0 * np.array(spectra[1]) - spectra[0]) / 3.0 == pytest.approx([MEAN, *HARMONICS], abs=1e-5)
    assert multipliers == pytest.approx([MULTIPLIER] * 2, rel=1e-3)
    assert max(forces) == pytest.approx(LARGEST_FORCE, rel=1e-3)


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_tangent_is_the_derivative(law: ContactLaw, implicit: bool) -> None:
    """The monodromy matrix is the difference quotient of the period map, at a state whose period has many impacts."""
    period_map = chain(law, implicit)
    x = np.array([0.01, 0.02, -0.01, 0.1, 0.3, -0.2])
    _, tangent = period_map.with_tangent(x)
    step = 1.0e-7
    quotient = np.array(
        [(period_map.after(x + step * e) - period_map.after(x - step * e)) / (2.0 * step) for e in np.eye(6)]
    ).T
    _, force = period_map.history(x)
    assert np.max(force) > 0.0
    assert tangent == pytest.approx(quotient, abs=2e-5 * np.max(np.abs(quotient)))


@pytest.mark.parametrize(
    ("last", "damping"), [((1e10, 1e6), 0.002), ((1e12, 1e6), 0.002), ((1e9, 1e6), 1e-9), ((100.0, 100.0), 50.0)]
)
def test_multipliers_are_those_of_motions_that_the_step_resolves(last: tuple[float, float], damping: float) -> None:
    """A stiff link turns its velocity round in each step, whether it damps within a step or in many; creep is slow.

    The largest multiplier is that of steps that resolve the link, or a softer one, which moves as little.
    """
    largest = []
    for stiffness, steps in zip(last, (600, 200_000), strict=True):
        one = chain(LAWS["damped"], steps=steps, last=stiffness, damping=damping)
        x = np.zeros(6)
        for _ in range(20):
            x = one.after(x)
        monodromy = shoot(one, x, 1e-8).monodromy
        largest.append((one.stability(monodromy).largest, stability_of(monodromy).largest))
    (found, kept), (resolved, _) = largest
    assert found == pytest.approx(resolved, rel=0.02)
    assert kept > 0.8  # in the map of the steps, also of creep


@pytest.mark.parametrize("implicit", [False, True])
def test_krylov_finds_the_same_orbit(implicit: bool) -> None:
    """Newton's method with GMRES, without a monodromy matrix, finds orbit and multipliers of the dense one."""
    period_map = chain(LAWS["damped"], implicit)
    x = np.zeros(6)
    for _ in range(5):
        x = period_map.after(x)
    orbit = shoot(period_map, x, 1.0e-12)
    system = period_map.modal.system
    plan = March(
        system, period_map.law, period_map.scheme, EffectiveOperators(system, period_map.scheme), period_map.dt,
        period_map.steps,
    )  # fmt: skip
    marched = shoot_marched(MarchedMap(plan), period_map.state(x), 1.0e-12)
    found = period_map.coordinates(marched.state)
    assert period_map.scale * (found - orbit.x) == pytest.approx(0.0, abs=1e-10)
    assert marched.multiplier_error <= 1.0e-3
    assert marched.stability.largest == pytest.approx(period_map.stability(orbit.monodromy).largest, abs=2e-3)
    assert marched.residual <= 1.0e-12


def test_krylov_can_be_left_before_every_march() -> None:
    """An iteration has dozens of marches; a wall-time limit of 50 s was passed by a minute in the middle of one."""
    period_map = chain(LAWS["damped"], False)
    system = period_map.modal.system
    plan = March(
        system, period_map.law, period_map.scheme, EffectiveOperators(system, period_map.scheme), period_map.dt,
        period_map.steps,
    )  # fmt: skip
    asked = 0

    def pause() -> None:
        nonlocal asked
        asked += 1
        if asked == 3:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        shoot_marched(MarchedMap(plan), period_map.state(np.zeros(6)), 1.0e-12, pause=pause)
    assert asked == 3


def test_march_settles_on_the_orbit() -> None:
    """A march from nearby comes to the orbit as the powers of the monodromy matrix say, and the orbit attracts it."""
    period_map = oscillator_map(200)
    orbit = shoot(period_map, np.array([0.6, -1.4]), 1.0e-12)
    away = np.array([1.0e-5, 0.0])
    x = orbit.x + away
    for _ in range(10):
        x, away = period_map.after(x), orbit.monodromy @ away
    assert x - orbit.x == pytest.approx(away, abs=2e-2 * np.linalg.norm(away))
    assert np.linalg.norm(away) < 1.0e-5


def test_no_orbit_is_reported() -> None:
    """An undamped oscillator at the frequency of the midpoint rule has no periodic response: that is an error."""
    period_map = oscillator_map(100, omega=pi / (100.0 * np.tan(pi / 100.0)), zeta=0.0, gap=1.0e6)
    with pytest.raises(NotConverged) as caught:
        shoot(period_map, np.array([1.0, 0.0]), 1.0e-13, max_iterations=5)
    assert caught.value.exit_status == 4
    assert caught.value.residuals


def test_kinds_of_multipliers() -> None:
    """Where the largest multiplier has left the unit circle names what has happened."""
    assert ordered(np.array([0.2, -0.9])).kind == STABLE
    assert ordered(np.array([1.2, -0.9])).kind == FOLD
    assert ordered(np.array([0.2, -1.1])).kind == PERIOD_DOUBLING
    assert ordered(np.array([0.9 + 0.9j, 0.9 - 0.9j])).kind == NEIMARK_SACKER
    assert ordered(np.array([0.2, -1.1])).doubling_test < 0.0 < ordered(np.array([0.2, -0.9])).doubling_test


def test_rest_is_an_orbit() -> None:
    """Without a force the state of rest is a periodic response at once."""
    period_map = oscillator_map(50, force=0.0)
    orbit = shoot(period_map, np.zeros(2))
    assert orbit.iterations == 0
    assert orbit.x == pytest.approx(np.zeros(2), abs=0.0)
    assert period_map.state(orbit.x).u[VALUE] == pytest.approx(0.0, abs=0.0)
