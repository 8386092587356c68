"""[[pair]] and [contact]: what touches what, in which region, by which law of forces."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.scene import shipped_laws
from gapbeam.solver.scene.convex_region import ConvexRegion, Disc, HalfPlane, Polygon, Slot
from gapbeam.solver.scene.force_law import ForceLaw
from gapbeam.solver.table import Name, NonNegative, Number, PointName, Positive, Switch, Table

Pair2 = tuple[Number, Number]


class HalfPlaneRegion(Table):
    """The side of a flat wall: normal . r <= clearance."""

    type: Literal["half-plane"] = Field(description="kind of region")
    clearance: Number = Field(description="distance to the wall at rest, m", examples=[1e-3])
    normal: Literal[1, -1] | Pair2 = Field(
        default=1, description="toward the wall: 1 or -1, or a vector for points of two motions, no unit"
    )

    def made(self) -> ConvexRegion:
        """Return the region."""
        return HalfPlane(self.clearance, self.normal)


class SlotRegion(Table):
    """Between two walls, for points of one motion."""

    type: Literal["slot"] = Field(description="kind of region")
    clearance: Number = Field(description="total play, m", examples=[2e-4])
    center: Number = Field(default=0.0, description="middle of the slot, m")

    def made(self) -> ConvexRegion:
        """Return the region."""
        return Slot(self.clearance, self.center)


class DiscRegion(Table):
    """A round hole around a round body, for points of two motions."""

    type: Literal["disc"] = Field(description="kind of region")
    clearance: Number = Field(description="radial play, m", examples=[1e-4])

    def made(self) -> ConvexRegion:
        """Return the region."""
        return Disc(self.clearance)


class PolygonRegion(Table):
    """A convex polygon, for points of two motions."""

    type: Literal["polygon"] = Field(description="kind of region")
    corners: tuple[Pair2, ...] = Field(
        min_length=3,
        max_length=30,
        description="corners, counter-clockwise, m",
        examples=[[[-1e-4, -1e-4], [1e-4, -1e-4], [0.0, 1e-4]]],
    )

    def made(self) -> ConvexRegion:
        """Return the region."""
        return Polygon(self.corners)


RegionOfPair = Annotated[HalfPlaneRegion | SlotRegion | DiscRegion | PolygonRegion, Field(discriminator="type")]


class LinearLaw(Table):
    """Spring and damper side by side, F = stiffness x + damping x', never negative."""

    type: Literal["kelvin-voigt"] = Field(description="name of the law")
    stiffness: Positive = Field(description="N/m", examples=[1e7])
    damping: NonNegative = Field(default=0.0, description="N s/m")

    def made(self) -> ForceLaw:
        """Return the law."""
        return shipped_laws.KelvinVoigt(stiffness=self.stiffness, damping=self.damping)


class PowerLaw(Table):
    """F = stiffness x^exponent (1 + chi x')."""

    type: Literal["hunt-crossley"] = Field(description="name of the law")
    stiffness: Positive = Field(description="N/m^exponent", examples=[1e9])
    chi: NonNegative = Field(default=0.0, description="damping, s/m")
    exponent: Number = Field(default=1.5, ge=1.0, le=10.0, description="no unit")

    def made(self) -> ForceLaw:
        """Return the law."""
        return shipped_laws.HuntCrossley(self.stiffness, self.chi, self.exponent)


class CubicLaw(Table):
    """F = stiffness (x + x^3 / scale^2): a bumper that stiffens."""

    type: Literal["cubic"] = Field(description="name of the law")
    stiffness: Positive = Field(description="at touch, N/m", examples=[1e5])
    scale: Positive = Field(description="penetration at which the force is doubled, m", examples=[1e-3])

    def made(self) -> ForceLaw:
        """Return the law."""
        return shipped_laws.Cubic(stiffness=self.stiffness, scale=self.scale)


LawOfPair = Annotated[LinearLaw | PowerLaw | CubicLaw, Field(discriminator="type")]


class PairContact(Table):
    """Default law and friction of pairs."""

    law: LawOfPair | None = Field(default=None, description="law of forces, a table; default none: each pair has one")
    friction: NonNegative = Field(default=0.0, description="coefficient of friction, no unit")
    sliding: NonNegative = Field(
        default=0.0, description="speed at which friction reaches 0.71 of its limit, m/s; 0: it sticks without creep"
    )


class PairTable(Table):
    """A contact of two points, or of a point and the frame: the motion of the first relative to the second."""

    name: Name = Field(description="name in results, different for every pair", examples=["gap"])
    between: tuple[PointName] | tuple[PointName, PointName] = Field(
        description="the point that stays in the region, and the point that carries the region, else the frame; two "
        "structures where at says so",
        examples=[["tube.tip", "bar.edge"]],
    )
    at: Literal["nearest"] | None = Field(
        default=None, description="nearest: between names two structures, which touch at their nearest places"
    )
    region: RegionOfPair | None = Field(
        default=None,
        description="region of the first, a table with the type and its keys; at nearest places default a half "
        "plane at the distance between the surfaces",
    )
    law: LawOfPair | None = Field(default=None, description="law of forces, a table; default that of [contact]")
    friction: NonNegative | None = Field(default=None, description="coefficient, no unit; default that of [contact]")
    sliding: NonNegative | None = Field(default=None, description="see [contact], m/s; default that of [contact]")
    offset: Number | Pair2 = Field(default=0.0, description="place in the region at rest, one number a motion, m")
    interference: Switch = Field(default=False, description="whether the pair may be pressed at rest")
