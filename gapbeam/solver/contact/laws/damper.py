"""The damped part of a contact law, per area: p = c(d) d' for d > 0, with c(d) by the formula of a law.

Each law writes c(d), its slope and its integral C(d) = int_0^d c at one point, in its own file. Over a step in which
the penetration moves from d0 to d1 the time mean of c(d) d' is (C(d1) - C(d0)) / dt, whatever the path in between.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, cast

from gapbeam.solver.system.operators import Array

Parameters = tuple[float, float, float, float]
ROOM = 4  # parameters of a formula, those that it does not use are 0


class DampedPoint(NamedTuple):
    """What the formula of a damper is given at a contact point, besides the penetration.

    Attributes:
        stiffness: K of the spring, Pa/m^n.
        exponent: n of the spring.
        coefficient: Coefficient of the damper at this point; its meaning is that of the law.
        parameters: Parameters of the damper that are the same at all points.
    """

    stiffness: float
    exponent: float
    coefficient: float
    parameters: Parameters


@dataclass(frozen=True)
class Damper:
    """A damper: the formula of a law with its numbers.

    Attributes:
        law: Name of the law in a case file, whose formula it is.
        coefficient: One number or one per contact point, (m,).
        parameters: At most `ROOM` numbers that are the same at all points.
    """

    law: str
    coefficient: float | Array = 0.0
    parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse more parameters than a formula is given."""
        if len(self.parameters) > ROOM:
            raise ValueError(f"{len(self.parameters)} parameters of the damper {self.law}; expected at most {ROOM}")

    @property
    def padded(self) -> Parameters:
        """All `ROOM` parameters."""
        first, second, third, fourth = (*map(float, self.parameters), *(0.0,) * (ROOM - len(self.parameters)))
        return first, second, third, fourth


NO_DAMPER = Damper("kelvin-voigt")


def per_area(value: float | Array, areas: float | Array) -> float | Array:
    """Return what resultants at points are per area: a value over areas, (m,), m^2; over 1 where it is per area."""
    return cast("float | Array", value / areas)
