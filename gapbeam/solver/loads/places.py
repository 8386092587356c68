"""Places of loads, a closed set that models of every kind turn into forces, and parts of loads: a place and a function.

A load may add masses, springs, dampers and static forces to the beam besides its force in time.

Most loads are one part. One that is random along the beam is several patterns with noises of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeVar

from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.schema.table import Vector


@dataclass(frozen=True)
class PointForce:
    """A force at a point of the beam: f = N(x_p)^T e s(t), s in N.

    Attributes:
        point: x on the beam axis, or all coordinates, m.
    """

    point: float | Vector

    unit: ClassVar[str] = "N"


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
    unit: ClassVar[str] = "N/m"


@dataclass(frozen=True)
class BodyForce:
    """A uniform acceleration of all mass: f = M e s(t), s in m/s^2."""

    point: ClassVar[None] = None
    unit: ClassVar[str] = "m/s2"


@dataclass(frozen=True)
class SupportAcceleration:
    """The inertia of the beam in the frame of a support that moves: f = -M e s(t), s in m/s^2."""

    point: ClassVar[None] = None
    unit: ClassVar[str] = "m/s2"


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
    unit: ClassVar[str] = "m"


Place = PointForce | LineForce | BodyForce | SupportAcceleration | SupportWalls


@dataclass(frozen=True)
class Attachment:
    """A mass that moves with a point of the beam, on a spring and a damper that stand on the frame of the support.

    Attributes:
        mass: kg.
        stiffness: Stiffness along the direction of the load, N/m.
        damping: Damping along the direction of the load, N s/m.
    """

    mass: float
    stiffness: float
    damping: float

    @property
    def acts(self) -> bool:
        """True where mass, stiffness or damping is added."""
        return max(self.mass, self.stiffness, self.damping) > 0.0


@dataclass(frozen=True)
class StaticForce:
    """A constant force that is a load of its own in results.

    Attributes:
        name: Its name there.
        force: Force along the direction of the load, N.
    """

    name: str
    force: float


@dataclass(frozen=True)
class LoadPart:
    """A part of a load.

    Attributes:
        name: Name in results.
        place: Place that it acts on.
        time_function: Returns s(t).
    """

    name: str
    place: Place
    time_function: Callable[[], TimeFunction]


class _Parted(Protocol):
    @property
    def parts(self) -> tuple[LoadPart, ...]: ...


AnyLoad = TypeVar("AnyLoad", bound=_Parted)


def patterned(loads: Iterable[AnyLoad]) -> list[tuple[AnyLoad, LoadPart]]:
    """Return the parts of loads: the first one of each load in their order, and after them the further ones."""
    parts = [(load, load.parts) for load in loads]
    return [(load, of_load[0]) for load, of_load in parts] + [
        (load, part) for load, of_load in parts for part in of_load[1:]
    ]
