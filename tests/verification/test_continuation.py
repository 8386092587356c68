"""Curves of periodic responses: closed forms, folds against marches up and down, period doubling against marches."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from math import cos, pi, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.periodic.continuation import CurveSettings, ResponseCurve, follow
from gapbeam.solver.periodic.floquet import FOLD, GRAZING, PERIOD_DOUBLING, PITCHFORK, UNKNOWN
from gapbeam.solver.periodic.period_map import ModalMap
from gapbeam.solver.periodic.response_branches import Branches, follow_branches
from gapbeam.solver.periodic.shooting import shoot
from gapbeam.solver.system.modal_coordinates import modal_system
from tests.shared.toys import stopped_oscillator
from tests.verification.test_shooting import oscillator_map, physical

HARDENING = {"zeta": 0.05, "gap": 1.0, "stop": 2.0, "force": 0.2}
"""A soft stop: the resonance bends to higher frequencies and folds over."""

IMPACTS = {"zeta": 0.03, "gap": 0.5, "stop": 100.0, "force": 1.0}
"""A hard stop: between two period doublings near w = 1 the response of one period is unstable."""


def settled(period_map: ModalMap, x: np.ndarray, periods: int = 200) -> np.ndarray:
    """The state after many periods."""
    for _ in range(periods):
        x = period_map.after(x)
    return x


def peak(period_map: ModalMap, x: np.ndarray) -> float:
    """Peak to peak over a period."""
    return float(np.ptp(period_map.history(x)[0]))


@cache
def hardening_curve() -> ResponseCurve:
    return follow(
        lambda omega: oscillator_map(120, omega, **HARDENING), 0.8, np.array([0.5, 0.0]), CurveSettings(0.7, 1.4)
    )


@cache
def impacting_curve() -> ResponseCurve:
    start = oscillator_map(200, 0.9, **IMPACTS)
    x = settled(start, np.array([0.65, -0.5]), 60)
    return follow(lambda omega: oscillator_map(200, omega, **IMPACTS), 0.9, x, CurveSettings(0.88, 1.2))


@pytest.mark.slow(minutes=0.1)
def test_resonance_curve_of_a_linear_oscillator() -> None:
    """Without contact the curve is F / sqrt((1 - w^2)^2 + (2 zeta w)^2) over all frequencies, without events.

    The points are those of 400 steps a period: 2e-4 of the amplitude.
    """
    curve = follow(lambda omega: oscillator_map(400, omega, 0.05, gap=100.0), 0.9, np.zeros(2), CurveSettings(0.5, 1.6))
    assert curve.events == []
    values = [point.value for point in curve.points]
    assert values == sorted(values)
    assert [values[0], values[-1]] == [0.5, 1.6]
    assert curve.endings == ("the end of the range",) * 2
    assert len(values) > 20
    for point in curve.points:
        omega = point.value
        amplitude = 1.0 / sqrt((1.0 - omega**2) ** 2 + (0.1 * omega) ** 2)
        found = peak(oscillator_map(400, omega, 0.05, gap=100.0), point.x)
        assert found == pytest.approx(2.0 * amplitude, rel=2e-3)
        assert point.stability.stable


def test_stability_without_damping_is_not_known() -> None:
    """The multipliers of an oscillator that nothing damps are exp(+-2 pi i / w): which side of 1 is round-off."""
    settings = CurveSettings(0.75, 0.85, first_step=0.05)
    curve = follow(lambda omega: oscillator_map(100, omega, 0.0, gap=100.0), 0.8, np.zeros(2), settings)
    assert len(curve.points) > 5
    assert curve.events == []
    for point in curve.points:
        assert point.stability.largest == pytest.approx(1.0, abs=1e-12)
        assert point.stability.stable is None
        assert point.stability.kind == UNKNOWN
    damped = oscillator_map(100, 0.8, 1.0e-7, gap=100.0)
    assert damped.stability(shoot(damped, np.zeros(2)).monodromy).stable is True


@pytest.mark.slow(minutes=0.3)
def test_folds_are_where_marches_jump() -> None:
    """Marches up and down in frequency jump at the two folds.

    The response between the folds is unstable, with a real multiplier above 1, which is 1 at the folds.
    """
    curve = hardening_curve()
    high, low = (event for event in curve.events if event.event == FOLD)
    assert {event.event for event in curve.events} == {FOLD, GRAZING}
    assert low.value == pytest.approx(1.08, abs=0.01)
    for fold in (high, low):
        assert fold.stability.multipliers[0].real == pytest.approx(1.0, abs=0.01)
    first, last = (next(i for i, point in enumerate(curve.points) if point is fold) for fold in (high, low))
    assert all(not point.stability.stable for point in curve.points[first + 1 : last])
    assert all(point.stability.stable for point in (*curve.points[:first], *curve.points[last + 1 :]))
    step = 0.002
    for fold, direction in ((high, 1.0), (low, -1.0)):
        x = settled(oscillator_map(120, fold.value - 9.0 * direction * step, **HARDENING), fold.x)
        heights = []
        for number in range(-8, 9):
            period_map = oscillator_map(120, fold.value + (number + 0.5) * direction * step, **HARDENING)
            x = settled(period_map, x)
            heights.append(peak(period_map, x))
        jumps = np.abs(np.diff(heights))
        assert int(np.argmax(jumps)) == 7  # between half a step before the fold and half a step behind it
        assert jumps[7] > 5.0 * np.median(jumps)


@pytest.mark.slow(minutes=0.1)
def test_period_doubles_where_the_multiplier_is_minus_one() -> None:
    """Between the two doublings a march leaves the response of one period for one of two; outside it comes back to it.

    Shooting over two periods finds the response that the march settles on.
    """
    curve = impacting_curve()
    first, second = curve.events
    assert [first.event, second.event] == [PERIOD_DOUBLING, PERIOD_DOUBLING]
    for event in (first, second):
        assert event.stability.multipliers[0] == pytest.approx(-1.0, abs=1e-3)
    assert first.value == pytest.approx(0.962, abs=0.005)
    assert second.value == pytest.approx(1.042, abs=0.005)
    for point in curve.points:
        if point.event == "" and min(abs(point.value - event.value) for event in (first, second)) > 1e-4:
            between = first.value < point.value < second.value
            assert point.stability.kind == (PERIOD_DOUBLING if between else "stable")
    for omega, doubled in ((0.95, False), (1.02, True), (1.035, True), (1.05, False)):
        period_map = oscillator_map(200, omega, **IMPACTS)
        near = min(curve.points, key=lambda point: abs(point.value - omega))
        orbit = shoot(period_map, near.x)
        x = settled(period_map, orbit.x + 1.0e-3, 500)
        assert (np.linalg.norm(x - orbit.x) > 0.1) == doubled
        assert (np.linalg.norm(period_map.after(x) - x) > 0.1) == doubled
        both = period_map.over(2)
        twice = shoot(both, x)
        assert twice.x == pytest.approx(x, abs=1e-6)
        assert both.stability(twice.monodromy).stable


def test_a_curve_that_ends_says_why() -> None:
    """A limit of points ends the curve before the range does."""
    curve = follow(
        lambda omega: oscillator_map(60, omega, gap=100.0), 0.9, np.zeros(2), CurveSettings(0.5, 1.6, max_points=3)
    )
    assert len(curve.points) == 7
    assert curve.endings == ("3 points, the largest number",) * 2


def two_sided_map(omega: float, steps: int = 200) -> ModalMap:
    """The period map of x'' + 0.04 x' + x + 10 <x - 0.5> - 10 <-x - 0.5> = cos(omega t)."""
    system = stopped_oscillator(1.0, 1.0, 0.5, 0.02, lambda t: cos(omega * t), other=0.5)
    modal = modal_system(system)
    assert modal is not None
    return ModalMap(modal, kelvin_voigt(10.0), scheme_of("discrete-gradient"), 2.0 * pi / omega / steps, steps)


