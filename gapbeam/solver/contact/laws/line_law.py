"""The resultant of a contact law where a round section meets a flat wall: on a strip that widens as it is pressed.

Of a section of the radius r that is d deep in a wall, what lies s beside the deepest point is d - s^2 / (2 r) deep. The
pressure p = K d^n of a length b adds up to

    F = b int K <d - s^2 / (2 r)>^n ds = b K sqrt(2 r) B(n + 1) d^(n + 1/2),
    B(n + 1) = sqrt(pi) Gamma(n + 1) / Gamma(n + 3/2),    4/3 for n = 1

and so does a damper, c d^q d'. One point for each wall and station stands for the strip. Its area is the projected one,
2 r b, so that its law per area is F / (2 r b). Damping in proportion to K d^n stays that. Errors are d / r of
all; clipped, a damper is clipped on the whole strip, and not beside the deepest point first: with k = b K sqrt(2 r),

    F = k max(4/3 d^(3/2) + 2 (c / K) d^(1/2) d', 0),    on the way back point by point 4/3 k <d + (c / K) d'>^(3/2)

A mass comes back 0.2, 0.7, 1.6 and 4.5 % slower than from points where its restitution there is 0.9, 0.8, 0.7 and 0.5.

Source: Johnson (1985), Contact Mechanics, section 4.3, for a cylinder on an elastic foundation.
"""

from __future__ import annotations

from dataclasses import replace
from math import gamma, pi, sqrt

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import per_area
from gapbeam.solver.contact.laws.law_choice import KelvinVoigt
from gapbeam.solver.table import type_name

GROWTH = 0.5  # of the exponent: the strip is as wide as the square root of the depth


def line_law(law: ContactLaw, radius: float) -> ContactLaw:
    """Return a law per projected area of the strip along which a round section meets a flat wall.

    Args:
        law: K d^n per area, with a damper of `ChosenLaw.rolls`.
        radius: Of the section, m.
    """
    spring, damper, width = law.spring, law.damper, (2.0 * radius) ** GROWTH
    if damper.law == type_name(KelvinVoigt):
        coefficient = per_area(damper.coefficient, width / _strip(0.0))
        damper = replace(damper, coefficient=coefficient, parameters=(GROWTH,))
    stiffness = per_area(spring.stiffness, width / _strip(spring.exponent))
    spring = replace(spring, stiffness=stiffness, exponent=spring.exponent + GROWTH)
    return replace(law, spring=spring, damper=damper)


def _strip(exponent: float) -> float:
    """Return sqrt(pi) Gamma(n + 1) / Gamma(n + 3/2): 2 for n = 0, 4/3 for n = 1."""
    return sqrt(pi) * gamma(exponent + 1.0) / gamma(exponent + 1.0 + GROWTH)
