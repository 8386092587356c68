"""The supports: the rigid faces that the beam touches, with their sides, gaps, area and stiffness.

The faces are met along the bending axis e (y in 2D, z in 3D). A contact point at height h = e . x of a face whose plane
stands at the level z has the gap

    g = s (h - z),    s = +1 for a plane below the beam, -1 for a plane above it

The plane stands the initial gap of the face away from the outermost point of the undeformed beam there; where that gap
is negative, the undeformed beam reaches into the face.
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
        gap: Distance from this plane to the outermost point of the undeformed beam, of any sign, m.
    """

    name: str
    side: float
    gap: float = 0.0

    def gaps(self, heights: Array) -> Array:
        """Return the gaps of the undeformed body, (m,), m.

        Args:
            heights: Position along the bending axis of the contact points of this face, (m,), m.
        """
        outermost = heights.min() if self.side > 0.0 else heights.max()
        level = outermost - self.side * self.gap
        return np.asarray(self.side * (heights - level))


@dataclass(frozen=True)
class Support:
    """The faces of all supports of a beam, and what they have in common.

    Attributes:
        faces: The faces.
        area: Area of all faces together, m^2.
        face_stiffness: K of all contact points of one face together, N/m^n; None before the contact law is known.
    """

    faces: tuple[Face, ...]
    area: float
    face_stiffness: float | None = None

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

    def with_gaps_of(self, faces: Sequence[Face]) -> tuple[Support, Array]:
        """Return the supports with other gaps, and by how much the gap of each face grows, (faces,), m.

        Args:
            faces: The same faces with other gaps.

        Raises:
            ValueError: They are other faces.
        """
        if [(face.name, face.side) for face in faces] != [(face.name, face.side) for face in self.faces]:
            raise ValueError(f"the faces {[face.name for face in faces]}; expected {list(self.face_names)}")
        growth = np.array([new.gap - old.gap for new, old in zip(faces, self.faces, strict=True)])
        return replace(self, faces=tuple(faces)), growth

    def with_stiffness(self, face_stiffness: float) -> Support:
        """Return the supports with K of all contact points of a face together, N/m^n."""
        return replace(self, face_stiffness=face_stiffness)

    def _known_stiffness(self) -> float:
        if self.face_stiffness is None:
            raise ValueError("the stiffness of the support is known once its contact law is made")
        return self.face_stiffness
