"""The parts of a law against each other: a potential that is no integral of its spring creates energy."""

from __future__ import annotations

from math import isfinite

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.force_law import ForceLaw, LawKind

PLACES = 10.0 ** np.arange(-12.0, 0.5, 0.5)  # m: whichever of them the law bears
STEPS = (1e-4, 2.7e-4, 1.9e-3)
"""Relative steps whose slopes agree, but for kinks and where the potential has lost its digits."""
AGREED = 1e-5

_checked: set[tuple[LawKind, tuple[float, ...]]] = set()


def check_law(law: ForceLaw) -> None:
    """Compare the potential of a law with its spring, and its closed mean with both.

    dW/dx, by central differences of small relative steps, is the spring to 1e-5 of it at penetrations from 1e-12 to
    1 m, as far as the functions are finite there; and W(p1) - W(p0) = M(p0, p1) (p1 - p0).

    Raises:
        UserError: They differ.
    """
    values = tuple(float(np.ravel(one)[0]) for one in law.values)
    key = (law.kind, values)
    if key in _checked:
        return
    kind, judged = law.kind, False
    with np.errstate(all="ignore"):
        for x in PLACES:
            force = _value(kind.spring.py_func, x, values)
            near, *others = (_slope(kind.potential.py_func, x, step, values) for step in STEPS)
            apart = max(abs(near - one) for one in others)
            if not isfinite(force) or not apart <= 0.1 * AGREED * abs(near) or near == 0.0 != force:
                continue  # a kink, or a potential without digits there
            judged = judged or force != 0.0
            if not abs(near - force) <= AGREED * abs(force):
                raise UserError(
                    f"law {kind.name}: at a penetration of {x:.3g} m the spring is {force:.6g} N and the slope of the "
                    f"potential {near:.6g} N; expected the potential to be the integral of the spring from 0"
                )
            if kind.mean is not None:
                M = kind.mean.py_func(x, 3.0 * x, *values)[0]
                work = _value(kind.potential.py_func, 3.0 * x, values) - _value(kind.potential.py_func, x, values)
                if isfinite(work) and not abs(2.0 * x * M - work) <= AGREED * abs(work):
                    raise UserError(
                        f"law {kind.name}: the mean force between {x:.3g} and {3.0 * x:.3g} m is {M:.6g} N, "
                        f"by the potential {work / (2.0 * x):.6g} N; leave the closed mean out, or mend it"
                    )
    pushes = any(_value(kind.spring.py_func, x, values) != 0.0 for x in PLACES)
    if pushes and not judged:
        raise UserError(f"law {kind.name}: the slope of its potential is nowhere its spring from 1e-12 to 1 m")
    _checked.add(key)


def _value(function: object, x: float, values: tuple[float, ...]) -> float:
    try:
        return float(function(np.float64(x), *values))  # type: ignore[operator]
    except (OverflowError, ValueError, ZeroDivisionError):
        return float("nan")


def _slope(potential: object, x: float, step: float, values: tuple[float, ...]) -> float:
    above, below = _value(potential, x * (1.0 + step), values), _value(potential, x * (1.0 - step), values)
    return (above - below) / (2.0 * step * x)
