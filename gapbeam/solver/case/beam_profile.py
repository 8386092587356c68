"""The beam along x: tables [beam], [material] and [[segment]], and the prismatic pieces that they make.

A beam without [[segment]] is one piece. Whoever needs a thickness, a stiffness or a density asks for the piece at the
place where it is needed, or for that of all pieces which is on the safe side.

A segment is a part of the beam with another outer size, section or material.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field

from gapbeam.meshes.sections.section_patches import CELLS_THROUGH, SectionPatches
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart
from gapbeam.solver.schema.table import AlongBeam, Name, Number, Positive, Table, named, placed_along
from gapbeam.solver.sections.section_choice import RECTANGLE, SectionChoice
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import BaseAndGland


class Beam(Table):
    """The outer dimensions of the beam, and its cross-section."""

    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("tension", "compression", "preload", "prestress", "pretension", "axial_force"),
        'files of structures have an axial preload: `tension` of a [[structure]] of type "beam" or "frame"',
    )

    length: Positive = Field(description="length along x, m", examples=[0.51])
    thickness: Positive = Field(description="size in the bending direction, m", examples=[0.012])
    width: Positive = Field(
        description="size across the bending plane, also in 2D: forces are whole ones, m; round sections: thickness",
        examples=[0.02],
    )
    section: Annotated[SectionChoice, BeforeValidator(named)] = Field(
        default=RECTANGLE, description="the cross-section: a name, or a table with the type and its keys"
    )

    @property
    def area(self) -> float:
        """Area of the cross-section, m^2."""
        return self.section.area(self.thickness, self.width)

    @property
    def second_moment(self) -> float:
        """Second moment of area of bending in the bending plane, m^4."""
        return self.section.second_moment(self.thickness, self.width)

    @property
    def gyration_radius(self) -> float:
        """Radius of gyration of the cross-section, sqrt(I / A), m."""
        return self.section.gyration_radius(self.thickness, self.width)

    @property
    def height(self) -> float:
        """Area over width: the height of material above a unit of the contact faces, m."""
        return self.section.height(self.thickness, self.width)

    @property
    def centroid(self) -> tuple[float, float]:
        """Place y and z of the centroid of the cross-section, from the axis, m."""
        return self.section.centroid(self.thickness, self.width)

    @property
    def rectangular(self) -> bool:
        """True for a solid rectangle, which a slice in the bending plane can represent."""
        return self.section == RECTANGLE

    @property
    def hollow(self) -> bool:
        """True where the axis of the beam lies outside the material."""
        return not self.contains(0.0, 0.0)

    def patches(self, through: int | None, across: int | None) -> SectionPatches | None:
        """Return the patches that a mesh of the section is made of; None: layers through thickness and width.

        Args:
            through: Cells through the thickness; None: the default.
            across: Cells across the width; None: the default.
        """
        counts = through or CELLS_THROUGH, across or CELLS_THROUGH
        return self.section.patches(self.thickness, self.width, *counts)

    def shear_coefficient(self, poisson_ratio: float) -> float:
        """Return the share kappa of the area that carries shear in the bending plane, no unit."""
        return self.section.shear_coefficient(self.thickness, self.width, poisson_ratio)

    @property
    def lateral_moment(self) -> float:
        """Second moment of area of bending across the bending plane, m^4."""
        return self.section.lateral_moment(self.thickness, self.width)

    def lateral_shear_coefficient(self, poisson_ratio: float) -> float:
        """Return the share kappa of the area that carries shear across the bending plane, no unit."""
        return self.section.lateral_shear_coefficient(self.thickness, self.width, poisson_ratio)

    @property
    def polar_moment(self) -> float:
        """Polar second moment of area about the axis, m^4."""
        return self.section.polar_moment(self.thickness, self.width)

    @property
    def torsion_constant(self) -> float:
        """J of Saint-Venant's torsion, m^4; None: the section has no figure."""
        return self.section.torsion_constant(self.thickness, self.width)

    def contains(self, y: float, z: float) -> bool:
        """Return whether a point of the plane of the section is in the material."""
        return self.section.contains(y, z, self.thickness, self.width)


class Material(Table):
    """Isotropic linear elasticity."""

    young_modulus: Positive = Field(description="Young's modulus, Pa", examples=[2.1e11])
    poisson_ratio: Number = Field(gt=-1.0, lt=0.5, description="Poisson ratio, no unit", examples=[0.3])
    density: Positive = Field(description="mass density, kg/m^3", examples=[7919.0])
    yield_stress: Positive | None = Field(
        default=None,
        description="stress beyond which a run warns, Pa; default none",
        examples=[3.55e8],
    )

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)), Pa."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))


OF_SECTION = ("thickness", "width", "section")
"""Keys that replace those of [beam]."""
OF_MATERIAL = ("young_modulus", "poisson_ratio", "density", "yield_stress")
"""Keys that replace those of [material]."""


