"""The resultant of a contact law where a round section meets a flat wall: on a strip that widens as it is pressed.

Of a section of the radius r that is d deep in a wall, what lies s beside the deepest point is d - s^2 / (2 r) deep. The
pressure p = K d^n of a length b adds up to

    F = b int K <d - s^2 / (2 r)>^n ds = b K sqrt(2 r) B(n + 1) d^(n + 1/2),
    B(n + 1) = sqrt(pi) Gamma(n + 1) / Gamma(n + 3/2),    4/3 for n = 1

and so does a damper, c d^q d'. One point for each wall and station stands for the strip. Its area is the projected one,
2 r b, so that its law per area is F / (2 r b). Damping in proportion to K d^n stays that. Errors are d / r of
all; clipped, a damper is clipped on the whole strip, and not beside the deepest point first: with k = b K sqrt(2 r),

    F = k max(4/3 d^(3/2) + 2 (c / K) d^(1/2) d', 0),    on the way back point by point 4/3 k <d + (c / K) d'>^(3/2)

A mass comes back slower than from points, `slower_return`: by 0.7 % where its restitution there is 0.8.

Source: Johnson (1985), Contact Mechanics, section 4.3, for a cylinder on an elastic foundation.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import gamma, pi, sqrt

import scipy

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import per_area
from gapbeam.solver.contact.laws.law_choice import KelvinVoigt
from gapbeam.solver.schema.table import type_name
from gapbeam.solver.system.operators import Array

NEARLY_ELASTIC, LEAST_RETURN = 0.9999, 0.01
LONG = 100.0  # beside 1: the time of a contact, and c / K of a contact that hardly returns anything
GROWTH = 0.5  # of the exponent: the strip is as wide as the square root of the depth


def line_law(law: ContactLaw, radius: float) -> ContactLaw:
    """Return a law per projected area of the strip along which a round section meets a flat wall.

    Args:
        law: K d^n per area, with a damper of `ChosenLaw.rolls`.
        radius: Radius of the section, m.
    """
    spring, damper, width = law.spring, law.damper, (2.0 * radius) ** GROWTH
    if damper.law == type_name(KelvinVoigt):
        coefficient = per_area(damper.coefficient, width / _strip(0.0))
        damper = replace(damper, coefficient=coefficient, parameters=(GROWTH,))
    stiffness = per_area(spring.stiffness, width / _strip(spring.exponent))
    spring = replace(spring, stiffness=stiffness, exponent=spring.exponent + GROWTH)
    return replace(law, spring=spring, damper=damper)


@lru_cache
def slower_return(restitution: float) -> float:
    """Return by which share a mass comes back slower from a strip, clipped as a whole, than from points of it.

    Both are d'' = -F, F as above, with a mass, k and a speed of 1: other values change c / K alone.

    Args:
        restitution: Restitution of the points, which c / K follows from, in (0, 1]; below 0.01 as at 0.01.
    """
    if restitution > NEARLY_ELASTIC:
        return 0.0
    restitution = max(restitution, LEAST_RETURN)

    def returned(ratio: float, whole: bool) -> float:
        def force(state: Array) -> float:
            depth, speed = max(float(state[0]), 0.0), float(state[1])
            if whole or speed > 0.0:
                return 4.0 / 3.0 * depth * sqrt(depth) + 2.0 * ratio * sqrt(depth) * speed
            felt = max(depth + ratio * speed, 0.0)
            return 4.0 / 3.0 * felt * sqrt(felt)

        def leaves(_: float, state: Array) -> float:
            return float(state[0] + (1.5 if whole else 1.0) * ratio * state[1])

        leaves.terminal, leaves.direction = True, -1.0  # type: ignore[attr-defined]
        found = scipy.integrate.solve_ivp(
            lambda _, state: (state[1], -force(state)), (0.0, LONG), (0.0, 1.0), events=leaves, rtol=1e-8, atol=1e-12
        )
        return -float(found.y[1, -1])

    ratio = scipy.optimize.brentq(lambda one: returned(one, whole=False) - restitution, 0.0, LONG, rtol=1e-8)
    return 1.0 - returned(ratio, whole=True) / restitution


def _strip(exponent: float) -> float:
    """Return sqrt(pi) Gamma(n + 1) / Gamma(n + 3/2): 2 for n = 0, 4/3 for n = 1."""
    return sqrt(pi) * gamma(exponent + 1.0) / gamma(exponent + 1.0 + GROWTH)
