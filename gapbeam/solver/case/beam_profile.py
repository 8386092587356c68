"""The beam along x: its prismatic pieces, each with its cross-section and material.

A beam without [[segment]] is one piece. Whoever needs a thickness, a stiffness or a density asks for the piece at the
place where it is needed, or for that of all pieces which is on the safe side.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

from gapbeam.solver.case.beam_table import Beam, Material
from gapbeam.solver.case.segment_table import Segment
from gapbeam.solver.supports.layout import Layout


@dataclass(frozen=True)
class BeamPiece:
    """A prismatic part of the beam.

    Attributes:
        start: Where it begins along the beam, m.
        end: Where it ends, m.
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


@dataclass(frozen=True)
class BeamProfile:
    """The pieces of a beam, in their order along it.

    Attributes:
        pieces: At least one; each begins where the one before ends.
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

    def relative_mass(self, beam: Beam, material: Material) -> float:
        """Return the mass over that of a beam without segments."""
        return self.mass / (material.density * beam.length * beam.area)

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

    @property
    def widest(self) -> float:
        """The largest width, m."""
        return max(piece.beam.width for piece in self.pieces)

    @property
    def softest_bending(self) -> float:
        """The smallest E I, N m^2."""
        return min(piece.bending for piece in self.pieces)

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
            start: Where a part of the beam begins, m.
            end: Where it ends, m.
        """
        pieces = self.between(start, end)
        if len(pieces) == 1:
            (one,) = pieces
            return one.beam.gyration_radius, sqrt(one.material.young_modulus / one.material.density)
        shares = [(min(piece.end, end) - max(piece.start, start)) / (end - start) for piece in pieces]
        mass = sum(share * piece.line_mass for share, piece in zip(shares, pieces, strict=True))
        flexibility = sum(share / piece.bending for share, piece in zip(shares, pieces, strict=True))
        return sqrt(1.0 / (flexibility * mass)), 1.0


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
