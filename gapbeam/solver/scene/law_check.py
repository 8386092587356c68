"""Check of a law: a potential that is not the integral of its spring creates energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gapbeam.solver.contact.laws.integral_check import compared
from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.force_law import ForceLaw, LawKind
from gapbeam.solver.system.operators import Array

PLACES = 2.0 ** np.arange(-40.0, 41.0, 1.5)  # m, from less than an atom on: whichever of them the law bears
AGREED = 1e-5

_checked: set[tuple[LawKind, tuple[float, ...]]] = set()


def check_law(law: ForceLaw) -> None:
    """Compare the potential of a law with its spring, and its closed mean with the potential.

    At penetrations from 1e-12 to 1e12 m and between them, as far as the functions are finite there and round-off leaves
    digits: see `integral_check`. And W(b) - W(a) = M(a, b) (b - a).

    Raises:
        UserError: They differ.
    """
    values = tuple(float(np.ravel(one)[0]) for one in law.values)
    kind = law.kind
    if (kind, values) in _checked:
        return

    def of_arrays(function: Any) -> Callable[[Array], Array]:
        return np.vectorize(lambda x: _value(function.py_func, x, values), otypes=[float])

    spring, potential = of_arrays(kind.spring), of_arrays(kind.potential)
    with np.errstate(all="ignore"):
        differ, judged = compared(spring, potential, PLACES, AGREED)
        forces, stored = spring(PLACES), potential(PLACES)
    if np.any(differ) or (np.any(forces != 0.0) and not np.any(judged & (forces != 0.0))):
        wrong = np.flatnonzero(differ)
        x = float(PLACES[wrong[len(wrong) // 2] if wrong.size else len(PLACES) // 2])
        raise UserError(
            f"law {kind.name}: at a penetration of {x:.3g} m, or between it and {3.0 * x:.3g} m, the potential is not "
            f"the integral of the spring; expected W with W(0) = 0 and W' = spring(x)"
        )
    if kind.mean is not None:
        for i in np.flatnonzero(judged[:-1] & judged[1:]):
            a, b = PLACES[i], PLACES[i + 1]
            M, expected = kind.mean.py_func(a, b, *values)[0], (stored[i + 1] - stored[i]) / (b - a)
            if not abs(M - expected) <= AGREED * abs(expected):
                raise UserError(
                    f"law {kind.name}: the mean force between {a:.3g} and {b:.3g} m is {M:.6g} N, by the potential "
                    f"{expected:.6g} N; leave the closed mean out, or mend it"
                )
    _checked.add((kind, values))


def _value(function: object, x: float, values: tuple[float, ...]) -> float:
    try:
        return float(function(np.float64(x), *values))  # type: ignore[operator]
    except (OverflowError, ValueError, ZeroDivisionError):
        return float("nan")
