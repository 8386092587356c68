"""Masses, springs, dampers and static forces that a load adds to the beam, besides its force in time."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Attachment:
    """A mass that moves with a point of the beam, on a spring and a damper that stand on the frame of the support.

    Attributes:
        mass: kg.
        stiffness: Along the direction of the load, N/m.
        damping: Along the direction of the load, N s/m.
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
        force: Along the direction of the load, N.
    """

    name: str
    force: float
