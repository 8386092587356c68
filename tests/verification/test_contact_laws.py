"""A mass meets a wall: contact laws against closed forms.

Sources: elastic impact on K d^n by energy; Hunt and Crossley (1975): p (1+e) = ln((1+p)/(1-p e)), p = chi v0;
Lankarani and Nikravesh (1990) for chi = 3 (1-e^2)/(4 v0); ADAMS IMPACT against scipy's DOP853 at 1e-12.
"""

from __future__ import annotations

from math import asin, gamma, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.law_choice import hunt_crossley_product, nearly_elastic_product
from gapbeam.solver.contact.laws.springs import Spring, power
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.system.semi_discrete import Step
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator

SPEED = 0.7
STEPS = {"discrete-gradient": 2500, "newmark": 800, "generalized-alpha": 800}
"""Steps of an impact by scheme, all of order two: the usual one is held to 1e-6, the others to what 800 steps give."""
WITHIN = {name: 1e-6 * (2500 / count) ** 2 for name, count in STEPS.items()}
ORDER_TWO = tuple(STEPS)


def impact_length(spring: Spring) -> tuple[float, float]:
    """Depth and duration of the elastic impact of a unit mass: d_max = ((n+1) v^2 / (2K))^(1/(n+1)), T by Beta."""
    n, q = spring.exponent, 1.0 / (spring.exponent + 1.0)
    deepest = ((n + 1.0) * SPEED**2 / (2.0 * spring.stiffness)) ** q
    return deepest, 2.0 * deepest / SPEED * sqrt(pi) * gamma(1.0 + q) / gamma(0.5 + q)


@given(
    depth=st.floats(1.0e-12, 1.0), halves=st.integers(0, 8), fours=st.integers(-12, 12), exponent=st.floats(0.0, 4.0)
)
@settings(deadline=None)
def test_powers_have_the_same_digits_at_every_size(depth: float, halves: int, fours: int, exponent: float) -> None:
    """(4^k d)^(j/2) = 2^(k j) d^(j/2) to the last bit; and d^n agrees with the library to a few last digits."""
    assert power(4.0**fours * depth, 0.5 * halves) == 2.0 ** (fours * halves) * power(depth, 0.5 * halves)
    assert power(depth, exponent) == pytest.approx(depth**exponent, rel=1.0e-14)


def impact(law: ContactLaw, name: str, dt: float, most: int, gap: float = 0.0) -> list[Step]:
    """March a unit mass until it has left the stop again; in at most so many steps."""
    system, scheme = stopped_oscillator(gap=gap), SCHEMES[name]
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), dt, most)
    steps = list[Step]()
    for step in march(plan, start(system, v=SPEED)):
        steps.append(step)
        if step.new.depth[0] < 0.0 and step.new.v[0, 0] < 0.0:
            return steps
    raise AssertionError(f"still in contact after {most} steps")


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
@pytest.mark.parametrize("name", ORDER_TWO)
def test_elastic_impact(exponent: float, name: str) -> None:
    """Depth, duration and return speed of an elastic impact to 1e-6."""
    spring = Spring(1.0e5, exponent)
    deepest, duration = impact_length(spring)
    count, within = STEPS[name], WITHIN[name]
    steps = impact(ContactLaw(spring), name, duration / count, count + 10)
    open_again = steps[-1].new
    assert max(step.new.depth[0] for step in steps) == pytest.approx(deepest, rel=within)
    assert -open_again.v[0, 0] == pytest.approx(SPEED, rel=within)
    lifted_off = open_again.time + open_again.depth[0] / SPEED
    assert lifted_off == pytest.approx(duration, rel=2.0 * within)


