"""The laws that come with the package, each with its spring, potential, damper and closed mean.

A law is checked: a potential that is not the integral of its spring creates energy.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from gapbeam.solver.contact.laws.own_spring import compared
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.force_law import TINY, ForceLaw, LawKind, inlined, law
from gapbeam.solver.scene.own_functions import PLACES, check_compiled, is_own, tried
from gapbeam.solver.system.operators import Array


@law(
    potential=lambda x, stiffness, damping: 0.5 * stiffness * x * x,  # noqa: ARG005
    mean=lambda a, b, stiffness, damping: (0.5 * stiffness * (a + b), 0.5 * stiffness),  # noqa: ARG005
    damper=lambda force, share, rate, stiffness, damping: damping * share * rate,  # noqa: ARG005
    nonnegative=("stiffness", "damping"),
    per_area=("stiffness", "damping"),
)
def KelvinVoigt(x, stiffness, damping=0.0):  # type: ignore[no-untyped-def]  # noqa: ARG001, N802
    """Return stiffness x + damping x', never negative: spring and damper side by side."""
    return stiffness * x


@law(
    potential=lambda x, stiffness, damping: 0.5 * stiffness * x * x,  # noqa: ARG005
    mean=lambda a, b, stiffness, damping: (0.5 * stiffness * (a + b), 0.5 * stiffness),  # noqa: ARG005
    damper=lambda force, share, rate, stiffness, damping: min(max(damping * share * rate, -force), force),  # noqa: ARG005
    nonnegative=("stiffness", "damping"),
    per_area=("stiffness", "damping"),
)
def ElastoGap(x, stiffness, damping):  # type: ignore[no-untyped-def]  # noqa: ARG001, N802
    """Return stiffness x + damping x', the damper no larger than the spring: no jump at touch, no pull.

    Source: Modelica.Mechanics.Translational.Components.ElastoGap, Modelica Standard Library 4.0, with n = 1.
    """
    return stiffness * x


def _cubic_mean(a, b, stiffness, scale):  # type: ignore[no-untyped-def]
    c = 0.25 / (scale * scale)
    return stiffness * (a + b) * (0.5 + c * (a * a + b * b)), stiffness * (0.5 + c * (a * a + 2 * a * b + 3 * b * b))


@law(
    potential=lambda x, stiffness, scale: stiffness * x * x * (0.5 + 0.25 * (x / scale) ** 2),
    mean=_cubic_mean,
    nonnegative=("stiffness",),
    positive=("scale",),
    per_area=("stiffness",),
)
def Cubic(x, stiffness, scale):  # type: ignore[no-untyped-def]  # noqa: N802
    """Return stiffness (x + x^3 / scale^2): a bumper that stiffens."""
    return stiffness * x * (1 + (x / scale) ** 2)


