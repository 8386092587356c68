"""Random loads of one kind are computed together: the same values as one by one."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.loads.random_function import RandomSignal, SharedNoise, filter_length, sample_rate
from gapbeam.solver.loads.random_spectra import PowerSpectrum
from gapbeam.solver.system.operators import Array, Load, factor_rows_of

LOW = PowerSpectrum((5.0, 60.0), (1.0, 1.0))
HIGH = PowerSpectrum((5.0, 80.0), (1.0, 2.0))


def loads() -> list[Load]:
    """Return loads of two kinds of noise among others, one of which shares noise, one of which begins slowly."""
    shared = SharedNoise(7, (5.0, 60.0), (0.5, 0.5), (0.0, 0.0), 0.01)
    signals = [
        RandomSignal(LOW, 1, "one", 0.0),
        RandomSignal(HIGH, 1, "other", 0.0),
        RandomSignal(LOW, 2, "two", 0.0, shared),
        RandomSignal(LOW, 1, "slow", 2.0),
        RandomSignal(LOW, 3, "three", 0.0),
    ]
    noises = [Load(one.name, np.zeros(1), one.value, of_arrays=True, signal=one) for one in signals]
    return [Load("weight", np.zeros(1), lambda _: 1.0, static=True), *noises]


@pytest.mark.parametrize("count", [0, 1, 5, 20_000])
def test_noise_of_one_kind_is_computed_together(count: int) -> None:
    block = filter_length(LOW) / sample_rate(LOW)
    times: Array = np.asarray(0.9 * block + np.linspace(0.0, 0.2 * block, count))
    acting = loads()
    rows = factor_rows_of(acting, times)
    assert rows.shape == (count, len(acting))
    for place, load in enumerate(acting):
        np.testing.assert_allclose(rows[:, place], load.factors(times), rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(rows[:9, place], [load.factor(float(time)) for time in times[:9]], atol=1e-13)


def test_noise_has_the_same_bits_in_blocks_of_any_length() -> None:
    """A run that is resumed asks for it in other blocks."""
    block = filter_length(LOW) / sample_rate(LOW)
    times: Array = np.asarray(0.9 * block + np.linspace(0.0, 0.2 * block, 600))
    acting = loads()
    rows = factor_rows_of(acting, times)
    for first, last in ((0, 1), (3, 10), (17, 33), (40, 599), (599, 600)):
        assert np.array_equal(factor_rows_of(acting, times[first:last]), rows[first:last])
