"""Impacts of both marches against exact ones: a mass between elastic stops, and Maxwell's flux under white noise."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.stats import kstest, rayleigh

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.contact_episodes import MOST, ImpactList
from gapbeam.solver.diagnostics.march_diagnostics import Accounts, Impacts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged
from tests.shared.rattlers import TEMPERATURE, between_stops, rattled

GAP, SPEED, STIFFNESS = 1.0, 2.0, 1.0e4
CONTACT = pi / sqrt(STIFFNESS)
PERIOD = 2.0 * (2.0 * GAP / SPEED + CONTACT)


def bounced(compiled: bool, steps_of_contact: int, periods: float) -> Accounts:
    """March a mass of 1 kg between two elastic stops, without loads and losses."""
    contact = ContactOperator(
        interface=Interface(1, np.array([0]), np.array([0])),
        gap_matrix=csr_matrix(np.array([[-1.0], [1.0]])),
        weights=np.ones(2),
        initial_gap=np.full(2, GAP),
        faces=np.arange(2),
        support=Support((Face("upper", -GAP), Face("lower", GAP)), area=1.0),
        positions=np.zeros((2, 3)),
    )
    system = SemiDiscreteSystem(DenseOperators(np.eye(1), np.zeros((1, 1))), contact, ())
    law, scheme, step = ContactLaw(Spring(STIFFNESS)), scheme_of("discrete-gradient"), CONTACT / steps_of_contact
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), step, round(periods * PERIOD / step))
    place, speed = np.zeros(1), np.array([SPEED])
    depth = contact.depth(place)
    start = State(0.0, imaged(system.operators, place), imaged(system.operators, speed), depth, np.zeros(2))
    start = begun(plan, start)
    accounts = Accounts.opened(system, law, start, step)
    if compiled:
        list(CompiledLoop(plan).blocks(start, 7, accounts, stops=100))
    else:
        for one in march(plan, start):
            accounts.take(one)
    return accounts


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("compiled", [True, False])
def test_a_mass_between_elastic_stops(compiled: bool) -> None:
    """Rate v / (2 (2 g + v pi / w)), speed v, impulse 2 m v, duration pi / w and square of the force of impacts.

    A single speed lacks up to (w h)^2 / 4 of it, where the whole step is in contact.
    """
    accounts = bounced(compiled, 32, 4.9)
    found = accounts.impacts
    first = (GAP / SPEED, GAP / SPEED + 0.5 * PERIOD)
    for kept, begin in zip(found.ended, first, strict=True):
        times, speeds, impulses, durations = kept.rows.T
        assert kept.count == 5
        assert times == pytest.approx(begin + PERIOD * np.arange(len(times)), abs=2e-3 * PERIOD)
        assert speeds == pytest.approx(SPEED, rel=(pi / 32) ** 2 / 4)
        assert impulses == pytest.approx(2.0 * SPEED, rel=1e-9)
        assert durations == pytest.approx(CONTACT, rel=5e-3)
    counts = [one.count for one in found.ended]
    squares = SPEED**2 * sqrt(STIFFNESS) * pi / 2.0 * np.array(counts)  # of half a sine of force m v w
    assert accounts.peaks.square == pytest.approx(squares, rel=(pi / 32) ** 2)
    assert found.approach == pytest.approx(SPEED * np.array(counts), rel=(pi / 32) ** 2 / 4)


def test_the_speed_has_the_error_that_is_documented() -> None:
    """Contact takes (w h)^2 / 24 of the approach speed within the step in which it begins: 2.6 % of it at 4 steps."""
    errors = {}
    for steps in (4, 16):
        rows = np.concatenate([one.rows for one in bounced(True, steps, 60.3).impacts.ended])
        errors[steps] = 1.0 - float(rows[:, 1].mean()) / SPEED
    assert 0.5 * (pi / 4) ** 2 / 24 < errors[4] < 2.0 * (pi / 4) ** 2 / 24
    assert abs(errors[16]) < 2.0 * (pi / 16) ** 2 / 24


def test_marches_agree_on_impacts() -> None:
    one, other = (bounced(compiled, 8, 3.3).impacts for compiled in (True, False))
    for mine, theirs in zip(one.ended, other.ended, strict=True):
        assert mine.count == theirs.count > 2
        assert mine.rows == pytest.approx(theirs.rows, rel=1e-9)


def test_speeds_under_white_noise_are_rayleigh_s() -> None:
    """Speeds at which a level is passed have the density v / T exp(-v^2 / 2 T), whatever the potential.

    Round-off makes another sample of the motion on another processor. The mean of a seed has a standard deviation of
    2.5 %, that of six seeds 1 %.
    """
    found = []
    for seed in range(5, 11):
        _, accounts = rattled(between_stops(2), seed=seed, seconds=4000.0)
        ended = accounts.impacts.ended
        lasting = [int(c) - one.count for one, c in zip(ended, accounts.times.closings, strict=True)]
        assert set(lasting) <= {0, 1}  # a contact that lasts at the end has closed, and is no impact yet
        found.extend(one.rows[:, 1] for one in ended)
    speeds = np.concatenate(found)
    assert len(speeds) > 6000
    assert speeds.mean() == pytest.approx(sqrt(0.5 * pi * TEMPERATURE), rel=0.04)
    assert np.mean(speeds > 2.0) == pytest.approx(exp(-2.0 / TEMPERATURE), rel=0.2)
    assert kstest(speeds, rayleigh(scale=sqrt(TEMPERATURE)).cdf).statistic < 0.04


def test_a_long_list_is_thinned_evenly() -> None:
    """What is kept does not depend on how many come at once, and is spread over all."""
    rows = np.arange(4.0 * 20_001).reshape(-1, 4)
    whole, parts = ImpactList(), ImpactList()
    whole.add(rows)
    for begin in range(0, len(rows), 777):
        parts.add(rows[begin : begin + 777])
    assert whole.count == parts.count == len(rows)
    assert whole.every == parts.every == 8
    assert np.array_equal(whole.rows, rows[::8])
    assert np.array_equal(parts.rows, rows[::8])
    assert len(whole.rows) <= MOST
    again = ImpactList()
    again.restore(whole.as_json())
    assert again.as_json() == whole.as_json()
    with pytest.raises(ValueError, match="expected finite numbers"):
        again.restore(whole.as_json() | {"count": 3})


def test_impacts_survive_a_checkpoint() -> None:
    """Running contact and a gap that is not known come back to the last bit."""
    impacts = bounced(False, 8, 0.25).impacts  # in the first contact
    assert impacts.duration.max() > 0.0
    impacts.depth[1] = -np.inf
    again = Impacts(np.zeros(2), np.zeros(2))
    again.restore(impacts.as_json())
    assert again.as_json() == impacts.as_json()
    with pytest.raises(ValueError, match="expected finite numbers of 2"):
        again.restore(impacts.as_json() | {"speed": [0.0]})