class Segment(AlongBeam):
    """A [[segment]] without its place; keys that are not given keep the values of [beam] and [material]."""

    name: Name = Field(description="unique name", examples=["head"])
    thickness: Positive | None = Field(
        default=None,
        description="size in the bending direction there, m; default that of [beam]",
        examples=[0.02],
    )
    width: Positive | None = Field(
        default=None,
        description="size across the bending plane there, m; default that of [beam], of round sections thickness",
    )
    section: Annotated[SectionChoice | None, BeforeValidator(named)] = Field(
        default=None,
        description="the cross-section there: a name, or a table with the type and its keys; default that of [beam]",
    )
    young_modulus: Positive | None = Field(
        default=None, description="Young's modulus there, Pa; default that of [material]", examples=[7.0e10]
    )
    poisson_ratio: Number | None = Field(
        default=None, gt=-1.0, lt=0.5, description="Poisson ratio there, no unit; default that of [material]"
    )
    density: Positive | None = Field(
        default=None, description="mass density there, kg/m^3; default that of [material]", examples=[2700.0]
    )
    yield_stress: Positive | None = Field(
        default=None,
        description="stress beyond which a run warns there, Pa; default that of [material] if it gives no material",
    )

    def beam(self, whole: Beam) -> Beam:
        """Return a beam that is all along as it is in this segment.

        Args:
            whole: The table [beam].
        """
        own = {key: getattr(self, key) for key in OF_SECTION if getattr(self, key) is not None}
        section = own.get("section", whole.section)
        if section.round and "thickness" in own:
            own.setdefault("width", own["thickness"])
        return whole.model_copy(update=own) if own else whole

    def material(self, whole: Material) -> Material:
        """Return the material of this segment.

        Args:
            whole: The table [material]; its yield stress is not that of another material.
        """
        own = {key: getattr(self, key) for key in OF_MATERIAL if getattr(self, key) is not None}
        return whole.model_copy(update={"yield_stress": None} | own) if own else whole


PlacedSegment = placed_along(
    Segment,
    "PlacedSegment",
    "the segment",
    (0.2, 0.5),
    "A part of the beam with another outer size, section or material.",
)

ROUNDING = 1.0e-12  # of the length of the beam


def span_lies_on_the_beam(
    key: Key, one: AlongBeam | BaseAndGland, beam: Beam, what: str, needs: str
) -> Iterator[Fault]:
    """Yield the fault of a span that has no length, or ends beyond the beam.

    Args:
        key: The way to its table.
        one: The span.
        beam: The beam.
        what: The thing, such as "the support".
        needs: A hint where it begins at its end: why it has a length.
    """
    if one.length <= 0.0:
        end, start = apart(one.end, one.start)
        yield Fault(
            (*key, "to"),
            f"{end} m, where {what} begins at {start} m",
            f"more than from, {start} m",
            "swap them?" if one.length < 0.0 else needs,
            ((*key, "from"),),
        )
    elif one.end > beam.length * (1.0 + ROUNDING):
        end, length = apart(one.end, beam.length, ROUNDING)
        in_mm = one.end / 1000.0 <= beam.length < 0.1 * one.end
        yield Fault(
            (*key, "to"),
            f"{end} m, beyond the end of the beam",
            f"at most the length of the beam, {length} m",
            f"is it in mm? In m it is {one.end / 1000.0:g}" if in_mm else "coordinates are in m, from x = 0",
            (("beam", "length"),),
        )


@dataclass(frozen=True)
class BeamPiece:
    """A prismatic part of the beam.

    Attributes:
        start: Start along the beam, m.
        end: End along the beam, m.
        beam: A beam that is all along as this piece is, of the length of the whole beam.
        material: Material of the piece.
    """

    start: float
    end: float
    beam: Beam
    material: Material

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return self.material.density * (self.end - self.start) * self.beam.area

    @property
    def line_mass(self) -> float:
        """Mass per length, kg/m."""
        return self.material.density * self.beam.area

    @property
    def face_mass(self) -> float:
        """Mass above a unit of the contact faces, kg/m^2."""
        return self.material.density * self.beam.height

    @property
    def bending(self) -> float:
        """E I in the bending plane, N m^2."""
        return self.material.young_modulus * self.beam.second_moment

    def share(self, start: float, end: float) -> float:
        """Return the share of a part of the beam, from `start` to `end`, m, that lies in this piece."""
        return (min(self.end, end) - max(self.start, start)) / (end - start)


