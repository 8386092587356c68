"""Faults in the functions of own laws and regions: each is named in words before a march, by what it is."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import special

import gapbeam as gb


def linear(x: Any, k: Any) -> Any:
    """Return the force of a linear spring."""
    return k * x


def stored(x: Any, k: Any) -> Any:
    """Return its potential."""
    return 0.5 * k * x * x


def fails(*_: Any) -> Any:
    raise RuntimeError("own")


OTHERS: dict[str, tuple[Callable[..., Any], str]] = {
    "raises": (fails, r"failed \(RuntimeError: own"),
    "an unknown name": (lambda *_: unknown_name, r"failed \(NameError: name 'unknown_name'"),  # type: ignore[name-defined]  # noqa: F821
    "nothing": (lambda *_: None, "returned None, expected a real number"),
    "text": (lambda *_: "1", "returned '1', expected a real number"),
    "an array": (lambda *_: np.ones(1), r"returned array\(\[1.\]\), expected"),
    "complex": (lambda x, *_: x + 1j, "returned .*complex.*, expected a real number"),
    "a truth": (lambda x, *_: x > 0, "returned .*, expected a real number"),
    "two numbers": (lambda x, *_: (x, x), "expected a real number"),
    "an attribute": (lambda x, *_: x.size_of_gap, r"failed \(AttributeError"),
}
NOT_COMPILED: dict[str, dict[str, Callable[..., Any]]] = {
    "cannot be compiled .*erf": {
        "spring": lambda x, k: k * x + 0.0 * special.erf(x),
        "potential": lambda x, k: 0.5 * k * x * x + 0.0 * special.erf(x),
    },
    "returns None in one of its branches": {
        "spring": lambda x, k: k * x if x < 1e20 else None,
        "potential": lambda x, k: 0.5 * k * x * x if x < 1e20 else None,
    },
}


def law_of(part: str, function: Callable[..., Any]) -> None:
    functions = {"spring": linear, "potential": stored, "damper": lambda _n, share, rate, k: 1e-3 * k * share * rate}
    functions[part] = function
    spring = functions.pop("spring")
    block = gb.mass(1.0, stiffness=9.0)
    gb.Contact(block["at"], gb.Slot(0.1), gb.law(**functions)(spring)(k=1e4), name="stop")


@pytest.mark.parametrize("part", ["spring", "potential", "damper"])
@pytest.mark.parametrize("fault", OTHERS)
def test_functions_of_a_law_that_fail_are_named(part: str, fault: str) -> None:
    function, words = OTHERS[fault]
    own = (lambda x, k: function(x, k)) if part == "spring" else function  # a spring names its parameters
    with pytest.raises(gb.UserError, match=f"^law .*: its {part} .*{words}"):
        law_of(part, own)


@pytest.mark.parametrize("part", ["spring", "potential"])
@pytest.mark.parametrize("words", NOT_COMPILED)
def test_functions_of_a_law_that_do_not_compile_are_named(part: str, words: str) -> None:
    """Python runs them; machine code cannot."""
    with pytest.raises(gb.UserError, match=f"^law .*: its {part} {words}"):
        law_of(part, NOT_COMPILED[words][part])


@pytest.mark.parametrize("short", [lambda: 1.0, lambda _: 1.0, lambda _x, _k, _more: 1.0])
def test_a_potential_has_the_arguments_of_its_spring(short: Callable[..., Any]) -> None:
    with pytest.raises(gb.UserError, match=r"its potential failed \(TypeError: .*argument"):
        law_of("potential", short)


def test_a_law_is_made_above_its_spring() -> None:
    """Brackets left out, numbers in place of functions, and a mean that is one number."""
    with pytest.raises(gb.UserError, match="found no spring"):
        gb.law(linear)(k=1.0)
    with pytest.raises(gb.UserError, match="found no spring"):
        gb.law(potential=stored)(3.0)  # type: ignore[arg-type]
    with pytest.raises(gb.UserError, match="potential: found 3"):
        gb.law(potential=3.0)  # type: ignore[arg-type]
    law = gb.law(potential=stored, mean=lambda a, b, k: 0.5 * k * (a + b))(linear)(k=1.0)
    with pytest.raises(gb.UserError, match="its mean returns float64, expected 2 real numbers"):
        gb.Contact(gb.mass(1.0)["at"], gb.Slot(0.1), law)


def contact(distance: Callable[..., Any], bounded: bool = True, **values: float) -> gb.Contact:
    ball = gb.mass(1.0, 2, 9.0)
    region = gb.region(distance, name="own", bounded=bounded)(**values)
    return gb.Contact(ball["at"], region, gb.KelvinVoigt(1e4), name="hole")


@pytest.mark.parametrize("fault", OTHERS)
def test_distances_that_fail_are_named(fault: str) -> None:
    function, words = OTHERS[fault]
    with pytest.raises(gb.UserError, match=f"^contact hole: region own: its distance .*{words}"):
        contact(lambda x, y: function(x, y))


@pytest.mark.parametrize(
    ("distance", "words"),
    [
        (lambda x, y: 1e-3 - math.hypot(x, y), "expected numbers above 0 outside"),
        (lambda x, _: x - 1e-3, "bounded=False for a region without end"),
        (lambda x, y: math.sqrt(x * y - 1.0), r"not finite at \(0, 0\) m"),
        (lambda x, y: x / 0.0 * y, r"not finite at \(0, 0\) m"),
        (lambda x, y: math.hypot(x, y) - 1e-3 + 0.0 * special.erf(x), "cannot be compiled .*erf"),
    ],
    ids=["inside out", "a wall without end", "beyond a root", "divided by 0", "not compiled"],
)
def test_what_is_no_distance_is_refused(distance: Callable[..., Any], words: str) -> None:
    with pytest.raises(gb.UserError, match=f"^contact hole: region own: its distance .*{words}"):
        contact(distance)


@pytest.mark.parametrize("size", [1e-6, 1e-3, 10.0])
def test_a_distance_grows_by_a_meter_per_meter(size: float, caplog: pytest.LogCaptureFixture) -> None:
    """A circle, a square and a wall are quiet at any size; a squared radius and one over its radius warn."""
    quiet = {
        "circle": (lambda x, y, a: math.hypot(x, y) - a, True),
        "square": (lambda x, y, a: max(abs(x), abs(y)) - a, True),
        "wall": (lambda x, y, a: 0.6 * x + 0.8 * y - a, False),
    }
    with caplog.at_level(logging.WARNING, "gapbeam"):
        for distance, bounded in quiet.values():
            contact(distance, bounded, a=size)
        assert not caplog.messages
        contact(lambda x, y, a: x * x + y * y - a * a, a=size)
        contact(lambda x, y, a: math.hypot(x, y) / a - 1.0, a=size)
    for message, slope in zip(caplog.messages, (2.0 * size, 1.0 / size), strict=True):
        assert f"forces there are {slope:.3g} times" in message


@pytest.mark.parametrize(
    "damper",
    [
        lambda _n, share, rate, k: -1e-3 * k * share * rate,
        lambda n, _share, rate, _k: -0.2 * n * rate,
        lambda _n, share, rate, k: 1e-3 * k * share * abs(rate),
        lambda _n, share, rate, k: 1e-3 * k * share * (rate if rate < 5.0 else -rate),
    ],
    ids=["viscous", "of the force", "of the speed alone", "beyond a speed"],
)
def test_a_damper_that_drives_is_refused(damper: Callable[..., Any]) -> None:
    """A damper has the sign of the rate: gates blamed the scheme for the energy of others, and small ones passed."""
    with pytest.raises(gb.UserError, match=r"its damper is .* expected one of the sign of the rate"):
        law_of("damper", damper)


@pytest.mark.parametrize(
    "damper",
    [
        lambda _n, share, rate, k: 1e-3 * k * share * rate,
        lambda n, _share, rate, _k: 0.2 * n * rate,
        lambda n, _share, rate, _k: 0.3 * n * math.tanh(rate),
        lambda _n, share, rate, k: 1e-3 * k * share * max(rate, 0.0),
    ],
    ids=["viscous", "of the force", "bounded", "one way"],
)
def test_dampers_against_the_motion_are_taken(damper: Callable[..., Any]) -> None:
    law_of("damper", damper)