def marched(omega: float, x: np.ndarray | None = None) -> np.ndarray:
    """The state after a march from rest, or from a state."""
    return settled(two_sided_map(omega), np.zeros(2) if x is None else x)


@cache
def two_sided_branches() -> Branches:
    return follow_branches(two_sided_map, 1.15, marched(1.15), CurveSettings(0.65, 2.2), marched)


def test_grazing_is_where_the_linear_response_fills_the_gap() -> None:
    """The amplitude F / sqrt((1 - w^2)^2 + (2 zeta w)^2) of a linear response is the gap there."""
    zeta, gap, force = 0.05, 1.0, 0.2
    start = np.zeros(2)
    curve = follow(lambda w: oscillator_map(400, w, zeta, gap, 2.0, force), 1.4, start, CurveSettings(1.05, 1.45))
    (grazing,) = (event for event in curve.events if event.event == GRAZING)
    omega = brentq(lambda w: force / sqrt((1.0 - w**2) ** 2 + (2.0 * zeta * w) ** 2) - gap, 1.0, 1.4)
    assert grazing.value == pytest.approx(omega, rel=1e-3)


@pytest.mark.slow(minutes=0.5)
def test_symmetric_responses_lose_their_symmetry_at_pitchforks() -> None:
    """Between two stops alike, marches settle on a symmetric response outside of the pitchforks, and on none inside.

    The multiplier at a pitchfork is +1, and the branch that leaves it mirrors itself where it ends.
    """
    found = two_sided_branches()
    symmetric = found.curves[0]
    assert symmetric.symmetric
    forks = [event for event in symmetric.events if event.event == PITCHFORK]
    assert len(forks) == 2
    for fork in forks:
        assert fork.stability.distance(1.0) < 1e-2
    upper = max(fork.value for fork in forks)
    for omega, mirrored in ((upper - 0.02, False), (upper + 0.02, True)):
        near = min(symmetric.points, key=lambda point: abs(point.value - omega))
        x = settled(two_sided_map(omega), shoot(two_sided_map(omega), near.x).x + 1.0e-3, 600)
        places = two_sided_map(omega).history(x)[0][:, 0]
        assert (abs(places.max() + places.min()) < 1e-3 * np.ptp(places)) == mirrored
    (broken,) = (curve for curve in found.curves if not curve.symmetric)
    ends = sorted(point.value for point in (broken.points[0], broken.points[-1]))
    assert ends == pytest.approx(sorted(fork.value for fork in forks), abs=2e-3)


