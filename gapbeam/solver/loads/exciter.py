"""A modal exciter: a harmonic force at a point, with what its moving mass and suspension add to the beam.

What mass, spring and damper add to M, C and K is in `gapbeam.solver.assembly.assembled_system`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.places import Attachment, StaticForce
from gapbeam.solver.loads.point_load import HarmonicPointForce
from gapbeam.solver.schema.table import Name, NonNegative, Number

UNITS = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m", "preload": "N"}


class Exciter(HarmonicPointForce):
    """A harmonic force from a modal exciter: a mass on a spring and a damper, fixed to the beam.

    The suspension stands on the frame of the support and carries the weight of the moving mass: gravity does not act on
    it, base motion does. It is relaxed in the undeformed pose of the beam, but for the preload.
    """

    type: Literal["exciter"] = Field(description="kind of load")
    name: Name = Field(default="exciter", description="unique name")
    mass: NonNegative = Field(default=0.0, description="moving mass, which follows the beam, kg", examples=[0.1])
    stiffness: NonNegative = Field(
        default=0.0, description="stiffness of the suspension along the direction, N/m", examples=[1.0e4]
    )
    damping: NonNegative = Field(
        default=0.0, description="damping of the suspension along the direction, N s/m", examples=[2.0]
    )
    preload: Number = Field(
        default=0.0, description="static force on the beam along the direction, also in the seat, N", examples=[-5.0]
    )

    @property
    def attachment(self) -> Attachment:
        """Its moving mass on its suspension."""
        return Attachment(self.mass, self.stiffness, self.damping)

    @property
    def may_rest(self) -> bool:
        """Its preload does."""
        return True

    @property
    def static_force(self) -> StaticForce | None:
        """The preload, where there is one."""
        return StaticForce(f"{self.name} preload", self.preload) if self.preload != 0.0 else None

    @property
    def curve_units(self) -> Mapping[str, str]:
        """Units of frequency, amplitude, and of what it adds to the beam."""
        return {**super().curve_units, **UNITS}

    @property
    def acts(self) -> bool:
        """True where the exciter has a force, a preload, or anything attached to the beam."""
        return super().acts or self.attachment.acts or self.preload != 0.0
