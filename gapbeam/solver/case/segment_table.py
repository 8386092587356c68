"""[[segment]]: a part of the beam with another outer size, another section or another material; places on the beam."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Protocol

from pydantic import BeforeValidator, Field

from gapbeam.solver.case.beam_table import Beam, Material
from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.sections.section_choice import SectionChoice
from gapbeam.solver.table import AlongBeam, Name, Number, Positive, named, placed_along
from gapbeam.solver.wording.short_words import apart

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

    @property
    def changes_section(self) -> bool:
        """True where the segment gives any dimension of a cross-section."""
        return any(getattr(self, key) is not None for key in OF_SECTION)

    @property
    def changes_material(self) -> bool:
        """True where the segment gives any property of a material."""
        return any(getattr(self, key) is not None for key in OF_MATERIAL)

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
    "A part of the beam, from x = from to x = to, with another outer size, section or material.",
)

ROUNDING = 1.0e-12  # of the length of the beam


class Reach(Protocol):
    """A part of the beam."""

    @property
    def start(self) -> float:
        """Start along the beam, m."""

    @property
    def end(self) -> float:
        """End along the beam, m."""

    @property
    def length(self) -> float:
        """The difference, m."""


def span_lies_on_the_beam(key: Key, one: Reach, beam: Beam, what: str, needs: str) -> Iterator[Fault]:
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
