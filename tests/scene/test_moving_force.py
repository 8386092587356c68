"""A force that moves along a beam, against the series of Fryba."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.system.operators import Array

LENGTH, SPEED, WHEEL = 10.0, 30.0, 1000.0  # m, m/s, N
SECTION = gb.section("rectangle", 0.1)._replace(shear_area=float("inf"))  # Euler and Bernoulli
STEEL = gb.material(2.1e11, 7850.0)


def series(t: Array, x: float) -> Array:
    """Return the displacement of a simply supported beam while the force is on it.

    Source: Fryba (1999), Vibration of Solids and Structures under Moving Loads, 3rd ed., eq. 1.31 without damping.
    """
    mass, bending = STEEL.density * SECTION.area, STEEL.young_modulus * SECTION.second_moment
    found = np.zeros(len(t))
    for n in range(1, 60):
        k = n * np.pi / LENGTH
        w, turn = k * k * np.sqrt(bending / mass), k * SPEED
        found += np.sin(k * x) * (np.sin(turn * t) - turn / w * np.sin(w * t)) / (w * w - turn * turn)
    return np.asarray(2.0 * WHEEL / (mass * LENGTH) * found)


def driven(count: int, force: Any = WHEEL, position: Any = SPEED) -> gb.History:
    """March a beam with so many points along it."""
    x = np.linspace(0.0, LENGTH, count)
    points = {f"p{i}": float(at) for i, at in enumerate(x)} | {"middle": 0.4 * LENGTH}
    beam = gb.beam(LENGTH, SECTION, STEEL, points, pinned=[0.0, LENGTH], elements=60, modes=20)
    wheel = gb.moving_force([beam[f"p{i}"] for i in range(count)], x, force, position, name="wheel")
    return gb.history(gb.Scene(beam, loads=wheel), 1e-4, 0.4)


def test_a_wheel_crosses_a_bridge() -> None:
    """0.05 % with 21 points, and an error that falls faster than the third power of their distance."""
    errors = []
    for count in (6, 11, 21):
        found = driven(count)
        on = found.t <= LENGTH / SPEED
        wanted = series(found.t[on], 0.4 * LENGTH)
        errors.append(np.abs(found.displacement["middle"][on] - wanted).max() / np.abs(wanted).max())
    assert errors[2] < 5e-4, errors
    assert errors[1] < errors[0] / 8.0
    assert abs(found.last.balance) < 1e-12 * found.last.energy["kinetic"]


def test_force_and_position_may_be_functions() -> None:
    """The same way by a function; half the force moves half as far; behind the end the beam is free."""
    one = driven(11)
    two = driven(11, lambda t: 0.5 * WHEEL + 0.0 * t, lambda t: SPEED * t)
    assert np.abs(2.0 * two.displacement["middle"] - one.displacement["middle"]).max() < 1e-12
    still = driven(11, position=lambda t: -1.0 - t)
    assert np.abs(still.displacement["middle"]).max() == 0.0


@pytest.mark.parametrize(
    ("places", "words"),
    [([0.0], "a place for each"), ([0.0, 0.0], "beyond the one before"), ([1.0, "a"], "real numbers")],
)
def test_nonsense_is_refused(places: Any, words: str) -> None:
    beam = gb.beam(1.0, SECTION, STEEL, {"a": 0.0, "b": 1.0})
    with pytest.raises(gb.UserError, match=words):
        gb.moving_force([beam["a"], beam["b"]], places, 1.0, 1.0)
