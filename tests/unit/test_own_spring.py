"""Springs that laws of case files bring: their three functions against each other, also where round-off rules."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.contact.laws.own_spring import OwnSpring
from gapbeam.solver.messages.errors import UserError

K, SCALE = 1.0e12, 1.0e-3


def sinh(pressure: float = 1.0, slope: float = 1.0, potential: float = 1.0) -> OwnSpring:
    """A sinh, whose potential K s^2 (cosh(d / s) - 1) has no digits at small d; factors make it wrong."""
    return OwnSpring(
        lambda d: pressure * K * SCALE * np.sinh(d / SCALE),
        lambda d: slope * K * np.cosh(d / SCALE),
        lambda d: potential * K * SCALE**2 * (np.cosh(d / SCALE) - 1.0),
    )


@pytest.mark.parametrize("depth", [1e-11, 1e-8, 1e-6])
def test_a_potential_that_loses_its_digits_is_accepted(depth: float) -> None:
    sinh().check("sinh", depth)


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ({"potential": 1.001}, "a potential that is not the integral"),
        ({"slope": 0.999}, "a slope that is not the derivative"),
        ({"pressure": -1.0, "slope": -1.0, "potential": -1.0}, "a pressure that falls"),
    ],
)
def test_functions_that_do_not_belong_together_are_refused(factors: dict[str, float], words: str) -> None:
    with pytest.raises(UserError, match=f"law sinh: found {words}"):
        sinh(**factors).check("sinh", 1e-6)


def test_a_kink_between_two_nodes_is_no_fault() -> None:
    """A bumper of two slopes."""
    kink, first, second = 3.3e-6, 1.0e9, 2.0e10
    OwnSpring(
        lambda d: np.where(d < kink, first * d, first * kink + second * (d - kink)),
        lambda d: np.where(d < kink, first, second),
        lambda d: np.where(
            d < kink,
            0.5 * first * d * d,
            0.5 * first * kink**2 + first * kink * (d - kink) + 0.5 * second * (d - kink) ** 2,
        ),
    ).check("bumper", 1e-6)