@dataclass(frozen=True)
class BeamProfile:
    """The pieces of a beam, in their order along it.

    Attributes:
        pieces: Pieces, at least one; each begins where the one before ends.
    """

    pieces: tuple[BeamPiece, ...]

    @classmethod
    def of(cls, beam: Beam, material: Material, segments: Iterable[Segment]) -> BeamProfile:
        """Return the profile of a beam; neighbors that are alike are one piece."""
        pieces = list[BeamPiece]()
        for start, end, segment in _parts(beam.length, segments):
            here = beam if segment is None else segment.beam(beam)
            made = material if segment is None else segment.material(material)
            if pieces and (pieces[-1].beam, pieces[-1].material) == (here, made):
                start = pieces.pop().start
            pieces.append(BeamPiece(start, end, here, made))
        return cls(tuple(pieces))

    @property
    def prismatic(self) -> bool:
        """True where cross-section and material are the same all along."""
        return len(self.pieces) == 1

    @property
    def one_section(self) -> bool:
        """True where the cross-section is the same all along."""
        return all(piece.beam == self.pieces[0].beam for piece in self.pieces)

    @property
    def one_material(self) -> bool:
        """True where the material is the same all along."""
        return all(piece.material == self.pieces[0].material for piece in self.pieces)

    def sliceable(self, width: float) -> bool:
        """Return whether a slice in the bending plane stands for the beam: solid rectangles, all of this width, m."""
        return all(piece.beam.rectangular and piece.beam.width == width for piece in self.pieces)

    @property
    def steps(self) -> tuple[float, ...]:
        """Places where one piece ends and the next one begins, m."""
        return tuple(piece.start for piece in self.pieces[1:])

    @property
    def mass(self) -> float:
        """Mass of the beam, kg."""
        return sum(piece.mass for piece in self.pieces)

    @property
    def middle(self) -> float:
        """Center of mass, m from x = 0."""
        if self.prismatic:
            return 0.5 * self.pieces[0].beam.length
        return sum(piece.mass * 0.5 * (piece.start + piece.end) for piece in self.pieces) / self.mass

    @property
    def thickest(self) -> float:
        """The largest thickness, m."""
        return max(piece.beam.thickness for piece in self.pieces)

    @property
    def thinnest(self) -> float:
        """The smallest thickness, m."""
        return min(piece.beam.thickness for piece in self.pieces)

    def at(self, x: float) -> BeamPiece:
        """Return the piece at a place; where two pieces meet, the one that begins there."""
        return next((piece for piece in reversed(self.pieces) if piece.start <= x), self.pieces[0])

    def between(self, start: float, end: float) -> tuple[BeamPiece, ...]:
        """Return the pieces of a part of the beam; that in its middle where it has no length."""
        found = tuple(piece for piece in self.pieces if piece.start < end and piece.end > start)
        return found or (self.at(0.5 * (start + end)),)

    def supported(self, layout: Layout) -> tuple[BeamPiece, ...]:
        """Return the pieces that lie in supports; all of them without any."""
        found = [piece for one in layout.supports for piece in self.between(one.start, one.end)]
        return tuple(dict.fromkeys(found)) or self.pieces

    def bending_speed(self, start: float, end: float) -> tuple[float, float]:
        """Return the radius of gyration, m, and the speed of waves, m/s, whose product is sqrt(E I / (rho A)).

        For several pieces they follow from mean mass and mean flexibility, and are a scale.

        Args:
            start: Start of a part of the beam, m.
            end: End of this part, m.
        """
        pieces = self.between(start, end)
        if len(pieces) == 1:
            (one,) = pieces
            return one.beam.gyration_radius, sqrt(one.material.young_modulus / one.material.density)
        shares = [piece.share(start, end) for piece in pieces]
        mass = sum(share * piece.line_mass for share, piece in zip(shares, pieces, strict=True))
        flexibility = sum(share / piece.bending for share, piece in zip(shares, pieces, strict=True))
        return sqrt(1.0 / (flexibility * mass)), 1.0

    def shear_speed(self, start: float, end: float) -> float:
        """Return the speed of shear waves sqrt(G / rho), m/s, which no bending wave exceeds.

        Of several pieces the speed follows from mean mass and mean flexibility. Arguments as in `bending_speed`.
        """
        mass = flexibility = 0.0
        for piece in self.between(start, end):
            share, material = piece.share(start, end), piece.material
            mass += share * piece.line_mass
            flexibility += share * material.density / (material.shear_modulus * piece.line_mass)
        return sqrt(1.0 / (flexibility * mass))


def beam_at(beam: Beam, segments: Iterable[Segment], x: float) -> Beam:
    """Return a beam that is all along as the given one is at a place."""
    inside = next((one for one in _ordered(segments) if one.start <= x < one.end), None)
    inside = inside or next((one for one in _ordered(segments) if one.end == x), None)
    return beam if inside is None else inside.beam(beam)


def _ordered(segments: Iterable[Segment]) -> list[Segment]:
    return sorted(segments, key=lambda one: one.start)


def _parts(length: float, segments: Iterable[Segment]) -> list[tuple[float, float, Segment | None]]:
    """Return start, end and segment of each part, those between the segments too."""
    ordered: Sequence[Segment] = _ordered(segments)
    if not ordered:
        return [(0.0, length, None)]
    found: list[tuple[float, float, Segment | None]] = [(0.0, ordered[0].start, None)]
    for one, after in pairwise(ordered):
        found += [(one.start, one.end, one), (one.end, after.start, None)]
    found += [(ordered[-1].start, ordered[-1].end, ordered[-1]), (ordered[-1].end, length, None)]
    return [part for part in found if part[1] - part[0] > 1.0e-12 * length]
