"""The curves that bound the patches of a cross-section: straight lines and arcs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Place = tuple[float, float]
Side = Literal["inside", "below", "above"]


@dataclass(frozen=True)
class SectionCurve:
    """A line, or an arc of less than half a turn about the axis of the beam, from one point to another.

    Attributes:
        start: y and z of the first point, m.
        end: Those of the last one, m.
        cells: Number of cells along it.
        arc: Whether it is an arc about y = z = 0.
        side: Whether supports below or above the beam can touch it; "inside": neither of them.
    """

    start: Place
    end: Place
    cells: int
    arc: bool = False
    side: Side = "inside"
