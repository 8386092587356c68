"""What joints and masses add to the mean motions of cross-sections."""

from __future__ import annotations

from dataclasses import dataclass

from gapbeam.solver.attachments.mean_motion import MeanMotion
from gapbeam.solver.loads.attachment import Attachment


@dataclass(frozen=True)
class Attached:
    """A mass, a spring and a damper on one motion of a cross-section, or a hold that lets it have none.

    Attributes:
        motion: The motion.
        attachment: Mass in kg or kg m^2, spring and damper to the frame of the supports; zeros for a hold.
        held: Whether the section does not move so at all.
        driven: Mass that gravity and the motion of the frame act on; None: the mass that is attached.
        spread: Whether it is a part of something along the beam, which calls for no static shape of its own in a basis.
        restrains: Whether nothing else may hold the body so: a mesh takes the spring into its stiffness.
    """

    motion: MeanMotion
    attachment: Attachment
    held: bool = False
    driven: float | None = None
    spread: bool = False
    restrains: bool = False
