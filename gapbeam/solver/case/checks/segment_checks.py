"""Contradictions between the segments of a case: their names, their places, and what they change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

from gapbeam.meshes.beam_geometry import CLOSEST, SNAP
from gapbeam.solver.case.beam_profile import beam_at
from gapbeam.solver.case.case import Beam, Mesh, Output, Probe
from gapbeam.solver.case.checks.place_checks import Segments, namesakes
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.segment_table import OF_MATERIAL, OF_SECTION
from gapbeam.solver.case.span_faults import span_lies_on_the_beam
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland
from gapbeam.solver.wording.short_words import exceeds

ROUNDING = 1.0e-12
BESIDE = 1.0e-9  # of the length of the beam: a place beside the end of a segment


def segment_names_differ(segment: Segments) -> Iterator[Fault]:
    """Segments are distinguished by their names."""
    yield from namesakes("segment", segment)


def segments_lie_on_the_beam(beam: Beam, segment: Segments) -> Iterator[Fault]:
    """Every segment begins before it ends, and ends on the beam."""
    for number, one in segment.items():
        yield from span_lies_on_the_beam(("segment", number), one, beam, "the segment", "a segment has a length")


def segments_keep_apart(segment: Segments) -> Iterator[Fault]:
    """No part of the beam is in two segments."""
    for (_, one), (number, other) in combinations(segment.items(), 2):
        first, last = max(one.start, other.start), min(one.end, other.end)
        if exceeds(last, first):
            yield Fault(
                ("segment", number, "from"),
                f"{other.start:g} m: the segments {one.name} and {other.name} overlap from x = {first:g} to "
                f"x = {last:g} m",
                "segments beside each other: no part of the beam has two cross-sections",
                f"from = {one.end:g}" if other.start >= one.start else f"to = {one.start:g}",
                (("segment", number, "to"),),
            )


def segments_change_something(beam: Beam, segment: Segments) -> Iterator[Fault]:
    """A segment gives something of a section or a material; a sweep may pass through the values of the beam."""
    for number, one in segment.items():
        if not one.changes_material and not one.changes_section:
            yield Fault(
                ("segment", number),
                "a segment that is as the rest of the beam",
                f"one of {', '.join((*OF_SECTION, *OF_MATERIAL))}",
                f"thickness = {0.5 * beam.thickness:g}, or leave the segment out",
                (("segment", number, "name"),),
            )


def segments_fit_their_sections(beam: Beam, segment: Segments) -> Iterator[Fault]:
    """Walls, webs and flanges of a segment have room within its thickness and width."""
    for number, one in segment.items():
        here, size = one.beam(beam), ("segment", number, "thickness")
        for fault in here.section.faults(here.thickness, here.width):
            if one.section is not None:
                own = ("segment", number, *fault.key[1:])
                yield Fault(own, fault.found, fault.expected, fault.hint, (size, *fault.related))
                continue
            part = f"{fault.key[-1]} of [beam]" if len(fault.key) > 2 else "section of [beam]"
            yield Fault(
                size,
                f"{here.thickness:g} m, with the {part}: {fault.found}",
                fault.expected,
                f'section = {{ type = "{here.section.type}", ... }} of its own, or another thickness',
                (fault.key, *fault.related),
            )


def segments_join_their_neighbors(beam: Beam, segment: Segments) -> Iterator[Fault]:
    """No part of a beam ends within the hollow of the next one, without touching it."""
    for number, one in segment.items():
        here, aside = one.beam(beam), BESIDE * beam.length
        besides = ((one.start - aside, "start"), (one.end + aside, "end"))
        for place, end in besides:
            if not 0.0 < place < beam.length:
                continue
            there = beam_at(beam, segment.values(), place)
            inner, outer = sorted((here, there), key=lambda part: part.thickness)
            high, wide = outer.section.hollow(outer.thickness, outer.width)
            if inner.thickness <= high and inner.width <= wide:
                yield Fault(
                    ("segment", number, "thickness"),
                    f"{here.thickness:g} m, beside {there.thickness:g} m at the {end} of the segment {one.name}: a "
                    f"part of {inner.thickness:g} m lies within a hollow of {high:g} m, and touches no wall",
                    "parts of the beam that are joined",
                    f"a thicker wall of the part of {outer.thickness:g} m, more than "
                    f"{0.5 * (outer.thickness - inner.thickness):g} m",
                    (("beam", "section"),),
                )
                break


def segments_are_meshed(beam: Beam, segment: Segments, mesh: Mesh) -> Iterator[Fault]:
    """Layers of cells pass through all cross-sections."""
    for number, one in segment.items():
        here, place = one.beam(beam), ("segment", number)
        key = (*place, "section" if one.section is not None else "thickness" if one.thickness else "width")
        if mesh.file is not None:
            yield Fault(
                ("mesh", "file"),
                f"a mesh file, with the segment {one.name}",
                "a mesh that gapbeam builds, whose cells end where segments do",
                "leave file out, or the segments",
                ((*place, "name"),),
            )
            continue
        if here == beam:
            continue
        ours, others = here.section.lattice, beam.section.lattice
        if "own" in (ours, others) and here.section != beam.section:
            yield Fault(
                key,
                f'"{here.section.type}", in a beam of the section "{beam.section.type}"',
                "one polygon all along where sides are inclined: its cells do not meet those of other sections",
                "polygons whose sides are all upright or level, which can be combined with box, i and rectangle",
                (("beam", "section"),),
            )
        elif ours != others:
            yield Fault(
                key,
                f'"{here.section.type}", in a beam of the section "{beam.section.type}"',
                "round sections (round, tube) all along, or none: layers of cells pass through all sections",
                'section = { type = "tube", wall = ... } with round ones; box, i and rectangle with each other',
                (("beam", "section"),),
            )
        if mesh.dimension == 2 and not here.rectangular and beam.rectangular:
            yield Fault(
                key,
                f'"{here.section.type}", in a slice (dimension = 2)',
                "a solid rectangle: a slice in the bending plane is equally wide everywhere",
                "dimension = 3 in [mesh]",
                (("mesh", "dimension"),),
            )
        elif mesh.dimension == 2 and beam.rectangular and here.width != beam.width:
            yield Fault(
                (*place, "width"),
                f"{here.width:g} m, in a slice (dimension = 2)",
                f"the width of the beam, {beam.width:g} m: a slice is equally wide everywhere",
                "dimension = 3 in [mesh]",
                (("mesh", "dimension"), ("beam", "width")),
            )
        if mesh.cell == "tetrahedron" and not here.rectangular and beam.rectangular:
            yield Fault(
                ("mesh", "cell"),
                f'"tetrahedron", with the section "{here.section.type}" in the segment {one.name}',
                "hexahedron: sections other than the rectangle are meshed in layers",
                "leave cell out",
                (key,),
            )


def steps_leave_room_for_cells(beam: Beam, segment: Segments, mesh: Mesh) -> Iterator[Fault]:
    """The surface of a segment coincides with the surfaces of beam and other segments, or is clear of them."""
    closest = 2.0 * CLOSEST * beam.thickness
    for side in ("thickness",) if mesh.dimension == 2 else ("thickness", "width"):
        known: list[tuple[float, str, Key]] = [(getattr(beam, side), "the beam", ("beam", side))]
        for number, one in segment.items():
            own, key = getattr(one.beam(beam), side), ("segment", number, side)
            if own == known[0][0]:
                continue
            near = next((entry for entry in known if 0.0 < abs(own - entry[0]) < closest), None)
            if near is not None:
                yield Fault(
                    key,
                    f"{own:.12g} m, {abs(own - near[0]):.2g} m from the {side} of {near[1]}",
                    f"the same {side}, or one that differs by {closest:.2g} m: cells lie in between",
                    f"{side} = {near[0]:.12g}",
                    (near[2],),
                )
            known.append((own, f"the segment {one.name}", key))


def supports_lie_in_one_segment(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """Gaps are measured from the surface of the undeformed beam, which is one plane or cylinder in a support."""
    places = sorted({place for one in segment.values() for place in (one.start, one.end)})
    near = SNAP * beam.thickness
    for key, one in keyed(support):
        for place in places:
            inside = one.start + near < place < one.end - near
            before, after = (beam_at(beam, segment.values(), x) for x in (place - near, place + near))
            if not inside or before == after:
                continue
            yield Fault(
                (*key, "length" if isinstance(support, BaseAndGland) else "to"),
                f"from x = {one.start:g} to {one.end:g} m, over the step of the beam at x = {place:g} m",
                "a support within one cross-section: gaps are measured from the surface of the beam there",
                f"two supports that meet at x = {place:g}, or a segment that ends elsewhere",
                tuple(("segment", number, end) for number in segment for end in ("from", "to")),
            )
            break


def materials_fit_the_formulation(segment: Segments, contact: Contact) -> Iterator[Fault]:
    """The stress at contact points is taken with one material."""
    for number, one in segment.items():
        elastic = one.young_modulus is not None or one.poisson_ratio is not None
        if elastic and contact.formulation.stress_terms is not None:
            yield Fault(
                ("contact", "formulation"),
                f"{contact.formulation.type}, with another material in the segment {one.name}",
                "a formulation without the stress at the contact points, or one material",
                'formulation = "penalty"',
                (("segment", number, "young_modulus"), ("segment", number, "poisson_ratio")),
            )


def fields_of_stress_take_one_material(segment: Segments, output: Output) -> Iterator[Fault]:
    """Stress is averaged over the cells that meet at a corner, where materials may meet too."""
    for number, one in segment.items():
        if output.stress and (one.young_modulus is not None or one.poisson_ratio is not None):
            yield Fault(
                ("output", "stress"),
                f"true, with another material in the segment {one.name}",
                "one material: stress jumps where materials meet",
                "stress = true at a [[probe]] within a segment",
                (("segment", number, "young_modulus"), ("segment", number, "poisson_ratio")),
            )


def stress_has_one_value(segment: Segments, probe: Mapping[int, Probe], beam: Beam) -> Iterator[Fault]:
    """Stress jumps where materials meet, and grows without bound as cells shrink in the corner of a step."""
    places = sorted({place for one in segment.values() for place in (one.start, one.end)} - {0.0, beam.length})
    for number, entry in probe.items():
        x = entry.point[0] if isinstance(entry.point, tuple) else entry.point
        met = [place for place in places if abs(place - x) <= SNAP * beam.thickness]
        if entry.stress and met:
            yield Fault(
                ("probe", number, "stress"),
                f"true, at x = {x:g} m, where a segment begins or ends",
                "a point within a segment: stress has no single value where sections or materials meet",
                f"a point half a thickness away, x = {x - 0.5 * beam.thickness:g}",
                (("probe", number, "point"),),
            )