@lru_cache
def _hunt_crossley(exponent: float) -> LawKind:
    """Return the law of one exponent; multiples of 1/2 need square roots only.

    With a, b the roots of p0, p1 and m = 2 exponent + 2: M = K (sum_i b^i a^(m-1-i)) / (exponent + 1) / (a + b).
    """
    m = round(2 * exponent) + 2
    half = 2 * exponent + 2 == m and m < 16

    @inlined
    def power(x, twice):  # type: ignore[no-untyped-def]
        y = 1.0 if twice % 2 == 0 else np.sqrt(x)
        for _ in range(twice // 2):
            y *= x
        return y

    @inlined
    def mean(p0, p1, stiffness, chi):  # type: ignore[no-untyped-def]  # noqa: ARG001
        a, b = np.sqrt(p0), np.sqrt(p1)
        total, turn, c = 1.0, m - 2.0, 1.0
        for i in range(m - 2, -1, -1):  # in falling powers of b and rising powers c of a
            c *= a
            total = total * b + c
            if i > 0:
                turn = turn * b + 2.0 * i * c
        scale, inverse = stiffness / (exponent + 1), 1 / (a + b + TINY)
        return scale * total * inverse, 0.5 * scale * turn * inverse * inverse

    def spring(x, stiffness, chi=0.0):  # type: ignore[no-untyped-def]  # noqa: ARG001
        return stiffness * power(x, m - 2) if half else stiffness * x**exponent

    def potential(x, stiffness, chi):  # type: ignore[no-untyped-def]  # noqa: ARG001
        return stiffness * (power(x, m) if half else x ** (exponent + 1)) / (exponent + 1)

    spring.__name__ = "HuntCrossley"
    damper = lambda force, share, rate, stiffness, chi: chi * force * rate  # noqa: ARG005, E731
    make = law(potential, damper, mean if half else None, nonnegative=("stiffness", "chi"), per_area=("stiffness",))
    return make(spring)


@checked
def HuntCrossley(stiffness: Any, chi: Any = 0.0, exponent: float = 1.5) -> ForceLaw:  # noqa: N802
    """Return K x^n (1 + chi x'): Hertz contact for n = 1.5, with losses that begin and end at 0.

    Args:
        stiffness: K, N/m^n.
        chi: s/m; restitution e follows from chi times the speed of impact.
        exponent: n, at least 1; compiled into the law.

    Raises:
        UserError: The exponent is below 1.

    Source: Hunt and Crossley (1975), J. Appl. Mech. 42, 440.
    """
    if not 1.0 <= exponent < inf:
        raise UserError(f"law HuntCrossley: found exponent {exponent!r}, expected 1 or more")
    return _hunt_crossley(float(exponent))(stiffness=stiffness, chi=chi)


def _adhesive_potential(x, stiffness, pull, reach):  # type: ignore[no-untyped-def]
    soft = pull / reach * (x + reach) ** 2 / 2
    ramp = pull * reach / 2
    if x <= -reach:
        return 0.0
    return -soft if x <= 0 else -ramp - pull * x + 0.5 * stiffness * x * x


@law(
    potential=_adhesive_potential,
    adhesive=True,
    nonnegative=("stiffness", "pull"),
    positive=("reach",),
    per_area=("stiffness", "pull"),
)
def Adhesive(x, stiffness, pull, reach):  # type: ignore[no-untyped-def]  # noqa: N802
    """Return a pull that grows to `pull` over `reach` before touch, then a press of `stiffness`."""
    if x <= -reach:
        return 0.0
    return -pull / reach * (x + reach) if x <= 0 else stiffness * x - pull


AGREED = 1e-5

_checked: set[tuple[LawKind, tuple[float, ...]]] = set()


def check_law(law: ForceLaw) -> None:
    """Compare the potential of a law with its spring, and its closed mean with the potential.

    At penetrations from 1e-12 to 1e12 m and between them, as far as the functions are finite there and round-off leaves
    digits: see `integral_check`. And W(b) - W(a) = M(a, b) (b - a). Functions of users are tried and compiled before.

    Raises:
        UserError: A function fails, has no number anywhere or cannot be compiled, the potential differs from the
            spring, or the closed mean from the potential.
    """
    values = tuple(float(np.ravel(one)[0]) for one in law.values)
    kind = law.kind
    if (kind, values) in _checked:
        return

    def of_arrays(what: str) -> Callable[[Array], Array]:
        where = f"law {kind.name}: its {what}"
        return np.vectorize(lambda x: tried(getattr(kind, what), (x, *values), where), otypes=[float])

    spring, potential = of_arrays("spring"), of_arrays("potential")
    with np.errstate(all="ignore"):
        forces, stored = spring(PLACES), potential(PLACES)
        for what, found in (("spring", forces), ("potential", stored)):
            if not np.any(np.isfinite(found)):
                raise UserError(f"law {kind.name}: its {what} has no finite number at any penetration")
        _check_own(kind, values)
        differ, judged = compared(spring, potential, PLACES, AGREED)
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


def _check_own(kind: LawKind, values: tuple[float, ...]) -> None:
    """Refuse functions of a user that fail, that compiled code cannot call, or that drive the motion."""
    for what, count, answers in (("spring", 1, 1), ("potential", 1, 1), ("damper", 3, 1), ("mean", 2, 2)):
        function = getattr(kind, what)
        if is_own(function):
            where = f"law {kind.name}: its {what}"
            if answers == 1:
                tried(function, (*[1.0] * count, *values), where)
            check_compiled(function, count + len(values), where, answers)
    if is_own(kind.damper) and not kind.memory:
        for rate in (*PLACES, *-PLACES):
            force = tried(kind.damper, (1.0, 1.0, rate, *values), f"law {kind.name}: its damper")
            if force * rate < 0.0:
                raise UserError(
                    f"law {kind.name}: its damper is {force:.3g} N at a rate of {rate:.3g} m/s, expected one of the "
                    "sign of the rate: it drives the motion"
                )