@pytest.mark.parametrize(("product", "expected"), [(0.1, 0.93747557995), (0.5, 0.74843493160), (2.0, 0.41071968606)])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("name", ORDER_TWO)
def test_hunt_crossley_restitution(product: float, expected: float, exponent: float, name: str) -> None:
    """The restitution depends on chi v0 alone, to 1e-6."""
    spring = Spring(1.0e5, exponent)
    law = ContactLaw(spring, Damper("hunt-crossley", product / SPEED))
    _, duration = impact_length(spring)
    steps = impact(law, name, duration / STEPS[name], 3 * STEPS[name] // 2)
    assert -steps[-1].new.v[0, 0] / SPEED == pytest.approx(expected, abs=WITHIN[name])


@pytest.mark.parametrize(("asked", "product"), [(0.9, 0.16648), (0.7, 0.63483), (0.5, 1.43275), (0.3, 3.08708)])
def test_restitution_is_solved_exactly(asked: float, product: float) -> None:
    """The mass returns with the restitution asked for; chi follows from the speed at touch, never given."""
    assert hunt_crossley_product(asked) == pytest.approx(product, abs=6e-6)
    spring = Spring(1.0e5, 1.5)
    law = ContactLaw(
        spring, Damper("hunt-crossley", 0.0), touch_product=hunt_crossley_product(asked), slowest_touch=1e-9
    )
    _, duration = impact_length(spring)
    steps = impact(law, "discrete-gradient", duration / 2500, 6000, gap=1e-5)
    assert -steps[-1].new.v[0, 0] / SPEED == pytest.approx(asked, abs=2e-6)


@pytest.mark.parametrize(("asked", "given_by_it"), [(0.9, 0.913), (0.7, 0.796), (0.5, 0.725), (0.3, 0.684)])
def test_lankarani_nikravesh_gives_another_restitution(asked: float, given_by_it: float) -> None:
    """The paper's Eq. 2 returns more than it is asked for."""
    spring = Spring(1.0e5, 1.5)
    law = ContactLaw(
        spring, Damper("hunt-crossley", 0.0), touch_product=nearly_elastic_product(asked), slowest_touch=1e-9
    )
    _, duration = impact_length(spring)
    steps = impact(law, "discrete-gradient", duration / 500, 1500, gap=1e-5)
    assert -steps[-1].new.v[0, 0] / SPEED == pytest.approx(given_by_it, abs=1e-3)


@pytest.mark.parametrize("name", ORDER_TWO)
def test_adams_impact(name: str) -> None:
    """F = max(0, K d^n + STEP(d) d') as ADAMS documents it, against an adaptive integrator at 1e-12."""
    stiffness, exponent, coefficient, full = 1.0e5, 2.2, 40.0, 2.0e-3
    law = ContactLaw(Spring(stiffness, exponent), Damper("adams-impact", coefficient, (full,)))

    def motion(_time: float, state: np.ndarray) -> list[float]:
        depth, rate = state
        if depth <= 0.0:
            return [rate, 0.0]
        q = min(depth / full, 1.0)
        return [rate, -max(0.0, stiffness * depth**exponent + coefficient * q * q * (3.0 - 2.0 * q) * rate)]

    _, duration = impact_length(law.spring)
    end = 1.6 * duration
    exact = solve_ivp(motion, (0.0, end), [0.0, SPEED], method="DOP853", rtol=1e-12, atol=1e-14, max_step=end / 500)
    count = 6 * STEPS[name] // 5
    system = stopped_oscillator()
    steps = steps_of(system, law, SCHEMES[name], start(system, v=SPEED), end / count, count)
    assert steps[-1].new.v[0, 0] == pytest.approx(exact.y[1, -1], abs=WITHIN[name])
    assert abs(exact.y[1, -1]) < 0.9 * SPEED  # it did lose energy


@settings(max_examples=60, deadline=None)
@given(
    exponent=st.floats(1.0, 3.0),
    old=st.floats(-1e-4, 1e-4),
    new=st.floats(-1e-4, 1e-4),
    stiffness=st.floats(1e2, 1e14),
)
def test_mean_pressure_does_the_work(exponent: float, old: float, new: float, stiffness: float) -> None:
    """(d1 - d0) p = psi(d1) - psi(d0) for any two depths, and p does not decrease in d1."""
    spring = Spring(stiffness, exponent)
    depths = np.array([old]), np.array([new])
    pressure, slope, _ = ContactLaw(spring).discrete_gradient(*depths, dt=1.0)
    work = float(np.diff([ContactLaw(spring).potential(one)[0] for one in depths])[0])
    scale = float(ContactLaw(spring).potential(np.array([max(abs(old), abs(new))]))[0])
    assert pressure[0] * (new - old) == pytest.approx(work, abs=1e-10 * scale + 1e-300)
    assert slope[0] >= 0.0
    higher = ContactLaw(spring).discrete_gradient(depths[0], depths[1] + 1e-6, 1.0).pressure
    assert higher[0] >= pressure[0] * (1.0 - 1e-9)


@pytest.mark.parametrize("zeta", [0.05, 0.3, 0.7])
@pytest.mark.parametrize("adhesive", [False, True])
def test_duration_of_kelvin_voigt(zeta: float, adhesive: bool) -> None:
    """Clipped, the force ends after (pi - 2 asin zeta) / w_d, adhesive with the depth after pi / w_d: to 4e-6.

    Source: the force K d + c d' of the damped half wave d = v0 / w_d exp(-zeta w t) sin w_d t vanishes there.
    """
    stiffness = 1.0e4
    damped = sqrt(stiffness * (1.0 - zeta * zeta))
    expected = (pi if adhesive else pi - 2.0 * asin(zeta)) / damped
    law = kelvin_voigt(stiffness, 2.0 * zeta * sqrt(stiffness), adhesive)
    count, system = 3000, stopped_oscillator()
    dt = expected / count
    steps = steps_of(system, law, SCHEMES["discrete-gradient"], start(system, v=SPEED), dt, count - 1)
    times = np.array([step.new.time for step in steps[-6:]])
    if adhesive:
        falling = np.array([step.new.depth[0] for step in steps[-6:]])
    else:
        times, falling = times - 0.5 * dt, np.array([step.stage.pressure[0] for step in steps[-6:]])
    assert np.all(falling[:-1] > 0.0)
    ended = np.polyval(np.polyfit(falling[:-1], (times[:-1] - expected) / expected, 2), 0.0)
    assert abs(ended) < 4e-6


@pytest.mark.parametrize("product", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_duration_of_hunt_crossley(product: float, exponent: float) -> None:
    """The time to lift-off against an adaptive integrator at 1e-12: to 4e-6."""
    spring, factor = Spring(1.0e5, exponent), product / SPEED
    _, elastic = impact_length(spring)

    def force(state: np.ndarray) -> float:
        return float(spring.stiffness * max(state[0], 0.0) ** exponent * (1.0 + factor * state[1]))

    def open_again(_time: float, state: np.ndarray) -> float:
        return float(state[0])

    open_again.terminal, open_again.direction = True, -1.0  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda _time, state: [state[1], -force(state)],
        (0.0, 5.0 * elastic),
        [0.0, SPEED],
        method="DOP853",
        events=open_again,
        rtol=1e-12,
        atol=1e-16,
    )
    expected = float(motion.t_events[0][0])
    law, count = ContactLaw(spring, Damper("hunt-crossley", factor)), 2500
    last = impact(law, "discrete-gradient", expected / count, count + 10)[-1].new
    assert last.time - last.depth[0] / last.v[0, 0] == pytest.approx(expected, rel=4e-6)
