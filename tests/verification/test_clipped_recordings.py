"""Recordings that are clipped are warned of, with the share of their samples: against a sine in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gapbeam as gb


def words(values: np.ndarray, caplog: Any) -> str:
    """Return the warnings of a recording."""
    caplog.clear()
    gb.Recording(np.arange(len(values)) / 1000.0, values, "velocity")
    return str(caplog.text)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("bits", [None, 8, 16])
@pytest.mark.parametrize("level", [0.5, 0.9])
@pytest.mark.parametrize("ends", [(-1, 1), (0, 1), (-1, 0)])
def test_clipped_sines_are_warned_of(
    ends: tuple[int, int], level: float, bits: int | None, size: float, caplog: Any
) -> None:
    """Of the samples of a sine, acos(level) / pi lie above a level; whole sines, rounded or not, have no warning."""
    y = np.sin(0.1234 * np.arange(20_000)) * (1.0 + 0.02 * np.random.default_rng(0).standard_normal(20_000))
    if bits is not None:
        y = np.round(y * 2 ** (bits - 1)) / 2 ** (bits - 1)
    assert not words(size * y, caplog)
    low, high = (level if one else 9.0 for one in ends)
    said = words(size * np.clip(y, -low, high), caplog)
    assert ("least value" in said, "largest value" in said) == (bool(ends[0]), bool(ends[1]))
    share = float(said.split(" %")[0].rsplit(" ", 1)[1]) / 100.0
    assert share == pytest.approx(np.arccos(level) / np.pi, rel=0.1)
