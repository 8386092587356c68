"""Time schemes as data: one step in w = (q1 - q) / h, and one kernel for all of them.

    M a* + C v* + K (q + level h w) = f(t + level h) + B^T F,
    a* = (i0 w + i1 v) / h + i2 a,     v* = d0 w + d1 v + d2 h a,
    q1 = q + h w,     v1 = e0 w + e1 v + e2 h a,     a1 = (g0 w + g1 v) / h + g2 a.

F is the mean of the law over the step (`law` = 0: the discrete gradient), or the law at the level `law` of the step (1:
its end).
"""

from __future__ import annotations

from typing import NamedTuple

from gapbeam.solver.errors import UserError

Three = tuple[float, float, float]


class LinearScheme(NamedTuple):
    """Numbers of a scheme; see the module.

    Attributes:
        level: Of stiffness and loads within the step.
        law: Of the contact forces; 0: their mean over the step.
        inertia: i0, i1, i2.
        drag: d0, d1, d2.
        velocity: e0, e1, e2.
        acceleration: g0, g1, g2.
    """

    level: float
    law: float
    inertia: Three
    drag: Three
    velocity: Three
    acceleration: Three = (0.0, 0.0, 0.0)

    @property
    def is_accelerated(self) -> bool:
        """Whether the acceleration is part of the state."""
        return any(self.acceleration)


def theta(level: float, law: float = 0.0) -> LinearScheme:
    """Return the theta rule: of order 1; level 1/2 is the midpoint rule, of order 2.

    Raises:
        UserError: The level is not within 1/2 and 1, where the rule is stable.
    """
    if not 0.5 <= level <= 1.0:
        raise UserError(f"scheme theta: found level {level!r}, expected 0.5 to 1")
    return LinearScheme(level, law, (1 / level, -1 / level, 0.0), (1.0, 0.0, 0.0), (1 / level, 1 - 1 / level, 0.0))


def alpha(mass: float, force: float, beta: float, gamma: float, law: float | None = None) -> LinearScheme:
    """Return Newmark's formulas with inertia and forces at levels 1 - mass and 1 - force of the step.

    Source: Chung and Hulbert (1993), J. Appl. Mech. 60, 371, eqs. 1 to 7.
    """
    m, f = 1 - mass, 1 - force
    end = 1 / beta, -1 / beta, 1 - 0.5 / beta
    v = gamma / beta, 1 - gamma / beta, 1 - 0.5 * gamma / beta
    inertia = m * end[0], m * end[1], m * end[2] + mass
    return LinearScheme(f, f if law is None else law, inertia, (f * v[0], f * v[1] + force, f * v[2]), v, end)


MIDPOINT = theta(0.5)
"""The default: conserves energy in contact at any step."""


def euler() -> LinearScheme:
    """Return implicit Euler: of order 1; damps all that a step does not resolve."""
    return theta(1.0, law=1.0)


def newmark(beta: float = 0.25, gamma: float = 0.5) -> LinearScheme:
    """Return Newmark's scheme. It creates energy in contacts that the step does not resolve."""
    return alpha(0.0, 0.0, beta, gamma)


def hht(damping: float = 0.05) -> LinearScheme:
    """Return the scheme of Hilber, Hughes and Taylor; damping, 0 to 1/3, is their -alpha.

    Raises:
        UserError: The damping is out of that range.
    """
    if not 0.0 <= damping <= 1 / 3:
        raise UserError(f"scheme hht: found damping {damping!r}, expected 0 to 1/3")
    return alpha(0.0, damping, (1 + damping) ** 2 / 4, 0.5 + damping)


def generalized_alpha(rho: float = 0.8) -> LinearScheme:
    """Return the generalized-alpha scheme with a spectral radius at infinite frequency of rho, 0 to 1.

    Raises:
        UserError: rho is out of that range.

    Source: Chung and Hulbert (1993), J. Appl. Mech. 60, 371, eq. 25.
    """
    if not 0.0 <= rho <= 1.0:
        raise UserError(f"scheme generalized_alpha: found rho {rho!r}, expected 0 to 1")
    mass, force = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    return alpha(mass, force, (1 - mass + force) ** 2 / 4, 0.5 - mass + force)
