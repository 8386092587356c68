"""The play of a support: where its middle is, and how far a beam in the middle can move from there."""

from __future__ import annotations

from dataclasses import dataclass

from gapbeam.solver.supports.regions.around_face import AroundFace
from gapbeam.solver.supports.support_tables import OneSupport


@dataclass(frozen=True)
class Play:
    """The play of one support.

    Attributes:
        height: Where its middle is along the bending direction, from the axis of the undeformed beam, m; in the middle
            of the support, where this is tilted.
        lateral: Where it is toward +y, m; None: the support does not bound the beam sideways.
        half: How far the beam can move from there before it touches, in the nearest direction, m; negative for an
            interference fit.
        support: The support.
    """

    height: float
    lateral: float | None
    half: float
    support: OneSupport


def play_of(support: OneSupport) -> Play | None:
    """Return the play of a support; None where it is open to one side, as a stop or a V-block is.

    Between planes the middle is halfway from the lower to the upper one; within a face around the beam it is the
    centroid of the area that the axis may move in.
    """
    planes = {1.0: list[float](), -1.0: list[float]()}
    for face in support.faces:
        if isinstance(face, AroundFace):
            found = face.middle_of_play
            return None if found is None else Play(found[1], found[0], found[2], support)
        planes[face.side].append(face.gap)
    below, above = (min(planes[side], default=None) for side in (1.0, -1.0))
    if below is None or above is None:
        return None
    return Play(0.5 * (above - below), None, 0.5 * (above + below), support)
