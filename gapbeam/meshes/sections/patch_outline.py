"""The outline of a cross-section from its patches: the sides that only one patch has, joined to loops."""

from __future__ import annotations

from collections import Counter
from math import atan2, ceil, cos, hypot, pi, sin

from gapbeam.meshes.sections.polygon_outline import Loop, PolygonOutline, signed_area
from gapbeam.meshes.sections.section_curve import Place, SectionCurve
from gapbeam.meshes.sections.section_patches import SectionPatches

CHORD = pi / 90.0  # rad: angle of a chord of an arc


def outline_of(patches: SectionPatches) -> PolygonOutline:
    """Return the outline of the cross-section that patches fill, arcs as chords.

    Args:
        patches: About the axis of the beam.

    Raises:
        ValueError: The free sides of the patches form no closed loops.
    """
    uses = Counter(number for patch in patches.patches for number, _ in patch)
    free = [patches.curves[number] for patch in patches.patches for number, _ in patch if uses[number] == 1]
    backward = [turned for patch in patches.patches for number, turned in patch if uses[number] == 1]
    following = {
        (curve.end if turned else curve.start): _places(curve, turned)
        for curve, turned in zip(free, backward, strict=True)
    }
    if len(following) != len(free):
        raise ValueError("two loops of free sides of the patches meet at one point")
    loops: list[Loop] = []
    while following:
        loop: list[Place] = []
        place = next(iter(following))
        while place in following:
            *passed, place = following.pop(place)
            loop += passed
        if place != loop[0]:
            raise ValueError(f"the free sides of the patches end at y = {place[0]:g}, z = {place[1]:g} m")
        loops.append(tuple(loop))
    outer, *holes = sorted(loops, key=lambda one: -abs(signed_area(one)))
    return PolygonOutline.of(outer, holes)


def _places(curve: SectionCurve, backward: bool) -> list[Place]:
    """Return the ends of a side with points between them on an arc, in the direction of its patch."""
    start, end = (curve.end, curve.start) if backward else (curve.start, curve.end)
    if not curve.arc:
        return [start, end]
    radius, first = hypot(*start), atan2(start[1], start[0])
    turn = (atan2(end[1], end[0]) - first + pi) % (2.0 * pi) - pi
    count = ceil(abs(turn) / CHORD)
    angles = [first + turn * number / count for number in range(1, count)]
    return [start, *((radius * cos(angle), radius * sin(angle)) for angle in angles), end]
