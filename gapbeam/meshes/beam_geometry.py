"""Geometry of the beam to be meshed: outer dimensions, segments, supports, groups, and points that become mesh nodes.

Frame: the beam axis is x, 0 <= x <= length, with the supported end at x = 0. The bending direction is y in 2D
and z in 3D, across the thickness; y is across the width in 3D. The axis of the beam is where these are zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeVar

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_patches import SectionPatches
from gapbeam.solver.messages.wording import counted


class ContactSpan(NamedTuple):
    """Facets of the upper or lower surface of a beam between two places along it.

    Attributes:
        name: Name of the group of facets.
        below: Whether they belong to the lower surface.
        start: Start along the beam, m.
        end: End along the beam, m.
        around: Whether they belong to both surfaces of a round section, all around it.
    """

    name: str
    below: bool
    start: float
    end: float
    around: bool = False


class BeamStep(NamedTuple):
    """A part of a beam with one cross-section.

    Attributes:
        start: Start along the beam, m.
        end: End along the beam, m.
        thickness: Its size in the bending direction, m.
        width: Its size across the bending plane, m.
        section: Its cross-section, of patches of the section of the whole beam; None: it fills thickness and width.
        filled: Indices of these patches in the section of the whole beam; () without a section.
    """

    start: float
    end: float
    thickness: float
    width: float
    section: SectionPatches | None = None
    filled: tuple[bool, ...] = ()


Part = TypeVar("Part", ContactSpan, BeamStep)

SNAP = 1.0e-9
"""Coordinates this close to each other, relative to the thickness, are taken to be the same."""

CLOSEST = 1.0e-4
"""Different coordinates along an axis are at least this far apart, relative to the thickness."""


@dataclass(frozen=True)
class BeamGeometry:
    """A straight beam, dimensions in m.

    Attributes:
        dimension: 2 for a slice in the bending plane, 3 for the solid beam.
        length: size along x.
        thickness: size in the bending direction; the largest one of a beam with steps.
        width: size across the bending plane, the largest one; in 2D it is not meshed.
        support_length: base and gland reach from x = 0 to here; with spans, where the last of them ends.
        points: coordinates, `dimension` of them each, that fall on mesh nodes.
        spans: regions that face a support; () stands for base and gland.
        section: the cross-section within thickness and width, 3D; None: it fills them. Of a beam with steps, the
            patches of all its cross-sections.
        steps: the parts of a beam whose cross-section changes, from x = 0 to its length; (): it does not.
        breaks: further places along the beam at which cells end, such as those where the material changes.

    Raises:
        MeshError: a dimension is not a positive number, the support is longer than the beam, or a point is
            outside of the beam.
    """

    dimension: int
    length: float
    thickness: float
    width: float
    support_length: float
    points: tuple[tuple[float, ...], ...] = ()
    spans: tuple[ContactSpan, ...] = ()
    section: SectionPatches | None = None
    steps: tuple[BeamStep, ...] = ()
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise MeshError("mesh.dimension", found=str(self.dimension), expected="2 or 3")
        for name in ("length", "thickness", "width", "support_length"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise MeshError(f"beam {name}", found=f"{value} m", expected="a positive length in m")
        if self.support_length > self.length * (1 + 1e-12):
            raise MeshError(
                "support length",
                found=f"{self.support_length:.15g} m",
                expected=f"at most the length of the beam, {self.length:.15g} m",
            )
        # coordinates that are the same up to rounding become the same: faces, the end of the support, points
        planes = [list(pair) for pair in zip(self.lower, self.upper, strict=True)]
        object.__setattr__(self, "support_length", self._same(self.support_length, planes[0]))
        planes[0].append(self.support_length)
        if not self.spans:
            whole = (0.0, self.support_length)
            spans: tuple[ContactSpan, ...] = (ContactSpan("base", True, *whole), ContactSpan("gland", False, *whole))
        else:
            spans = tuple(self._snapped(span, planes[0]) for span in self.spans)
        object.__setattr__(self, "spans", spans)
        object.__setattr__(self, "steps", tuple(self._snapped(step, planes[0]) for step in self.steps))
        breaks = []
        for place in self.breaks:
            breaks.append(self._same(place, planes[0]))
            planes[0].append(breaks[-1])
        object.__setattr__(self, "breaks", tuple(breaks))
        points = []
        for point in self.points:
            self._check(point)
            points.append(tuple(map(self._same, point, planes)))
            for plane, value in zip(planes, points[-1], strict=True):
                plane.append(value)
        object.__setattr__(self, "points", tuple(points))

    @property
    def lower(self) -> tuple[float, ...]:
        """The corner of the bounding box with the smallest coordinates."""
        return (0.0, *(-side / 2 for side in self._section()))

    @property
    def upper(self) -> tuple[float, ...]:
        """The corner of the bounding box with the largest coordinates."""
        return (self.length, *(side / 2 for side in self._section()))

    @property
    def volume(self) -> float:
        """Volume in m^3; in 2D the area in m^2."""
        if self.steps and self.dimension == 2:
            return sum((step.end - step.start) * step.thickness for step in self.steps)
        return math.prod(high - low for low, high in zip(self.lower, self.upper, strict=True))

    @property
    def edges(self) -> tuple[float, ...]:
        """Ends of supports, cross-sections and materials within the beam, increasing."""
        found = {place for span in self.spans for place in (span.start, span.end)}
        found |= {step.start for step in self.steps} | set(self.breaks)
        return tuple(sorted(found - {0.0, self.length}))

    def at(self, x: float) -> BeamStep:
        """Return the part of the beam at a place."""
        if not self.steps:
            return BeamStep(0.0, self.length, self.thickness, self.width, self.section)
        return next((step for step in reversed(self.steps) if step.start <= x), self.steps[0])

    @property
    def parts(self) -> tuple[tuple[float, float, bool], ...]:
        """The parts of the beam between its ends and the edges of supports: start, end, whether it is supported."""
        return tuple(
            (start, end, any(span.start <= start and end <= span.end for span in self.spans))
            for start, end in pairwise((0.0, *self.edges, self.length))
        )

    def breakpoints(self, axis: int) -> tuple[float, ...]:
        """Increasing coordinates along an axis at which cells must end: faces, end of the support, points.

        Raises:
            MeshError: two of them almost coincide, which would force a sliver between them.
        """
        edges = self.edges if axis == 0 else self._levels(axis)
        values = (self.lower[axis], self.upper[axis], *edges, *(point[axis] for point in self.points))
        ordered = sorted(set(values))
        for low, high in pairwise(ordered):
            if high - low < CLOSEST * self.thickness:
                name = "xyz"[axis]
                raise MeshError(
                    f"points along {name}",
                    found=f"{name} = {low:.12g} m and {name} = {high:.12g} m",
                    expected=f"the same value, or at least {CLOSEST * self.thickness:.2g} m between them",
                    hint="The ends of the beam and of the support count as points.",
                )
        return tuple(ordered)

    def _snapped(self, part: Part, known: list[float]) -> Part:
        """A part whose ends are known coordinates where they are the same up to rounding."""
        ends = []
        for place in (part.start, part.end):
            ends.append(self._same(place, known))
            known.append(ends[-1])
        return part._replace(start=ends[0], end=ends[1])

    def _levels(self, axis: int) -> tuple[float, ...]:
        """Heights of the surfaces of thinner parts across a slice."""
        if axis != self.dimension - 1:
            return ()
        return tuple(side * step.thickness for step in self.steps for side in (-0.5, 0.5))

    def _section(self) -> tuple[float, ...]:
        return (self.thickness,) if self.dimension == 2 else (self.width, self.thickness)

    def _same(self, value: float, known: list[float]) -> float:
        """The known coordinate that the value stands for, or else the value."""
        near = SNAP * self.thickness
        return next((other for other in known if abs(value - other) <= near), float(value))

    def _check(self, point: tuple[float, ...]) -> None:
        if len(point) != self.dimension:
            raise MeshError(
                f"point {_shown(point)}",
                found=f"{counted(len(point), 'coordinate')}",
                expected=f"{self.dimension}, as the mesh has dimension {self.dimension}",
            )
        near = SNAP * self.thickness
        for value, low, high in zip(point, self.lower, self.upper, strict=True):
            if not low - near <= value <= high + near:  # refuses NaN as well
                raise MeshError(
                    f"point {_shown(point)}",
                    found="a point outside of the beam",
                    expected=f"a point between {_shown(self.lower)} and {_shown(self.upper)}",
                    hint="x = 0 is the supported end; the other coordinates are measured from the beam axis.",
                )


def _shown(point: tuple[float, ...]) -> str:
    return f"({', '.join(f'{value:g}' for value in point)})"


BODY = "body"
"""The group of all cells."""

ENDS = {"end": 3, "tip": 4}
"""Facets across the beam and their tags in meshes that gapbeam builds; end is at x = 0, tip at x = length."""

_FIRST_TAGS, _FURTHER_TAGS = (1, 2), 11


def contact_faces(geometry: BeamGeometry) -> tuple[str, ...]:
    """Return the names of the groups of facets that face a support."""
    return tuple(span.name for span in geometry.spans)


def groups_of(geometry: BeamGeometry) -> dict[str, int]:
    """Return all groups of facets and their tags in meshes that gapbeam builds."""
    names = contact_faces(geometry)
    tags = (*_FIRST_TAGS, *range(_FURTHER_TAGS, _FURTHER_TAGS + len(names)))
    return dict(zip(names, tags, strict=False)) | ENDS
