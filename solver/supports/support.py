"""A support: the rigid faces that the beam touches, with their sides, gaps, area and stiffness.

The faces are met along the bending axis e (y in 2D, z in 3D). A contact point at height h = e . x of a face whose plane
stands at the level z has the gap

    g = s (h - z),    s = +1 for a plane below the beam, -1 for a plane above it

The plane touches the undeformed beam at its outermost point when the clearance is zero; a face with the share q of the
clearance stands q times the clearance away from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Face:
    """One rigid plane of a support.

    Attributes:
        name: Name in the mesh, in results and in messages.
        side: s, +1 below the beam and -1 above it: the motion along the bending axis that opens the gap.
        clearance_share: q, the part of the clearance that lies between this plane and the undeformed beam.
    """

    name: str
    side: float
    clearance_share: float = 0.0

    def gaps(self, heights: Array, clearance: float) -> Array:
        """Return the gaps of the undeformed body, (m,), m.

        Args:
            heights: Position along the bending axis of the contact points of this face, (m,), m.
            clearance: Of the support, of any sign, m.
        """
        outermost = heights.min() if self.side > 0.0 else heights.max()
        level = outermost - self.side * (self.clearance_share * clearance)
        return np.asarray(self.side * (heights - level))


BASE_AND_GLAND = (Face("base", 1.0), Face("gland", -1.0, clearance_share=1.0))
"""The faces of the support of Li et al. (2013): the beam rests on the base; the gland stands the clearance above it."""


@dataclass(frozen=True)
class Support:
    """The faces of a support and what they have in common.

    Attributes:
        faces: Its faces.
        area: Area of all faces together, m^2.
        clearance: Total play of the beam between the faces, negative for an interference fit, m.
        face_stiffness: K of all contact points of one face together, N/m^n; None before the contact law is known.
    """

    faces: tuple[Face, ...]
    area: float
    clearance: float = 0.0
    face_stiffness: float | None = None

    @classmethod
    def named(cls, names: Sequence[str], area: float, clearance: float) -> Support:
        """Return the support whose faces have these names, in this order.

        Raises:
            ValueError: A name is not that of a known face.
        """
        known = {face.name: face for face in BASE_AND_GLAND}
        unknown = [name for name in names if name not in known]
        if unknown:
            raise ValueError(f"unknown contact faces {unknown}; expected {', '.join(known)}")
        return cls(tuple(known[name] for name in names), area, clearance)

    @property
    def face_names(self) -> tuple[str, ...]:
        """Names of the faces."""
        return tuple(face.name for face in self.faces)

    @cached_property
    def sides(self) -> Array:
        """The side s of each face, (faces,)."""
        return np.array([face.side for face in self.faces])

    @property
    def face_area(self) -> float:
        """Mean area of a face, m^2."""
        return self.area / len(self.faces)

    @property
    def stiffness_per_area(self) -> float:
        """K of the contact per area of a face, also where contact acts at points, Pa/m^n."""
        return self.per_face_area(self._known_stiffness())

    def per_face_area(self, stiffness: float) -> float:
        """Return a stiffness of all contact points of a face together as one per area of the face."""
        return stiffness / self.face_area

    def opened_to(self, clearance: float) -> tuple[Support, Array]:
        """Return the support at another clearance, and by how much the gap of each face grows, (faces,), m."""
        growth = np.array([face.clearance_share * (clearance - self.clearance) for face in self.faces])
        return replace(self, clearance=clearance), growth

    def with_stiffness(self, face_stiffness: float) -> Support:
        """Return the support with K of all contact points of a face together, N/m^n."""
        return replace(self, face_stiffness=face_stiffness)

    def _known_stiffness(self) -> float:
        if self.face_stiffness is None:
            raise ValueError("the stiffness of the support is known once its contact law is made")
        return self.face_stiffness
