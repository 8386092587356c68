"""A solid cylinder in a round hole: the series against Persson, finite elements against the series."""

from __future__ import annotations

from math import log, pi, sqrt, tan

import pytest

from benchmarks.conformal_contact import ELASTIC, RADIUS, RIGID, STIFFNESS, YOUNG, by_series, pressed_disc

SOFTNESS = YOUNG / (STIFFNESS * RADIUS)


@pytest.mark.parametrize("angle", [0.4, 1.3])
def test_the_series_is_perssons_solution(angle: float) -> None:
    """Disc and plate of one material: peak pressure to 1e-4, half the contact angle to half a cell and a little."""
    b = tan(0.5 * angle)
    root, width = sqrt(1.0 + b * b), b * b * (1.0 + b * b)
    found = by_series(ELASTIC, (2.0 - 2.0 * b**4 - log(1.0 + b * b)) / (pi * width))
    peak = 2.0 / pi * b / root + log((root + b) / (root - b)) / (2.0 * pi * width)
    assert found.peak == pytest.approx(peak, rel=1e-4)
    assert found.angle == pytest.approx(angle, abs=6e-3)


@pytest.mark.slow(minutes=1)
def test_finite_elements_in_a_rigid_hole() -> None:
    """Contact over 37 degrees to each side, 128 points around: peak within 5 %, angle to the distance of points."""
    exact, found = by_series(RIGID, 2.0, SOFTNESS), pressed_disc(8, 0.5)
    assert found.peak == pytest.approx(exact.peak, rel=0.05)
    assert found.angle == pytest.approx(exact.angle, abs=0.05)
