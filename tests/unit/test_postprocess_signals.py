"""Signals, peaks and smoothing: answers known in closed form, and laws of scaling and shift."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.signals.signal import (
    Signal,
    SignalError,
    SignalWarning,
    peaks,
    peaks_per_period,
    probe_signal,
    unit_of_time,
)
from gapbeam.postprocess.signals.spectra import moving_average, resample, smooth
from tests.unit.test_postprocess_synthetic import write_results

FORCING = 20.0


def sampled(function, rate: float = 2000.0, end: float = 1.0, width: float = 0.0) -> Signal:
    time = np.arange(round(end * rate) + 1) / rate
    return Signal(time, function(time), "m/s^2", "acceleration", width)


def steps(function_integral, rate: float, end: float = 1.0) -> Signal:
    """Interval means of a function, from its integral: as the solver records accelerations."""
    edges = np.arange(round(end * rate) + 1) / rate
    means = np.diff(function_integral(edges)) * rate
    return Signal(0.5 * (edges[1:] + edges[:-1]), means, "m/s^2", "acceleration", 1.0 / rate)


def test_not_finite_values_are_refused_with_their_time() -> None:
    values = np.ones(10)
    values[7] = np.nan
    with pytest.raises(SignalError, match=r"1 of 10 values are not finite, the first at t = 0\.7 s"):
        Signal(np.arange(10) / 10, values, "m", "displacement")


def test_interval_means_are_placed_at_the_middle_of_their_interval(tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.1, 11)
    folder = write_results(tmp_path, time, {"acceleration_absolute": time, "displacement": time})
    history = open_results(folder).history
    acceleration = probe_signal(history, "acceleration_absolute")
    assert acceleration.width == pytest.approx(0.01)
    np.testing.assert_allclose(acceleration.time, time[1:] - 0.005)
    np.testing.assert_array_equal(acceleration.values, time[1:])
    displacement = probe_signal(history, "displacement")
    assert displacement.width == 0.0
    np.testing.assert_array_equal(displacement.time, time)


def test_unknown_names_are_answered_with_the_known_ones(tmp_path: Path) -> None:
    history = open_results(write_results(tmp_path, np.linspace(0, 1, 5), probes=("a", "b"))).history
    with pytest.raises(SignalError, match=r"no probe named 'c'; there are a, b"):
        probe_signal(history, "displacement", "c")
    with pytest.raises(SignalError, match=r"no component 'z'; there are x, y"):
        probe_signal(history, "displacement", component="z")


def test_peaks_of_a_sine_with_offset() -> None:
    found = peaks(sampled(lambda t: 0.5 + 2.0 * np.sin(2 * np.pi * 5.0 * t)))
    assert found.maximum == pytest.approx(2.5)
    assert found.minimum == pytest.approx(-1.5)
    assert found.peak_to_peak == pytest.approx(4.0)
    assert found.time_of_maximum % 0.2 == pytest.approx(0.05)
    assert found.time_of_minimum % 0.2 == pytest.approx(0.15)


def test_peaks_per_period_follow_an_amplitude_that_grows_by_period() -> None:
    signal = sampled(lambda t: (1 + np.floor(FORCING * t + 1e-9)) * np.sin(2 * np.pi * FORCING * t))
    found = peaks_per_period(signal, FORCING)
    np.testing.assert_array_equal(found.period, np.arange(20))
    np.testing.assert_allclose(found.maximum, np.arange(1, 21))
    np.testing.assert_allclose(found.minimum, -np.arange(1, 21))


def test_periods_that_are_cut_are_left_out() -> None:
    found = peaks_per_period(sampled(np.sin, end=0.99).between(0.013, np.inf), FORCING)
    np.testing.assert_array_equal(found.period, np.arange(1, 19))


@settings(deadline=None, max_examples=30)
@given(
    scale=st.floats(1e-3, 1e3),
    offset=st.floats(-1e3, 1e3),
    values=st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=60),
)
def test_peaks_scale_and_shift_with_the_signal(scale: float, offset: float, values: list[float]) -> None:
    time, array = np.arange(len(values)) * 0.01, np.array(values)
    plain = peaks(Signal(time, array, "m", "x"))
    moved = peaks(Signal(time, scale * array + offset, "m", "x"))
    assert moved.maximum == pytest.approx(scale * plain.maximum + offset)
    assert moved.minimum == pytest.approx(scale * plain.minimum + offset)
    turned = peaks(Signal(time, -array, "m", "x"))
    assert (turned.maximum, turned.minimum) == (-plain.minimum, -plain.maximum)


@pytest.mark.parametrize("points", [1, 2, 5, 8])
@pytest.mark.parametrize("frequency", [20.0, 130.0, 400.0, 777.0, 950.0])
def test_moving_average_has_the_gain_of_its_transfer_function(points: int, frequency: float) -> None:
    """Source: Smith, The Scientist and Engineer's Guide to Digital Signal Processing (1997), Eq. 15-2."""
    rate = 2000.0
    signal = sampled(lambda t: np.sin(2 * np.pi * frequency * t), rate)
    averaged = moving_average(signal, points)
    gain = np.sin(points * np.pi * frequency / rate) / (points * np.sin(np.pi * frequency / rate))
    np.testing.assert_allclose(averaged.values, gain * np.sin(2 * np.pi * frequency * averaged.time), atol=1e-11)


