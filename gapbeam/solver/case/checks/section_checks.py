"""Contradictions between the cross-section of [beam] and the rest of the case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot

from gapbeam.solver.attachments.attachment_tables import Joint, PointMass
from gapbeam.solver.case.analysis_table import Analysis
from gapbeam.solver.case.beam_motions import motions_of_tables, with_given
from gapbeam.solver.case.beam_profile import beam_at
from gapbeam.solver.case.case import Beam, Mesh, Output, Probe
from gapbeam.solver.case.checks.place_checks import Loads, Segments
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.model_table import BeamModel, ModelTable, RigidModel
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports
from gapbeam.solver.table import Vector

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
    """Linear displacements strain curved cells where the beam only turns (`meshes.cell_curvature`)."""
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
            f'{len(contact.points)} points, with the section "{beam.section.type}"',
            "no points on a round section, which touches along lines",
            "leave points out: contact then acts all over the faces",
            (SECTION,),
        )
