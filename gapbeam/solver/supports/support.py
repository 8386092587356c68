"""The supports: the rigid faces that the beam touches, with sides, gaps, area and stiffness, and their bodies.

Planes are met along the bending axis e (y in 2D, z in 3D). A contact point at height h = e . x of a face whose plane
stands at the level z has the gap

    g = s (h - z),    s = +1 for a plane below the beam, -1 for a plane above it

The plane stands the initial gap of the face away from the outermost point of the undeformed beam there; where that gap
is negative, the undeformed beam reaches into the face. A plane with the tilt t rises along the beam: z + t (x - x_m)
with x_m its middle. Other faces have a type of their own, such as those of `regions.around_face`.

    m q'' + c q' + k q = f_contact + f_loads

The faces of the support move with q: along the bending axis, and of supports around the beam across it, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi, sqrt
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gapbeam.solver.schema.table import NonNegative, Number, Positive, Table

Array = NDArray[np.float64]
Indices = NDArray[np.integer]


@dataclass(frozen=True)
class Face:
    """One rigid plane of a support, base of other faces.

    Attributes:
        name: Name in the mesh, in results and in messages.
        side: s, +1 below the beam and -1 above it: the motion along the bending axis that opens the gap.
        gap: Distance from this plane to the outermost point of the undeformed beam, of any sign, m.
        tilt: Rise of the face along the beam, no unit.
        middle: Place along the beam at which its height is that of an even face, m.
    """

    name: str
    side: float
    gap: float = 0.0
    tilt: float = 0.0
    middle: float = 0.0

    around: ClassVar[bool] = False
    """True where the face is met all around the beam, not along the bending axis."""

    @property
    def carries(self) -> bool:
        """True where a beam with weight can rest on the face."""
        return self.side > 0.0

    @property
    def circle(self) -> bool:
        """True where the face is met as a circle, `gapbeam.solver.contact.formulations.circle_contact`."""
        return False

    @property
    def shape(self) -> dict[str, Any]:
        """Shape of the face in results, besides its name, side and gap."""
        return {"tilt": self.tilt} if self.tilt else {}

    @property
    def smallest(self) -> float:
        """The smallest gap of the undeformed beam in the middle of the support, m."""
        return self.gap

    def room(self, x: float, lateral: float, height: float) -> float:
        """Return the smallest gap at x that is left to an undeformed beam whose axis is moved there, m.

        Args:
            x: Place along the beam, m.
            lateral: Offset of the axis toward +y, m.
            height: Offset of the axis along the bending direction, m.
        """
        del lateral
        return self.gap + self.side * (height - self.tilt * (x - self.middle))

    def rise(self, positions: Array) -> Array:
        """Return by how much the face stands higher than in its middle, t (x - x_m), (m,), m."""
        return np.asarray(self.tilt * (positions[:, 0] - self.middle))

    def gaps(self, positions: Array) -> Array:
        """Return the gaps of the undeformed body, (m,), m.

        Args:
            positions: Contact points of this face, (m, dimension), m.
        """
        heights = positions[:, -1]
        outermost = heights.min() if self.side > 0.0 else heights.max()
        level = outermost - self.side * self.gap
        return np.asarray(self.side * (heights - level - self.rise(positions)))

    def meets(self, positions: Array) -> NDArray[np.bool_]:
        """Return True for contact points that can touch the face, (m,)."""
        return np.ones(len(positions), dtype=bool)

    def opening(self, positions: Array) -> Array:
        """Return the unit vectors along which motion of contact points opens their gaps, (m, dimension)."""
        along = np.zeros(positions.shape)
        along[:, -1] = self.side
        return along

    def growth(self, old: Face, positions: Array) -> Array:
        """Return by how much the gaps of contact points are larger than those of the same face as it was, (m,), m."""
        return self.gap - old.gap - self.side * (self.rise(positions) - old.rise(positions))


def along_faces(opening: Array, around: NDArray[np.bool_]) -> list[Array]:
    """Return unit vectors along faces, (m, dimension) each: along the beam and, in 3D, across or around it.

    Args:
        opening: Unit vectors that open the gaps, (m, dimension).
        around: Whether the point is met all around the beam, (m,).
    """
    count, dimension = opening.shape
    along, across = np.zeros((count, dimension)), np.zeros((count, dimension))
    along[:, 0] = 1.0
    if dimension == 2:
        return [along]
    across[:, 1] = 1.0
    across[around, 1], across[around, 2] = -opening[around, 2], opening[around, 1]
    return [along, across]


@dataclass(frozen=True)
class Support:
    """The faces of all supports of a beam, and their shared values.

    Attributes:
        faces: The faces.
        area: Area of all faces together, m^2.
        face_stiffness: K of all contact points of one face together, N/m^n; None before the contact law is known.
    """

    faces: tuple[Face, ...]
    area: float
    face_stiffness: float | None = None

    @property
    def around(self) -> bool:
        """True where a face is met all around the beam."""
        return any(face.around for face in self.faces)

    @cached_property
    def face_names(self) -> tuple[str, ...]:
        """Names of the faces."""
        return tuple(face.name for face in self.faces)

    @property
    def face_area(self) -> float:
        """Mean area of a face, m^2."""
        return self.area / len(self.faces)

    @property
    def stiffness_per_area(self) -> float:
        """K of the contact per area of a face, also where contact acts at points, Pa/m^n."""
        if self.face_stiffness is None:
            raise ValueError("the stiffness of the support is known once its contact law is made")
        return self.per_face_area(self.face_stiffness)

    def per_face_area(self, stiffness: float) -> float:
        """Return a stiffness of all contact points of a face together as one per area of the face."""
        return stiffness / self.face_area

    def with_gaps_of(self, faces: Sequence[Face], owners: Indices, positions: Array) -> tuple[Support, Array]:
        """Return the supports with other gaps, and by how much the gap of each contact point grows, (m,), m.

        Args:
            faces: The same faces with other gaps.
            owners: Index of the face of each contact point, (m,).
            positions: Contact points, (m, 3), m.

        Raises:
            ValueError: The faces are others.
        """
        if [(face.name, face.side) for face in faces] != [(face.name, face.side) for face in self.faces]:
            raise ValueError(f"the faces {[face.name for face in faces]}; expected {list(self.face_names)}")
        growth = np.zeros(len(owners))
        for number, (new, old) in enumerate(zip(faces, self.faces, strict=True)):
            growth[owners == number] = new.growth(old, positions[owners == number])
        return replace(self, faces=tuple(faces)), growth

    def opening(self, owners: Indices, positions: Array) -> Array:
        """Return the unit vectors along which motion of contact points opens their gaps, (m, dimension).

        Args:
            owners: Index of the face of each contact point, (m,).
            positions: Contact points, (m, dimension), m.
        """
        found = np.empty(positions.shape)
        for number, face in enumerate(self.faces):
            found[owners == number] = face.opening(positions[owners == number])
        return found

    def named(self, name: str) -> Face:
        """Return the face with a name."""
        return next(face for face in self.faces if face.name == name)

    def with_stiffness(self, face_stiffness: float) -> Support:
        """Return the supports with K of all contact points of a face together, N/m^n."""
        return replace(self, face_stiffness=face_stiffness)


class SupportBody(Table):
    """A mass on a spring and a damper that carries a support: along the bending axis, and around the beam across it."""

    mass: Positive = Field(description="mass m that moves with the faces of the support, kg", examples=[0.05])
    stiffness: Positive = Field(
        description="stiffness k of the spring to the frame, in both directions of a support around the beam, N/m",
        examples=[2.0e5],
    )
    damping: NonNegative = Field(default=0.0, description="damping c of the damper beside it, N s/m", examples=[10.0])
    displacement: Literal["rest"] | Number = Field(
        default=0.0,
        description='displacement at t = 0, upward, from the seat or from relaxed springs, m; "rest": where '
        "the body rests without the beam",
        examples=[-1.0e-3],
    )
    velocity: Number = Field(
        default=0.0, description="velocity at t = 0 along the bending axis, upward, m/s", examples=[0.1]
    )

    @property
    def moved(self) -> bool:
        """True where the body has a start of its own."""
        return self.displacement != 0.0 or self.velocity != 0.0

    @property
    def frequency(self) -> float:
        """Frequency of the mass on its spring, without the beam, Hz."""
        return sqrt(self.stiffness / self.mass) / (2.0 * pi)
