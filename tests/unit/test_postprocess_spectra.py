"""Spectra and harmonics of signals whose amplitudes are known."""

from __future__ import annotations

import warnings
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gapbeam.postprocess.signals.signal import Signal, SignalError, SignalWarning
from gapbeam.postprocess.signals.spectra import distortion, harmonics, spectrum

FORCING = 20.0
# order: amplitude, phase
PARTS = {
    Fraction(1, 3): (0.07, 0.3),
    Fraction(1, 2): (0.11, -1.2),
    Fraction(1): (2.0, 0.5),
    Fraction(2): (0.4, 2.9),
    Fraction(3): (0.9, -0.4),
    Fraction(7): (0.05, 1.0),
}


def composed(time: np.ndarray, offset: float = 0.3) -> np.ndarray:
    return offset + sum(
        a * np.sin(2 * np.pi * FORCING * float(order) * time + phase) for order, (a, phase) in PARTS.items()
    )


def signal_of(end: float = 1.5, rate: float = 2000.0, start: float = 0.0) -> Signal:
    time = start + np.arange(round(end * rate) + 1) / rate
    return Signal(time, composed(time), "m", "displacement")


def test_rectangular_window_on_whole_periods_gives_amplitudes_and_phases_to_round_off() -> None:
    lines = spectrum(signal_of(), FORCING)
    assert lines.periods == 24
    assert lines.window == "rectangular"
    assert lines.amplitude[0] == pytest.approx(0.3, abs=1e-12)
    table = {row.order: row for row in harmonics(lines, 10)}
    assert set(table) == {Fraction(1, 3), Fraction(1, 2), *(Fraction(n) for n in range(1, 11))}
    for order, row in table.items():
        amplitude, phase = PARTS.get(order, (0.0, 0.0))
        assert row.amplitude == pytest.approx(amplitude, abs=1e-10)
        assert row.frequency == pytest.approx(float(order) * FORCING)
        if amplitude:
            assert row.phase == pytest.approx(phase, abs=1e-9)


@pytest.mark.parametrize("window", ["rectangular", "hann", "flattop", "blackman"])
def test_every_window_shows_the_amplitude_of_a_sine_on_a_line(window) -> None:
    time = np.arange(3000) / 2000.0
    lines = spectrum(Signal(time, 5.0 + 3.0 * np.sin(2 * np.pi * FORCING * time), "m", "x"), FORCING, window=window)
    assert lines.amplitude.max() == pytest.approx(5.0)
    assert harmonics(lines)[2].amplitude == pytest.approx(3.0, abs=1e-10)


def test_flattop_shows_the_amplitude_between_lines() -> None:
    time = np.arange(4000) / 2000.0
    between = 123.25  # a quarter of a line off at 2 s
    values = 3.0 * np.sin(2 * np.pi * between * time)
    with pytest.warns(SignalWarning, match="no forcing period"):
        lines = spectrum(Signal(time, values, "m", "x"), None, window="flattop")
    assert lines.amplitude.max() == pytest.approx(3.0, rel=2e-3)


@pytest.mark.parametrize(
    ("duration", "expected"), [(3.0, 60), (1.15, 12), (0.6, 12), (0.55, 6), (0.3, 6), (0.2, 4), (0.05, 1)]
)
def test_number_of_periods_is_the_most_of_twelves_then_six_then_all(duration: float, expected: int) -> None:
    time = np.arange(round(duration * 2000)) / 2000
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SignalWarning)
        assert spectrum(Signal(time, composed(time), "m", "x"), FORCING).periods == expected


def test_the_transient_is_left_out_where_the_record_allows() -> None:
    lines = spectrum(signal_of(3.0), FORCING, after=1.3)
    assert lines.periods == 24
    assert lines.start >= 1.3
    with pytest.warns(SignalWarning, match="begin before 1 s"):
        spectrum(signal_of(1.2), FORCING, after=1.0)


def test_lines_between_the_resolution_are_left_out_with_a_warning() -> None:
    with pytest.warns(SignalWarning, match="fall between lines"):
        lines = spectrum(signal_of(), FORCING, periods=4)
    assert [row.order for row in harmonics(lines, 2)] == [Fraction(1, 2), 1, 2]


def test_periods_that_are_no_whole_number_of_intervals_are_resampled_with_a_warning() -> None:
    rate = 1987.3
    time = np.arange(round(1.5 * rate)) / rate
    with pytest.warns(SignalWarning, match="no|interpolated by a cubic spline"):
        lines = spectrum(Signal(time, composed(time), "m", "x"), FORCING)
    for row in harmonics(lines, 3):
        assert row.amplitude == pytest.approx(PARTS[row.order][0], abs=2e-4)


def test_content_near_half_the_sampling_rate_warns() -> None:
    time = np.arange(2400) / 2000.0
    values = np.sin(2 * np.pi * FORCING * time) + 0.05 * np.sin(2 * np.pi * 980.0 * time)
    with pytest.warns(SignalWarning, match=r"near half the sampling rate \(1000 Hz\)"):
        spectrum(Signal(time, values, "m", "x"), FORCING)


def test_too_short_and_too_many_periods_are_refused() -> None:
    time = np.arange(80) / 2000.0
    with pytest.raises(SignalError, match="hold 0 whole forcing periods"):
        spectrum(Signal(time, composed(time), "m", "x"), FORCING)
    with pytest.raises(SignalError, match="asked for 31"):
        spectrum(signal_of(), FORCING, periods=31)


def test_a_line_at_half_the_sampling_rate_is_not_doubled() -> None:
    time = np.arange(100) / 100.0
    values = np.cos(np.pi * np.arange(100))
    with pytest.warns(SignalWarning):
        lines = spectrum(Signal(time, values, "m", "x"), 10.0, periods=10)
    assert lines.amplitude[-1] == pytest.approx(1.0)


def test_a_signal_at_rest_has_no_amplitudes() -> None:
    time = np.arange(2400) / 2000.0
    lines = spectrum(Signal(time, np.full(time.size, 0.2), "m", "x"), FORCING)
    assert lines.amplitude[0] == pytest.approx(0.2)
    np.testing.assert_allclose(lines.amplitude[1:], 0.0, atol=1e-15)


def test_distortion_of_known_harmonics() -> None:
    expected = np.sqrt(0.4**2 + 0.9**2 + 0.05**2) / 2.0
    assert distortion(harmonics(spectrum(signal_of(), FORCING))) == pytest.approx(expected)


@settings(deadline=None, max_examples=25)
@given(
    amplitude=st.floats(1e-6, 1e6),
    phase=st.floats(-3.1, 3.1),
    offset=st.floats(-1e3, 1e3),
    start=st.integers(0, 5000),
    order=st.integers(1, 20),
)
def test_amplitude_and_phase_do_not_depend_on_where_the_record_starts(
    amplitude: float, phase: float, offset: float, start: int, order: int
) -> None:
    time = (start + np.arange(2400)) / 2000.0
    values = amplitude * (offset + np.sin(2 * np.pi * order * FORCING * time + phase))
    lines = spectrum(Signal(time, values, "m", "x"), FORCING)
    row = next(row for row in harmonics(lines, 20) if row.order == order)
    assert row.amplitude == pytest.approx(amplitude, rel=1e-9)
    assert np.angle(np.exp(1j * (row.phase - phase))) == pytest.approx(0.0, abs=1e-8)
