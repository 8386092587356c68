"""Contradictions in the resultants of a case, [contact] points and patch."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from gapbeam.solver.case.beam_profile import beam_at
from gapbeam.solver.case.case import Beam, Mesh
from gapbeam.solver.case.checks.place_checks import Segments
from gapbeam.solver.case.computed_defaults import PATCH_SHARE
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland

POINTS: Key = ("contact", "points")
ROUNDING = 1e-9
"""Round-off of lengths, relative to the lengths that they are compared with."""


def points_need_a_penalty(contact: Contact) -> Iterator[Fault]:
    """Resultants follow a law of the penetration; exact formulations need the whole face."""
    if contact.points is not None and not contact.formulation.follows_the_law:
        yield Fault(
            POINTS,
            f"points with the formulation {contact.formulation.type}",
            "penalty: a resultant follows a law of the penetration of its patch",
            'formulation = "penalty", or leave points out',
            (("contact", "formulation"),),
        )


def patches_have_points(contact: Contact) -> Iterator[Fault]:
    """The size of patches says nothing without points."""
    if contact.points is None and contact.patch != "auto":
        yield Fault(
            ("contact", "patch"),
            f"{contact.patch:g} m without points",
            "patch together with points: contact all over the faces has no patches",
            "points = [0.0, 0.05] at the ends of the support, or leave patch out",
        )


def points_lie_on_the_faces(
    beam: Beam, segment: Segments, support: AnySupports, mesh: Mesh, contact: Contact
) -> Iterator[Fault]:
    """Points lie in the support, and where they have a y, within the width of a solid beam."""
    if not isinstance(support, BaseAndGland):
        if contact.points is not None:
            found, expected = "points with [[support]]", "points with [support]: the base and gland at x = 0"
            yield Fault(POINTS, found, expected, "leave points out: contact acts all over the faces", (("support",),))
        return
    width = beam_at(beam, segment.values(), 0.5 * support.length).width
    for point in contact.points or ():
        x, *across = point if isinstance(point, tuple) else (point,)
        margin = ROUNDING * support.length
        if not -margin <= x <= support.length + margin:
            in_mm = 10.0 * support.length < x <= 1000.0 * support.length
            yield Fault(
                POINTS,
                f"x = {x:g} m, outside the support",
                f"x from 0 to {support.length:g} m",
                f"is it in mm? In m it is {x / 1000:g}" if in_mm else "coordinates are in m, from the supported end",
                (("support", "length"),),
            )
        if across and mesh.dimension == 2:
            yield Fault(
                POINTS,
                f"[{x:g}, {across[0]:g}] with dimension = 2",
                "x alone in 2D, where a patch spans the whole width",
                f"{x:g} instead of [{x:g}, {across[0]:g}], or mesh.dimension = 3",
                (("mesh", "dimension"),),
            )
        elif across and mesh.file is None and abs(across[0]) > 0.5 * width * (1.0 + ROUNDING):
            yield Fault(
                POINTS,
                f"y = {across[0]:g} m, outside the beam",
                f"y from {-0.5 * width:g} to {0.5 * width:g} m",
                "y = 0 is the axis of the beam; coordinates are in m",
                (("beam", "width"),),
            )


def points_hold_the_beam(contact: Contact) -> Iterator[Fault]:
    """Two different x hold a beam against tilting."""
    if contact.points is None:
        return
    places = {point[0] if isinstance(point, tuple) else point for point in contact.points}
    if len(places) < 2:
        found = "no point" if not places else f"points at x = {places.pop():g} m only"
        yield Fault(
            POINTS,
            found,
            "at least two points with different x: one line cannot hold the beam against tilting",
            "points = [0.0, 0.05] at the ends of a support of 0.05 m",
        )


def patches_keep_apart(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """Patches overlap at most as far as hats that add up to 1: their centers are half a patch apart."""
    size = PATCH_SHARE * Layout.of(support).length if contact.patch == "auto" else contact.patch
    least = 0.5 * size * (1.0 - ROUNDING)
    centers = [point if isinstance(point, tuple) else (point,) for point in contact.points or ()]
    for (first, one), (second, other) in combinations(enumerate(centers, 1), 2):
        apart = max(abs(a - b) for a, b in zip(one, other, strict=False))
        if apart < least:
            near = "lie at the same place" if apart == 0.0 else f"are {apart:.3g} m apart, with patches of {size:.3g} m"
            yield Fault(
                POINTS,
                f"points number {first} and {second} {near}",
                f"centers at least half a patch apart along x or across, {0.5 * size:.3g} m: patches that share more "
                "would count parts of the face twice",
                "leave one of them out" if apart == 0.0 else f"patch = {2.0 * apart:.3g}, or points further apart",
                (("contact", "patch"),),
            )
            return