@pytest.mark.parametrize("other", [None, 0.45, 0.5])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_responses_that_touch_nothing_say_nothing_of_the_symmetry(other: float | None, size: float) -> None:
    """A curve from a linear response, behind grazing, has the motions that marches settle on.

    Before a single stop it was that of two stops alike: half of the force at the end of the range.
    """

    def map_at(omega: float) -> ModalMap:
        second = None if other is None else other * size
        system = stopped_oscillator(1.0, 1.0, 0.5 * size, 0.1, lambda t: 0.2 * size * cos(omega * t), other=second)
        modal = modal_system(system)
        assert modal is not None
        return ModalMap(modal, kelvin_voigt(10.0), scheme_of("discrete-gradient"), 2.0 * pi / omega / 200, 200)

    start = settled(map_at(0.5), np.zeros(2))
    assert np.all(map_at(0.5).reach(start) < 0.0)
    found = follow_branches(map_at, 0.5, start, CurveSettings(0.5, 0.95), lambda w: settled(map_at(w), np.zeros(2)))
    assert [curve.symmetric for curve in found.curves] == [other == 0.5]
    last = max(found.curves[0].points, key=lambda point: point.value)
    places, forces = map_at(last.value).history(last.x)
    true, pressed = map_at(last.value).history(settled(map_at(last.value), np.zeros(2)))
    assert pressed.max() > 0.0
    assert [places.min(), places.max()] == pytest.approx([true.min(), true.max()], rel=1e-4)
    assert forces.max(axis=0) == pytest.approx(pressed.max(axis=0), rel=1e-3)


