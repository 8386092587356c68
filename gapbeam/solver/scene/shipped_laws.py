"""The laws that come with the package, each with its spring, potential, damper and closed mean."""

from __future__ import annotations

from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.force_law import TINY, ForceLaw, LawKind, inlined, law


@law(
    potential=lambda x, stiffness, damping: 0.5 * stiffness * x * x,  # noqa: ARG005
    mean=lambda a, b, stiffness, damping: (0.5 * stiffness * (a + b), 0.5 * stiffness),  # noqa: ARG005
    damper=lambda force, share, rate, stiffness, damping: damping * share * rate,  # noqa: ARG005
    nonnegative=("stiffness", "damping"),
)
def KelvinVoigt(x, stiffness, damping=0.0):  # type: ignore[no-untyped-def]  # noqa: ARG001, N802
    """Return stiffness x + damping x', never negative: spring and damper side by side."""
    return stiffness * x


@law(
    potential=lambda x, stiffness, damping: 0.5 * stiffness * x * x,  # noqa: ARG005
    mean=lambda a, b, stiffness, damping: (0.5 * stiffness * (a + b), 0.5 * stiffness),  # noqa: ARG005
    damper=lambda force, share, rate, stiffness, damping: min(max(damping * share * rate, -force), force),  # noqa: ARG005
    nonnegative=("stiffness", "damping"),
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
    return law(potential, damper, mean if half else None, nonnegative=("stiffness", "chi"))(spring)


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


@law(potential=_adhesive_potential, adhesive=True, nonnegative=("stiffness", "pull"), positive=("reach",))
def Adhesive(x, stiffness, pull, reach):  # type: ignore[no-untyped-def]  # noqa: N802
    """Return a pull that grows to `pull` over `reach` before touch, then a press of `stiffness`."""
    if x <= -reach:
        return 0.0
    return -pull / reach * (x + reach) if x <= 0 else stiffness * x - pull
