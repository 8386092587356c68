"""Springs that laws of case files bring: their three functions against each other, also where round-off rules."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.contact.laws.own_spring import Function, check_spring
from gapbeam.solver.messages.errors import UserError

K, SCALE = 1.0e12, 1.0e-3


def sinh(pressure: float = 1.0, slope: float = 1.0, potential: float = 1.0) -> tuple[Function, Function, Function]:
    """A sinh, whose potential K s^2 (cosh(d / s) - 1) has no digits at small d; factors make it wrong."""
    return (
        lambda d: pressure * K * SCALE * np.sinh(d / SCALE),
        lambda d: slope * K * np.cosh(d / SCALE),
        lambda d: potential * K * SCALE**2 * (np.cosh(d / SCALE) - 1.0),
    )


@pytest.mark.parametrize("depth", [1e-11, 1e-8, 1e-6])
def test_a_potential_that_loses_its_digits_is_accepted(depth: float) -> None:
    check_spring("sinh", depth, *sinh())


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
        check_spring("sinh", 1e-6, *sinh(**factors))


WRONG: dict[str, tuple[Function, Function, Function]] = {
    "not the integral of the pressure": (lambda d: d, np.ones_like, lambda d: d**2),
    "not the derivative of the pressure": (lambda d: d**2, lambda d: d, lambda d: d**3 / 3.0),
    "falls": (lambda d: -d, lambda d: -np.ones_like(d), lambda d: -0.5 * d**2),
    "at touch": (lambda d: 1.0 + d, np.ones_like, lambda d: d + 0.5 * d**2),
}


@pytest.mark.parametrize("found", WRONG)
@pytest.mark.parametrize("size", [2.0**-40, 1.0, 2.0**20])
def test_they_are_refused_at_every_size(found: str, size: float) -> None:
    """A potential or a slope of another spring, a pressure that falls or jumps."""
    pressure, slope, potential = WRONG[found]
    functions = lambda d: pressure(d / size), lambda d: slope(d / size) / size, lambda d: size * potential(d / size)
    with pytest.raises(UserError, match=f"the law wrong: found .*{found}"):
        check_spring("wrong", size, *functions)


def test_a_kink_between_two_nodes_is_no_fault() -> None:
    """A bumper of two slopes."""
    kink, first, second = 3.3e-6, 1.0e9, 2.0e10
    check_spring(
        "bumper",
        1e-6,
        lambda d: np.where(d < kink, first * d, first * kink + second * (d - kink)),
        lambda d: np.where(d < kink, first, second),
        lambda d: np.where(
            d < kink,
            0.5 * first * d * d,
            0.5 * first * kink**2 + first * kink * (d - kink) + 0.5 * second * (d - kink) ** 2,
        ),
    )
