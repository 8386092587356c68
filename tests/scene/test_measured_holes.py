"""Holes of measured radii: motions in them are those in the curve that was measured, at any number of angles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam as gb

STIFF, SPRING, MASS = 2e5, 90.0, 0.2


def curve(angle: Any, size: float) -> Any:
    return size * (1.0 + 0.1 * np.cos(2.0 * angle) + 0.05 * np.sin(3.0 * angle))


def scene(region: Any, size: float, friction: float = 0.0) -> gb.Scene:
    ball = gb.mass(MASS, 2, SPRING)
    hole = gb.Contact(ball["at"], region, gb.KelvinVoigt(STIFF), name="hole", friction=friction)
    push = gb.Force(ball["at"], lambda t: 400.0 * size * np.sin(30.0 * t), direction=[0.9, 0.5], name="push")
    return gb.Scene(ball, contacts=[hole], loads=[push])


def radii(count: int, size: float) -> Any:
    return curve(2.0 * np.pi * np.arange(count) / count, size)


@pytest.mark.parametrize("size", [1e-6, 2e-4, 3.0])
@pytest.mark.parametrize(("count", "share"), [(16, 0.1), (48, 5e-3), (360, 3e-5)])
def test_a_mass_moves_as_in_the_curve(count: int, share: float, size: float) -> None:
    """Four impacts against an adaptive integration with a distance that grows by 1 m per m across the curve."""
    span = 0.2

    def deep(x: Any, y: Any) -> Any:
        angle = np.arctan2(y, x)
        slope, there = size * (-0.2 * np.sin(2.0 * angle) + 0.15 * np.cos(3.0 * angle)), curve(angle, size)
        return np.maximum((np.hypot(x, y) - there) / np.hypot(1.0, slope / there), 0.0)

    def rate(t: float, y: Any) -> Any:
        e = 1e-6 * size
        sides = deep(y[0] + e * np.array([1.0, -1.0, 0.0, 0.0]), y[1] + e * np.array([0.0, 0.0, 1.0, -1.0]))
        pushed = STIFF * deep(*y[:2]) * np.array([sides[0] - sides[1], sides[2] - sides[3]]) / (2.0 * e)
        force = 400.0 * size * np.sin(30.0 * t) * np.array([0.9, 0.5]) - SPRING * y[:2] - pushed
        return [*y[2:], *(force / MASS)]

    exact = solve_ivp(rate, (0.0, span), np.zeros(4), rtol=1e-9, atol=1e-12 * size, t_eval=[span], max_step=1e-3)
    found = gb.history(scene(gb.Polar(radii(count, size)), size), 1e-5, span)
    assert np.abs(found.displacement["at"][-1] - exact.y[:2, -1]).max() < share * size
    assert abs(found.last.balance) < 1e-10 * STIFF * size**2


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("step", [1e-3, 1e-4])
@pytest.mark.parametrize("count", [3, 5, 8, 48])
def test_a_march_passes_every_angle(count: int, step: float, friction: float) -> None:
    """Straight lines between radii had corners, at which normals jump: no step was small enough."""
    found = gb.history(scene(gb.Polar(radii(count, 2e-4)), 2e-4, friction), step, 0.6)
    assert np.abs(found.force["hole"]).max() > 0.0


def test_equal_radii_are_a_disc() -> None:
    ends = [
        gb.history(scene(one, 2e-4, 0.2), 1e-4, 0.5).displacement["at"][-1]
        for one in (gb.Polar(np.full(7, 2e-4)), gb.Disc(2e-4))
    ]
    assert ends[0] == pytest.approx(ends[1], rel=1e-5, abs=1e-9 * 2e-4)


def test_radii_that_make_no_hole_are_refused() -> None:
    with pytest.raises(gb.UserError, match="reaches the middle"):
        gb.Polar([1e-3, 1e-6, 1e-6, 1e-3, 1e-6, 1e-6])
