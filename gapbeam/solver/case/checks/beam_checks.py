"""Contradictions between the cross-section of [beam], its segments and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from math import hypot

from gapbeam.meshes.beam_geometry import CLOSEST, SNAP
from gapbeam.solver.case.analysis_table import Analysis
from gapbeam.solver.case.beam_motions import motions_of_tables, with_given
from gapbeam.solver.case.beam_profile import OF_MATERIAL, OF_SECTION, Beam, beam_at, span_lies_on_the_beam
from gapbeam.solver.case.case import Contact, Mesh, Output, Probe
from gapbeam.solver.case.checks.place_checks import Loads, Segments
from gapbeam.solver.case.solution_tables import BeamModel, ModelTable, RigidModel
from gapbeam.solver.loads.attachments import Joint, PointMass
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted, exceeds
from gapbeam.solver.schema.table import Vector
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland

ROUNDING = 1.0e-12
BESIDE = 1.0e-9  # of the length of the beam: a place beside the end of a segment


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
        if all(getattr(one, key) is None for key in (*OF_SECTION, *OF_MATERIAL)):
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
                    f"a solid segment between them, such as the cap of a tube, or a wall of the part of "
                    f"{outer.thickness:g} m that is thicker than {0.5 * (outer.thickness - inner.thickness):g} m",
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


SECTION: Key = ("beam", "section")
ASIDE = 1.0e-3  # of the thickness: centroids nearer to each other than this are in one line
ON_SURFACE = 1.0e-6  # relative: a point on the surface counts as one in the material


def section_fits_the_beam(beam: Beam) -> Iterator[Fault]:
    """Walls, webs and flanges have room in the section, and figures by formulas are those of the patches."""
    found = list(beam.section.faults(beam.thickness, beam.width))
    yield from found
    for words in () if found else beam.section.disagreements(beam.thickness, beam.width):
        yield Fault(
            SECTION,
            f'"{beam.section.type}", whose class has {words}',
            "figures that agree with the patches within 1 %",
            "leave that method out of the class: the figure is then computed from the patches",
        )


def sections_are_solids(beam: Beam, mesh: Mesh) -> Iterator[Fault]:
    """A slice in the bending plane is equally wide everywhere, and only hexahedra follow the patches of a section."""
    if beam.rectangular:
        return
    kind = beam.section.type
    if mesh.dimension == 2:
        degree = " and degree = 2" if beam.section.round and mesh.degree == 1 else ""
        yield Fault(
            ("mesh", "dimension"),
            f'2, with the section "{kind}"',
            "3: a slice in the bending plane is equally wide everywhere",
            f"dimension = 3{degree} in [mesh]; the models beam and reduced march as fast as in the plane",
            (SECTION,),
        )
    if mesh.cell == "tetrahedron":
        yield Fault(
            ("mesh", "cell"),
            f'"tetrahedron", with the section "{kind}"',
            "hexahedron: sections other than the rectangle are meshed in layers",
            "leave cell out",
            (SECTION,),
        )


def curved_cells_are_quadratic(beam: Beam, segment: Segments, mesh: Mesh) -> Iterator[Fault]:
    """Linear displacements strain curved cells where the beam only turns (`meshes.mesh_readings`)."""
    sections = [beam.section, *(one.beam(beam).section for one in segment.values())]
    curved = next((section for section in sections if section.round), None)
    if mesh.degree == 1 and mesh.dimension == 3 and mesh.file is None and curved is not None:
        yield Fault(
            ("mesh", "degree"),
            f'1, with the section "{curved.type}", whose cells are curved',
            "2: linear displacements strain curved cells where the beam only turns",
            "degree = 2, with fewer cells",
            (SECTION,),
        )


def supports_touch_flat_sides(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """A flat support below or above the beam touches a side that is level, not a corner."""
    for key, one in keyed(support):
        here = beam_at(beam, segment.values(), 0.5 * (one.start + one.end))
        if any(here.section.faults(here.thickness, here.width)):
            continue
        for face in one.faces:
            if not face.around and not here.section.flat(face.side < 0.0):
                where, most = ("above", "highest") if face.side < 0.0 else ("below", "lowest")
                yield Fault(
                    SECTION,
                    f'a "{here.section.type}" whose {most} place is a corner, with a support {where} it ({face.name})',
                    "a level side there: a corner would press into the flat support without bound as cells shrink",
                    "flatten the corner by two points of the same height, or turn the section",
                    (key,),
                )


def beam_elements_bend_alone(
    beam: Beam,
    segment: Segments,
    mesh: Mesh,
    support: AnySupports,
    load: Loads,
    joint: Mapping[int, Joint],
    mass: Mapping[int, PointMass],
    contact: Contact,
    analysis: Analysis,
    model: ModelTable,
) -> Iterator[Fault]:
    """Beam elements neither twist as they bend nor bend in one plane with the other, and their axis is straight."""
    if not isinstance(model, BeamModel):
        return
    needed = motions_of_tables(mesh, support, load, joint, mass, contact, analysis)
    in_space = not {"lateral", "torsion"}.isdisjoint(with_given(needed, model.motions))
    heights = list[float]()
    for here in dict.fromkeys((beam, *(one.beam(beam) for one in segment.values()))):
        if any(here.section.faults(here.thickness, here.width)):
            continue
        if reason := here.section.coupling(in_space, here.thickness, here.width):
            yield Fault(
                ("model", "type"),
                f'beam, with the section "{here.section.type}": {reason}',
                "a section that bends without twisting, in one plane without the other",
                'model.type = "reduced": the solid bends and twists as it does',
                (SECTION,),
            )
        heights.append(here.centroid[1])
    if heights and max(heights) - min(heights) > ASIDE * beam.thickness:
        yield Fault(
            ("model", "type"),
            f"beam, with centroids of its sections {max(heights) - min(heights):.3g} m above each other",
            "sections whose centroids are in one line: bending of beam elements comes without axial motion",
            'model.type = "reduced"',
            (SECTION,),
        )


def points_are_in_the_section(
    beam: Beam, segment: Segments, mesh: Mesh, load: Loads, probe: Mapping[int, Probe]
) -> Iterator[Fault]:
    """Loads and probes are on the axis, or at points of the material."""
    if mesh.dimension == 2 or mesh.file is not None:
        return
    points: list[tuple[Key, float | Vector | None]] = [
        (("load", number, "point"), entry.place.point) for number, entry in load.items()
    ]
    points += [(("probe", number, "point"), entry.point) for number, entry in probe.items()]
    for key, point in points:
        if not isinstance(point, tuple) or len(point) != mesh.dimension or not any(point[1:]):
            continue
        here, y, z = beam_at(beam, segment.values(), point[0]), point[1], point[-1]
        inside = any(here.contains(share * y, share * z) for share in (1.0, 1.0 - ON_SURFACE, 1.0 + ON_SURFACE))
        if not inside and abs(y) <= 0.5 * here.width and abs(z) <= 0.5 * here.thickness:  # else another check says so
            yield Fault(
                key,
                f"y = {y:g}, z = {z:g} m, {hypot(y, z):.4g} m off the axis and not in the material of the section",
                f'a point of the section "{here.section.type}", or x alone',
                f"point = {point[0]:g} for the axis, which moves as the whole cross-section does on average",
                (SECTION,),
            )


def stress_is_that_of_the_material(
    beam: Beam, segment: Segments, mesh: Mesh, model: ModelTable, probe: Mapping[int, Probe]
) -> Iterator[Fault]:
    """A stress is recorded at a point of a body that deforms."""
    for number, entry in probe.items():
        if not entry.stress:
            continue
        x, *aside = entry.point if isinstance(entry.point, tuple) else (entry.point,)
        here = beam_at(beam, segment.values(), x)
        if isinstance(model, RigidModel):
            yield Fault(
                ("probe", number, "stress"),
                "true, with the model rigid",
                "a model that deforms: a rigid body has no stress",
                'model.type = "reduced", or leave stress out',
                (("model", "type"),),
            )
        elif not any(aside) and here.hollow and mesh.file is None:
            yield Fault(
                ("probe", number, "stress"),
                f'true, on the axis of the hollow section "{here.section.type}"',
                "a point in the material",
                f"point = [{x:g}, 0.0, {-0.5 * here.thickness:g}], at the lower surface",
                (("probe", number, "point"), SECTION),
            )


def stress_fields_need_a_body_that_deforms(model: ModelTable, output: Output) -> Iterator[Fault]:
    """Fields of stress are those of a body that deforms."""
    if output.stress and isinstance(model, RigidModel):
        yield Fault(
            ("output", "stress"),
            "true, with the model rigid",
            "a model that deforms: a rigid body has no stress",
            'model.type = "reduced", or leave stress out',
            (("model", "type"),),
        )


def contact_points_fit_the_section(beam: Beam, contact: Contact) -> Iterator[Fault]:
    """Patches across the width need a flat face."""
    if contact.points is not None and beam.section.round:
        yield Fault(
            ("contact", "points"),
            f'{counted(len(contact.points), "point")}, with the section "{beam.section.type}"',
            "no points on a round section, which touches along lines",
            "leave points out: contact then acts all over the faces",
            (SECTION,),
        )
