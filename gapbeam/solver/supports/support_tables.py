"""Tables of supports: [support], the base and gland at x = 0; keys of every [[support]] along the beam; their play.

The contact law that a [[support]] may name besides is in `gapbeam.solver.case.case`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field

from gapbeam.solver.schema.table import AlongBeam, Name, NonNegative, Number, Positive, Table, named
from gapbeam.solver.supports.regions.around_face import AroundFace
from gapbeam.solver.supports.regions.region import Placement, Region, Slot
from gapbeam.solver.supports.regions.region_choice import RegionChoice
from gapbeam.solver.supports.support import Face, SupportBody

PLAY = ("clearance", "offset", "lateral", "tilt")
"""Keys of a [[support]] that change its gaps alone."""
WHOLE = ("support_stiffness", "support_damping")
"""Keys of a [[support]] that give figures of the contact of the whole support, and not per area."""
OWN_CONTACT = ("stiffness", "damping", *WHOLE, "friction", "static_friction", "wear", "area", "depth_limit")
"""Keys of a [[support]] that replace those of [contact] and [wear]."""


class BaseAndGland(Table):
    """The support region 0 <= x <= length between base and gland."""

    sides: ClassVar[tuple[float, ...]] = (1.0, -1.0)
    brings_stiffness: ClassVar[bool] = False

    length: Positive = Field(description="length of the supported part from x = 0, m", examples=[0.05])
    clearance: Number = Field(
        description="pad thickness minus beam thickness, negative for an interference fit, m",
        examples=[0.107e-3],
    )

    name: ClassVar[str] = "support"
    start: ClassVar[float] = 0.0
    offset: ClassVar[float] = 0.0
    lateral: ClassVar[float] = 0.0
    tilt: ClassVar[float] = 0.0
    region: ClassVar[Region] = Slot(type="slot")
    around: ClassVar[bool] = False
    stiffness: ClassVar[None] = None
    damping: ClassVar[None] = None
    support_stiffness: ClassVar[None] = None
    support_damping: ClassVar[None] = None
    friction: ClassVar[None] = None
    static_friction: ClassVar[None] = None
    wear: ClassVar[None] = None
    area: ClassVar[None] = None
    depth_limit: ClassVar[None] = None
    body: ClassVar[None] = None

    @property
    def end(self) -> float:
        """End of the support, m."""
        return self.length

    @property
    def faces(self) -> tuple[Face, ...]:
        """The base touches the undeformed beam, and the gland stands the clearance above it."""
        return self.faces_at(Placement(self.clearance))

    def faces_at(self, placed: Placement) -> tuple[Face, ...]:
        """Return base and gland at another place."""
        return Face("base", 1.0, 0.0 - placed.offset), Face("gland", -1.0, placed.clearance + placed.offset)

    @property
    def met_region(self) -> Region:
        """The slot."""
        return self.region

    def impact_mass(self, beam: float, _width: float) -> float:
        """Return the mass of an impact per area, kg/m^2: the mass of the beam there."""
        return beam

    def without_play(self) -> BaseAndGland:
        """Return the support with everything taken out that changes its gaps and its contact law alone."""
        return self.model_copy(update={"clearance": 0.0})


class OneOfSeveral(AlongBeam):
    """A [[support]] without its place: its play, and its own contact where the material differs."""

    name: Name = Field(description="unique name, in results and messages", examples=["baffle"])
    clearance: Number = Field(
        description="play: total between both planes of a slot; distance to a stop; radial in a hole, polygon or "
        "profile; negative for an interference fit, m",
        examples=[0.2e-3],
    )
    offset: Number = Field(default=0.0, description="offset upward from the axis of the beam, m")
    lateral: Number = Field(default=0.0, description="offset of a support around the beam toward +y, m")
    tilt: Number = Field(
        default=0.0,
        ge=-0.1,
        le=0.1,
        description="rise of the support along the beam, about its middle, m per m, no unit",
    )
    region: Annotated[RegionChoice, BeforeValidator(named)] = Field(
        default=Slot(type="slot"), description="shape of the support's play: a name, or a table with the type"
    )
    stiffness: Positive | None = Field(
        default=None,
        description="contact stiffness K per area, instead of contact.stiffness (with an exponent n Pa/m^n), Pa/m",
        examples=[2.0e9],
    )
    damping: NonNegative | None = Field(
        default=None,
        description="damping of the law kelvin-voigt per area, instead of contact.damping, Pa s/m",
    )
    support_stiffness: Positive | None = Field(
        default=None,
        description="stiffness k of the whole support, F = k d of a beam that lies on its length, instead of "
        "stiffness (with an exponent n N/m^n), N/m",
        examples=[5.0e6],
    )
    support_damping: NonNegative | None = Field(
        default=None,
        description="damping of the whole support in the law kelvin-voigt, instead of damping, N s/m",
    )
    friction: Number | None = Field(
        default=None,
        ge=0,
        le=100,
        description="coefficient of friction mu, instead of contact.friction.coefficient, no unit",
    )
    static_friction: Number | None = Field(
        default=None,
        ge=0,
        le=100,
        description="coefficient of friction of points that stick, no unit; default friction, else "
        "contact.friction.static_coefficient",
    )
    wear: NonNegative | None = Field(
        default=None,
        description="Archard's coefficient, instead of wear.coefficient, 1/Pa",
    )
    area: Positive | None = Field(default=None, description="worn area of each face, instead of wear.area, m^2")
    depth_limit: Positive | None = Field(
        default=None,
        description="depth at which the life of a face ends, instead of wear.depth_limit, m",
    )
    body: SupportBody | None = Field(
        default=None, description="mass, spring and damper of a support that gives way, a table; default none: rigid"
    )

    @property
    def sides(self) -> tuple[float, ...]:
        """The sides of the beam on which its region is bounded."""
        return self.region.sides

    @property
    def around(self) -> bool:
        """True for a hole, met all around the beam."""
        return any(face.around for face in self.faces)

    @property
    def faces(self) -> tuple[Face, ...]:
        """The faces of the region, named after the support and where they are: front_below."""
        middle = 0.5 * (self.start + self.end)
        return self.faces_at(Placement(self.clearance, self.offset, self.lateral, self.tilt, middle))

    def faces_at(self, placed: Placement) -> tuple[Face, ...]:
        """Return the faces at another place."""
        return self.met_region.faces(self.name, placed)

    @property
    def met_region(self) -> Region:
        """The region as the beam meets it: with the stiffness of the whole support a round hole is a circle."""
        return self.region if self.support_stiffness is None else self.region.of_whole()

    @property
    def brings_stiffness(self) -> bool:
        """True for a support with its own stiffness, per area or as a whole."""
        return self.stiffness is not None or self.support_stiffness is not None

    def impact_mass(self, beam: float, width: float) -> float:
        """Return the mass of an impact per area, kg/m^2: a b / (a + b) of beam and body, a without a body.

        Args:
            beam: Mass of the beam per area of the face, a, kg/m^2.
            width: Width of the beam, m.
        """
        if self.body is None:
            return beam
        body = self.body.mass / (self.length * width)
        return beam * body / (beam + body)

    def without_play(self) -> OneOfSeveral:
        """Return the support with everything taken out that changes its gaps, its contact law and its body alone.

        Its contact points depend on whether the stiffness of the whole support is given, and not on its size.
        """
        taken = {**dict.fromkeys(PLAY, 0.0), **dict.fromkeys(OWN_CONTACT), "body": None}
        return self.model_copy(update=taken if self.support_stiffness is None else taken | {"support_stiffness": 1.0})


OneSupport = BaseAndGland | OneOfSeveral

AnySupports = BaseAndGland | tuple[OneOfSeveral, ...] | Mapping[int, OneOfSeveral]
"""The supports of a case, or those of its entries that have no faults of their own, by number."""


def without_play(support: BaseAndGland | tuple[OneOfSeveral, ...]) -> BaseAndGland | tuple[OneOfSeveral, ...]:
    """Return the supports of a case with all taken out that changes their gaps, contact laws and bodies alone."""
    return support.without_play() if isinstance(support, BaseAndGland) else tuple(one.without_play() for one in support)


@dataclass(frozen=True)
class Play:
    """The play of one support.

    Attributes:
        height: Middle along the bending direction, from the axis of the undeformed beam, m; in the middle
            of the support, where this is tilted.
        lateral: Offset toward +y, m; None: the support does not bound the beam sideways.
        half: Distance that the beam can move from there before it touches, in the nearest direction, m; negative for an
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
