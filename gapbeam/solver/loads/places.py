"""Places of loads: a closed set, which models of every kind turn into forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gapbeam.solver.table import Vector


@dataclass(frozen=True)
class PointForce:
    """A force at a point of the beam: f = N(x_p)^T e s(t), s in N.

    Attributes:
        point: x on the beam axis, or all coordinates, m.
    """

    point: float | Vector


@dataclass(frozen=True)
class LineForce:
    """Forces at places along the beam axis that act together: f = sum_i w_i N(x_i)^T e s(t), s in N/m.

    Attributes:
        places: x on the beam axis, m.
        weights: w_i, m.
    """

    places: tuple[float, ...]
    weights: tuple[float, ...]

    point: ClassVar[None] = None


@dataclass(frozen=True)
class BodyForce:
    """A uniform acceleration of all mass: f = M e s(t), s in m/s^2."""

    point: ClassVar[None] = None


@dataclass(frozen=True)
class SupportAcceleration:
    """The inertia of the beam in the frame of a support that moves: f = -M e s(t), s in m/s^2."""

    point: ClassVar[None] = None


@dataclass(frozen=True)
class SupportWalls:
    """The walls of one support, which move in the frame of all supports: no force, but gaps that change by s, in m.

    Attributes:
        support: Name of the support; None: the only one.
        opens: Whether s is added to its clearance, or moves it along the direction of the load.
    """

    support: str | None
    opens: bool

    point: ClassVar[None] = None


Place = PointForce | LineForce | BodyForce | SupportAcceleration | SupportWalls
