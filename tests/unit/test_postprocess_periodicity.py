"""Period detection: cycles that are there are found, and nothing else is called a cycle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gapbeam.postprocess.signals.periodicity import left_to_change, periodicity, poincare_section
from gapbeam.postprocess.signals.signal import Signal, SignalError

FORCING = 20.0
RATE = 2000.0


def motion(periods: int, function, rate: float = RATE) -> tuple[Signal, Signal]:
    """Displacement and, by a difference over 1e-7 s, velocity."""
    time = np.arange(round(periods / FORCING * rate) + 1) / rate
    speed = (function(time + 1e-7) - function(time - 1e-7)) / 2e-7
    return Signal(time, function(time), "m", "displacement"), Signal(time, speed, "m/s", "velocity")


def cycle(order: int):
    """A function of period `order` forcing periods and no less."""
    return lambda t: (
        np.sin(2 * np.pi * FORCING * t)
        + (0.2 if order > 1 else 0.0) * np.sin(2 * np.pi * FORCING * t / order + 0.4)
        + 0.3 * np.cos(6 * np.pi * FORCING * t)
    )


def logistic(periods: int, rate: float = RATE, coefficient: float = 3.9) -> tuple[Signal, Signal]:
    """A sine whose amplitude in every forcing period is the next value of the chaotic logistic map."""
    size = round(rate / FORCING)
    amplitudes, x = [], 0.3
    for _ in range(periods):
        x = coefficient * x * (1 - x)
        amplitudes.append(x)
    amplitude = np.repeat(amplitudes, size)
    time = np.arange(amplitude.size) / rate
    angle = 2 * np.pi * FORCING * time
    return (
        Signal(time, amplitude * np.sin(angle), "m", "displacement"),
        Signal(time, 2 * np.pi * FORCING * amplitude * np.cos(angle), "m/s", "velocity"),
    )


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5, 7, 12])
def test_period_is_found_exactly(order: int) -> None:
    found = periodicity(motion(60, cycle(order)), FORCING)
    assert found.period == order
    assert found.residual < 1e-6
    assert found.transient == pytest.approx(0.0, abs=1e-6)
    assert found.repeats >= 3
    assert f"period {order}" in found.verdict


def test_period_is_found_with_a_sampling_that_does_not_divide_it() -> None:
    assert periodicity(motion(60, cycle(3), rate=1987.3), FORCING).period == 3


@pytest.mark.parametrize(("periods", "order", "found"), [(11, 3, None), (12, 3, 3), (3, 1, None), (4, 1, 1)])
def test_three_repeats_are_needed(periods: int, order: int, found: int | None) -> None:
    assert periodicity(motion(periods, cycle(order)), FORCING).period == found


def test_a_short_record_is_undecided() -> None:
    found = periodicity(motion(3, cycle(1)), FORCING)
    assert found.verdict.startswith("undecided: 3 forcing periods")


def test_transient_length_follows_from_the_decay() -> None:
    decay = 8.0  # 1/s; the difference of neighboring periods is exp(-8 t) (exp(0.4) - 1) of the amplitude 1
    function = lambda t: np.cos(2 * np.pi * FORCING * t) * (1.0 + np.exp(-decay * t))  # noqa: E731
    displacement, _ = motion(40, function)
    found = periodicity((displacement,), FORCING, tolerance=0.01)
    assert found.period == 1
    # e_j, at the start of the period before: exp(-8 t)(1 - exp(-0.4)) = 0.01 * range 2
    expected = np.log((1 - np.exp(-decay / FORCING)) / 0.02) / decay
    assert found.transient is not None
    assert -1.0 / RATE <= found.transient - expected <= 1.0 / FORCING


def test_slow_decay_is_not_called_settled() -> None:
    """Neighboring periods differ by 0.5 %, less than the tolerance, but all of the motion will still go."""
    found = periodicity(motion(60, lambda t: np.exp(-0.1 * t) * np.sin(2 * np.pi * FORCING * t)), FORCING)
    assert found.period is None
    assert "not settled" in found.verdict
    assert found.remaining == pytest.approx(0.5, rel=0.02)  # the amplitude, as a fraction of the range


def test_growth_is_not_called_periodic() -> None:
    found = periodicity(motion(60, lambda t: np.exp(0.1 * t) * np.sin(2 * np.pi * FORCING * t)), FORCING)
    assert found.period is None


def test_free_vibration_that_dies_out_is_not_periodic() -> None:
    found = periodicity(motion(60, lambda t: np.exp(-2 * t) * np.sin(2 * np.pi * 47.18 * t)), FORCING)
    assert found.period is None


def ringing(amplitude: float, ratio: float, damping: float, phase: float = 0.0):
    """A forced motion of amplitude 1 and free vibration at a multiple of its frequency, which fades."""
    rate = 2 * np.pi * FORCING * ratio
    return lambda t: (
        np.sin(2 * np.pi * FORCING * t) + amplitude * np.exp(-damping * rate * t) * np.sin(rate * t + phase)
    )


@pytest.mark.parametrize(("ratio", "damping"), [(25 / 11, 3e-4), (25.003 / 11, 0.0), (7 / 3, 1e-4), (9 / 4, 1e-3)])
def test_ringing_is_no_cycle_of_many_periods(ratio: float, damping: float) -> None:
    """Free vibration that passes nearly a whole number of its periods in p of the forcing is not settled, not period p.

    A linear system has one response, with the period of its forcing.
    """
    found = periodicity(motion(60, ringing(0.007, ratio, damping)), FORCING)
    assert (found.period, found.word) == (None, "not settled"), found.verdict


@settings(deadline=None, max_examples=60, derandomize=True)
@given(
    amplitude=st.floats(-3.5, 0.3),
    ratio=st.floats(0.5, 15.0),
    damping=st.floats(1e-3, 3e-2),
    phase=st.floats(0.0, 6.0),
    periods=st.integers(12, 120),
)
def test_a_linear_response_has_settled_to_period_one_or_not_at_all(
    amplitude: float, ratio: float, damping: float, phase: float, periods: int
) -> None:
    """Whatever still rings, a forced motion with free vibration that fades has neither a long cycle nor none."""
    found = periodicity(motion(periods, ringing(10**amplitude, ratio, damping, phase)), FORCING)
    assert found.word in {"period 1", "not settled"}, found.verdict


def test_what_never_repeats_has_settled_where_it_neither_fades_nor_grows() -> None:
    """Chaos is a settled motion, in a record long enough to show it; two frequencies that fade or grow are not."""
    chaotic = logistic(200, 400.0)
    assert periodicity(chaotic, FORCING).word == "no cycle"
    short = tuple(Signal(one.time[:400], one.values[:400], one.unit, one.name) for one in chaotic)
    assert periodicity(short, FORCING).word == "not settled"
    for damping in (1e-3, -1e-3):
        assert periodicity(motion(100, ringing(0.3, np.sqrt(2), damping)), FORCING).word == "not settled"


@pytest.mark.parametrize("amplitude", [1e-3, 1e-2])
def test_what_a_quantity_may_still_change_is_reported(amplitude: float) -> None:
    """Free vibration changes the acceleration of a settled motion by up to twice its own amplitude: reported."""
    function = ringing(amplitude, 14.3, 1e-5)
    time = np.arange(round(60 / FORCING * RATE) + 1) / RATE
    acceleration = Signal(time, function(time), "m/s^2", "acceleration")
    left = left_to_change(acceleration, FORCING, 1)
    assert 1.0 * amplitude < left < 3.0 * amplitude
    settled = Signal(time, np.sin(2 * np.pi * FORCING * time), "m/s^2", "acceleration")
    assert left_to_change(settled, FORCING, 1) < 1e-9


def test_two_incommensurate_frequencies_are_not_periodic() -> None:
    function = lambda t: np.sin(2 * np.pi * FORCING * t) + 0.3 * np.sin(2 * np.pi * np.sqrt(2) * FORCING * t)  # noqa: E731
    assert periodicity(motion(100, function), FORCING).period is None


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("coefficient", [3.7, 3.8, 3.9, 3.99, 4.0])
def test_chaos_is_not_periodic_wherever_the_record_ends(coefficient: float) -> None:
    displacement, velocity = logistic(400, 400.0, coefficient)
    size = round(400.0 / FORCING)
    for periods in range(60, 401):
        stop = periods * size
        cut = tuple(Signal(one.time[:stop], one.values[:stop], one.unit, one.name) for one in (displacement, velocity))
        assert periodicity(cut, FORCING).period is None, periods


@pytest.mark.parametrize(("coefficient", "order"), [(2.8, 1), (3.2, 2), (3.5, 4), (3.83, 3)])
def test_the_periodic_windows_of_the_same_map_are_found(coefficient: float, order: int) -> None:
    assert periodicity(logistic(300, 400.0, coefficient), FORCING).period == order


def test_rest_is_periodic_and_noise_of_round_off_does_not_matter() -> None:
    time = np.arange(2001) / RATE
    noise = 1e-17 * np.random.default_rng(1).standard_normal(time.size)
    found = periodicity((Signal(time, 1e-3 + noise, "m", "displacement"),), FORCING)
    assert found.period == 1


def test_noise_below_the_tolerance_is_accepted_and_reported() -> None:
    displacement, _ = motion(60, cycle(2))
    noise = 2e-4 * np.random.default_rng(2).standard_normal(displacement.time.size)
    noisy = Signal(displacement.time, displacement.values + noise, "m", "displacement")
    found = periodicity((noisy,), FORCING)
    assert found.period == 2
    assert 1e-4 < found.residual < 1e-2


def test_coarse_sampling_is_refused() -> None:
    time = np.arange(100) / 50.0
    with pytest.raises(SignalError, match="at least four"):
        periodicity((Signal(time, np.sin(time), "m", "displacement"),), FORCING)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_poincare_section_repeats_after_the_period(order: int) -> None:
    displacement, velocity = motion(24, cycle(order))
    section = poincare_section(displacement, velocity, FORCING)
    assert section.time.size == 25
    np.testing.assert_allclose(section.time, np.arange(25) / FORCING)
    np.testing.assert_allclose(section.displacement[order:], section.displacement[:-order], atol=1e-9)
    np.testing.assert_allclose(section.displacement, cycle(order)(section.time), atol=1e-9)
    distinct = {round(float(u), 6) for u in section.displacement}
    assert len(distinct) == order


@settings(deadline=None, max_examples=15)
@given(scale=st.floats(1e-6, 1e6), offset=st.floats(-10, 10), order=st.integers(1, 6))
def test_verdict_does_not_depend_on_scale_or_offset(scale: float, offset: float, order: int) -> None:
    displacement, velocity = motion(40, cycle(order), rate=400.0)
    moved = (
        Signal(displacement.time, scale * (displacement.values + offset), "m", "displacement"),
        Signal(velocity.time, scale * velocity.values, "m/s", "velocity"),
    )
    assert periodicity(moved, FORCING).period == order
