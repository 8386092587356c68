"""Lengths and frequencies in sentences: in units that follow their size, and the same values."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.postprocess.display_units import POWERS, in_percent, words_by_size


@pytest.mark.parametrize("unit", ["m", "Hz"])
@pytest.mark.parametrize("power", range(-9, 10))
@pytest.mark.parametrize("form", ["h = {} ", "cantilever of {} ", "({} ", "{} "])
def test_values_keep_their_size_and_are_read_at_a_glance(unit: str, power: int, form: str) -> None:
    """The number times its unit is the value; at most six places, without a power of ten where a prefix is known."""
    for value in 10.0**power * np.random.default_rng(power + 9).uniform(1.0, 10.0, 5):
        before = form.format(f"{value:.4g}") + unit
        number, shown = words_by_size(before).removeprefix(form.split("{")[0]).split()
        assert shown.endswith(unit)
        factor = POWERS[shown.removesuffix(unit).replace("u", "µ")]
        assert float(number) == pytest.approx(factor * value, rel=1e-3)
        if (unit == "m" and power < 3) or (unit == "Hz" and -3 <= power < 9):
            assert "e" not in number
            assert len(number) <= 8


@pytest.mark.parametrize(
    "text", ["rigid beam on 1e+03 N/m", "3.57e+14 Pa/m", "10 um^2 on base, gland", "0.001 m^2", "2e-05 m/s", "8 mm"]
)
def test_other_units_stay(text: str) -> None:
    """Units that begin with m are others."""
    assert words_by_size(text) == text


def test_fractions_have_two_digits_and_large_ones_all_before_the_point() -> None:
    """Not 1e+02 %, as the general format has it."""
    assert [in_percent(one) for one in (0.01234, 0.994, 0.998, 2.141)] == ["1.2 %", "99 %", "100 %", "214 %"]
