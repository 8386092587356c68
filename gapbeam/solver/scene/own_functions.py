"""Functions that users write for laws and regions, tried before compiled code calls them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numba
import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import printable
from gapbeam.solver.scene.argument_checks import shown
from gapbeam.solver.system.operators import Array

PLACES = 2.0 ** np.arange(-40.0, 41.0, 1.5)
"""Penetrations and distances, m, from less than an atom on: a function has numbers at some of them."""
TURNS = 1.0 + 0.25 * np.pi * np.arange(8.0)
"""Directions, rad, in which a region is looked at: between axes and diagonals, where regions have corners."""
GROWTH = 0.1
"""Part by which the slope of a distance may differ from 1 without a warning."""


def is_own(function: Any) -> bool:
    """Return true for a compiled function that is not of this package."""
    return function is not None and not str(function.py_func.__module__).startswith("gapbeam.")


def tried(function: Any, arguments: Sequence[float], where: str) -> float:
    """Return the answer of a compiled function of the user, called in Python; nan where it is none.

    Args:
        function: The function.
        arguments: Its arguments.
        where: The function in messages.

    Raises:
        UserError: The function fails, or returns something else than a real number.
    """
    try:
        found = function.py_func(*(np.float64(one) for one in arguments))
    except (ArithmeticError, ValueError, IndexError):  # beyond its range: compiled code has no number there either
        return float("nan")
    except Exception as error:
        raise UserError(f"{where} failed ({type(error).__name__}: {error})") from error
    value = found.item() if isinstance(found, np.ndarray | np.generic) and np.ndim(found) == 0 else found
    if not isinstance(value, Real) or isinstance(value, bool):
        raise UserError(f"{where} returned {shown(found)}, expected a real number")
    return float(value)


def check_compiled(function: Any, count: int, where: str, answers: int = 1) -> None:
    """Refuse a function of the user that cannot be compiled, or whose answer is no number.

    Args:
        function: The function, of numba.
        count: Number of its arguments.
        where: The function in messages.
        answers: Number of numbers that it returns.

    Raises:
        UserError: The function cannot be compiled, or returns something else in some of its branches.
    """
    plain = (numba.types.float64,) * count
    try:
        function.compile(plain)
        answer = function.overloads[plain].signature.return_type
    except Exception as error:  # numba also raises what its own passes meet
        lines = [line.strip() for line in str(error).splitlines()]
        reason = next((line for line in lines if line and not line.startswith("Failed in")), type(error).__name__)
        raise UserError(
            f"{where} cannot be compiled ({printable(reason)}); expected numbers, and functions of math and numpy that "
            "numba compiles"
        ) from error
    parts = tuple(answer) if isinstance(answer, numba.types.BaseTuple) else (answer,)
    if len(parts) != answers or not all(isinstance(one, numba.types.Float | numba.types.Integer) for one in parts):
        expected = "a real number" if answers == 1 else f"{answers} real numbers"
        found = "None in one of its branches" if isinstance(answer, numba.types.Optional) else printable(str(answer))
        raise UserError(f"{where} returns {found}, expected {expected}")


def check_distance(distance: Any, values: Sequence[Any], bounded: bool, at: Array, where: str) -> None:
    """Compare a distance of the user with what a distance does: around a place, from near to far.

    It has a number at the place. Far away from a bounded region it is above 0. At its wall it grows by 1 m per m, else
    a warning says by how much more forces are than those of the law.

    Args:
        distance: The function, of numba.
        values: Numbers after x and y; of members of an ensemble those of the first.
        bounded: Whether the region ends in every direction.
        at: The place, (2,), m.
        where: The region in messages.

    Raises:
        UserError: The function fails, has no number there, or is not above 0 far away.
    """
    plain, name = [float(np.ravel(one)[0]) for one in values], f"{where}: its distance"

    def of(places: Array) -> Array:
        return np.array([tried(distance, (*place, *plain), name) for place in places])

    with np.errstate(all="ignore"):
        if not np.isfinite(of(at[None])[0]):
            raise UserError(f"{name} is not finite at ({at[0]:.6g}, {at[1]:.6g}) m, where the contact rests")
        slopes = []
        for way in np.column_stack([np.cos(TURNS), np.sin(TURNS)]):
            there = of(at + PLACES[:, None] * way)
            known = np.flatnonzero(np.isfinite(there))
            if bounded and known.size and there[known[-1]] <= 0.0:
                raise UserError(
                    f"{name} is {there[known[-1]]:.3g} at {PLACES[known[-1]]:.3g} m from the place of the contact, "
                    "expected numbers above 0 outside and below 0 inside; bounded=False for a region without end"
                )
            out = np.flatnonzero((there[:-1] <= 0.0) & (there[1:] > 0.0))
            if out.size:
                low, high = PLACES[out[-1] : out[-1] + 2]
                for _ in range(30):
                    middle = np.sqrt(low * high)
                    low, high = (middle, high) if of((at + middle * way)[None])[0] <= 0.0 else (low, middle)
                e = 1e-6 * high
                sides = of(at + high * way + e * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]))
                slopes.append(np.hypot(sides[0] - sides[1], sides[2] - sides[3]) / (2.0 * e))
    check_compiled(distance, 2 + len(plain), name)
    far = max(slopes, key=lambda one: abs(np.log(max(one, 1e-300))), default=1.0)
    if not abs(far - 1.0) <= GROWTH:
        logging.getLogger("gapbeam").warning(
            "%s grows by %.3g m per m at a place of its wall, expected 1: forces there are %.3g times those of the law",
            name, far, far,
        )  # fmt: skip
