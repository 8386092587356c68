"""The motions of support bodies: one along the bending axis each, and a second one across it around the beam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.record_table import COMPONENTS
from gapbeam.solver.supports.layout import Layout, within
from gapbeam.solver.supports.regions.region import Placement
from gapbeam.solver.supports.support_body import SupportBody
from gapbeam.solver.supports.support_tables import OneSupport


@dataclass(frozen=True)
class BodyMotion:
    """One motion q of the body of a support.

    Attributes:
        support: The support.
        body: Its mass, spring and damper.
        axis: Component of displacement: 1 or 2.
        dimension: 2 or 3.
    """

    support: OneSupport
    body: SupportBody
    axis: int
    dimension: int

    @property
    def bends(self) -> bool:
        """Whether it is along the bending axis."""
        return self.axis == self.dimension - 1

    @property
    def axis_name(self) -> str:
        """Name of the component."""
        return COMPONENTS[self.dimension][self.axis]

    @property
    def label(self) -> str:
        """Name of the motion in descriptions of faces; no load has a name with a dot."""
        return f"{self.support.name}.{self.axis_name}"

    def face_changes(self) -> dict[str, tuple[float, float, float]]:
        """Return by how much a unit of the motion changes gap, offset and lateral of each face, by its name."""
        unit = Placement(0.0, offset=1.0) if self.bends else Placement(0.0, lateral=1.0)
        pairs = zip(self.support.faces_at(unit), self.support.faces_at(Placement(0.0)), strict=True)
        found = {}
        for new, old in pairs:
            up, aside = (new.shape.get(key, 0.0) - old.shape.get(key, 0.0) for key in ("offset", "lateral"))
            found[new.name] = (new.gap - old.gap, up, aside)
        return found


def body_motions(layout: Layout, dimension: int) -> tuple[BodyMotion, ...]:
    """Return the motions of all support bodies, support by support along the beam; none where supports stand still.

    Args:
        layout: The supports.
        dimension: 2 or 3.
    """
    return tuple(
        BodyMotion(one, one.body, axis, dimension)
        for one in layout.supports
        if one.body is not None
        for axis in ((dimension - 1, 1) if one.around and dimension > 2 else (dimension - 1,))
    )


def body_shifts(layout: Layout, places: np.ndarray, dimension: int) -> np.ndarray:
    """Return by how much a unit of each motion moves the support at places along the beam, (k, places, dimension).

    Args:
        layout: The supports.
        places: x, (places,), m.
        dimension: 2 or 3.
    """
    motions = body_motions(layout, dimension)
    found = np.zeros((len(motions), len(places), dimension))
    for shift, one in zip(found, motions, strict=True):
        shift[within(places, one.support), one.axis] = 1.0
    return found
