"""The parts of a beam whose cross-section changes along it."""

from __future__ import annotations

from typing import NamedTuple

from gapbeam.meshes.sections.section_patches import SectionPatches


class BeamStep(NamedTuple):
    """A part of a beam with one cross-section.

    Attributes:
        start: Where it begins along the beam, m.
        end: Where it ends, m.
        thickness: Its size in the bending direction, m.
        width: Its size across the bending plane, m.
        section: Its cross-section, of patches of the section of the whole beam; None: it fills thickness and width.
        filled: Which patches of the section of the whole beam those are; () without a section.
    """

    start: float
    end: float
    thickness: float
    width: float
    section: SectionPatches | None = None
    filled: tuple[bool, ...] = ()