@pytest.mark.slow(minutes=0.5)
def test_no_response_is_followed_twice() -> None:
    """No inner point of a branch, nor its mirror image, lies on another branch; both ends of the range are marched."""
    found = two_sided_branches()
    assert found.missing == ()
    responses = [point for curve in found.curves for point in curve.points]
    for end in (0.65, 2.2):
        x = shoot(two_sided_map(end), marched(end)).x
        assert any(point.value == end and point.x == pytest.approx(x, abs=1e-6) for point in responses)
    for curve in found.curves:
        for point in curve.points[3:-3:5]:
            half = two_sided_map(point.value).part(2)
            assert half is not None
            for other in found.curves:
                same = [
                    shoot(two_sided_map(point.value), first.x + share * (last.x - first.x)).x
                    for first, last in pairwise(other.points)
                    if min(first.value, last.value) < point.value < max(first.value, last.value)
                    for share in [(point.value - first.value) / (last.value - first.value)]
                ]
                alike = [
                    x for x in same for image in (point.x, -half.after(point.x)) if x == pytest.approx(image, abs=1e-5)
                ]
                assert len(alike) <= (2 if curve.symmetric else 1) * (other is curve)


def linear_map(omega: float, without: tuple[float, float]) -> ModalMap:
    """A linear oscillator that refuses an interval of frequencies, as a map that chatters there does."""
    if without[0] < omega < without[1]:
        raise NotConverged("no step converges here")
    return oscillator_map(200, omega, 0.05, gap=100.0)


def test_a_second_branch_starts_where_the_first_does_not_get() -> None:
    """Where no response can be followed from 0.7 to 0.75, both sides are, and the interval between them is named."""
    settings, without = CurveSettings(0.5, 1.6), (0.7, 0.75)
    found = follow_branches(lambda w: linear_map(w, without), 0.9, np.zeros(2), settings, lambda _: np.zeros(2))
    assert len(found.curves) == 2
    spans = [sorted(point.value for point in curve.points) for curve in found.curves]
    assert (spans[0][-1], spans[1][0]) == (1.6, 0.5)
    (low, high, reason), *others = found.missing
    assert not others
    assert low == spans[1][-1] == pytest.approx(0.7, abs=1e-3)
    assert high == spans[0][0] == pytest.approx(0.75, abs=1e-3)
    assert "from both sides" in reason


def test_an_end_of_the_range_without_a_response_is_named() -> None:
    """From 0.7 down nothing converges: the interval down to the end of the range is missing."""
    found = follow_branches(
        lambda w: linear_map(w, (0.0, 0.7)), 0.9, np.zeros(2), CurveSettings(0.5, 1.6), lambda _: np.zeros(2)
    )
    assert len(found.curves) == 1
    assert [gap[:2] for gap in found.missing] == [(0.5, pytest.approx(0.7, abs=1e-3))]


def test_a_curve_that_is_covered_has_no_gaps() -> None:
    """A curve that ends at both ends of the range, or turns back at a fold, misses nothing."""
    found = follow_branches(
        lambda w: linear_map(w, (0.0, 0.0)), 0.9, np.zeros(2), CurveSettings(0.5, 1.6), lambda _: np.zeros(2)
    )
    assert (len(found.curves), found.missing) == (1, ())


def test_amplitude_of_the_force() -> None:
    """In the amplitude of the force a linear response grows in proportion."""
    curve = follow(lambda force: oscillator_map(80, force=force, gap=100.0), 1.0, np.zeros(2), CurveSettings(0.5, 2.0))
    shares = np.array([physical(oscillator_map(80), point.x) / point.value for point in curve.points])
    assert shares == pytest.approx(np.broadcast_to(shares[0], shares.shape), rel=1e-6)
    assert 2.0 * pi / 0.8 == pytest.approx(oscillator_map(80).period)