def test_mean_resampling_of_interval_means_is_exact_for_any_rate() -> None:
    omega = 2 * np.pi * 37.0
    integral = lambda t: -np.cos(omega * t) / omega  # noqa: E731
    sampled_down = resample(steps(integral, 20_000.0), 2000.0, "mean")
    edges = np.arange(2001) / 2000.0
    np.testing.assert_allclose(sampled_down.values, np.diff(integral(edges)) * 2000.0, atol=1e-10)
    np.testing.assert_allclose(sampled_down.time, edges[:-1] + 0.25e-3)


def test_smoothing_by_means_is_the_mean_over_points_over_rate() -> None:
    omega = 2 * np.pi * 60.0
    integral = lambda t: -np.cos(omega * t) / omega  # noqa: E731
    smoothed = smooth(steps(integral, 10_000.0), 2000.0, 5, "mean")
    assert smoothed.width == pytest.approx(2.5e-3)
    expected = (integral(smoothed.time + 1.25e-3) - integral(smoothed.time - 1.25e-3)) / 2.5e-3
    np.testing.assert_allclose(smoothed.values, expected, atol=1e-10)


def test_mean_resampling_of_instants_is_exact_for_lines() -> None:
    line = resample(sampled(lambda t: 3.0 * t - 1.0, 7000.0), 2000.0, "mean")
    np.testing.assert_allclose(line.values, 3.0 * line.time - 1.0, atol=1e-12)


def test_picking_takes_the_recorded_values() -> None:
    signal = sampled(np.cos, 10_000.0)
    picked = resample(signal, 2000.0, "pick")
    np.testing.assert_allclose(picked.values, signal.values[::5])


def test_picking_a_signal_with_content_above_half_the_rate_warns() -> None:
    signal = sampled(lambda t: np.sin(2 * np.pi * 20 * t) + np.sin(2 * np.pi * 1900 * t), 10_000.0)
    with pytest.warns(SignalWarning, match=r"71 % of the rms lie above 1000 Hz"):
        resample(signal, 2000.0, "pick")


def test_a_rate_above_the_record_is_refused() -> None:
    with pytest.raises(SignalError, match=r"recorded at 1000 Hz, it cannot be sampled at 2000 Hz"):
        smooth(sampled(np.sin, 1000.0), 2000.0)


@settings(deadline=None, max_examples=20)
@given(
    values=st.lists(st.floats(-1e3, 1e3), min_size=60, max_size=120),
    scale=st.floats(-1e3, 1e3),
    offset=st.floats(-1e3, 1e3),
    points=st.integers(1, 7),
)
def test_smoothing_is_linear_and_keeps_constants(values: list[float], scale: float, offset: float, points: int) -> None:
    time, array = np.arange(len(values)) / 1e4, np.array(values)
    plain = smooth(Signal(time, array, "m", "x"), 2000.0, points)
    moved = smooth(Signal(time, scale * array + offset, "m", "x"), 2000.0, points)
    np.testing.assert_allclose(moved.values, scale * plain.values + offset, rtol=1e-9, atol=1e-6)
    assert plain.values.max() <= array.max() + 1e-9
    assert plain.values.min() >= array.min() - 1e-9


@pytest.mark.parametrize(("end", "unit"), [(1500.0, "s"), (0.5, "ms"), (2e-5, "µs")])
def test_enlarged_parts_have_a_unit_in_which_their_times_can_be_read(end: float, unit: str) -> None:
    """At any size the last time lies between 10 and 10 000 units."""
    name, scale = unit_of_time((0.9 * end, end))
    assert name == unit
    assert 10.0 <= scale * end < 1e4
