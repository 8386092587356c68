"""Contradictions between supports around the beam and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.beam_profile import beam_at
from gapbeam.solver.case.case import Beam, Mesh
from gapbeam.solver.case.checks.place_checks import Segments
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport


def _around(support: AnySupports) -> Iterator[tuple[Key, OneSupport]]:
    """Yield the supports around the beam among those of a case, with the key of their region."""
    for key, one in keyed(support):
        if one.around:
            yield (*key, "region"), one


def regions_fit_the_beam(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """A region finds what contradicts itself or the beam in its table."""
    for key, one in keyed(support):
        yield from one.region.faults((*key, "region"), 0.5 * _within(beam, segment, one).thickness)


def _within(beam: Beam, segment: Segments, support: OneSupport) -> Beam:
    """Return a beam that is all along as the one in a support is."""
    return beam_at(beam, segment.values(), 0.5 * (support.start + support.end))


def round_beams_are_met_around(beam: Beam, segment: Segments, support: AnySupports, mesh: Mesh) -> Iterator[Fault]:
    """A support around the beam has a round section in it, in a mesh that gapbeam builds."""
    for key, one in _around(support):
        name = one.region.type
        section = _within(beam, segment, one).section
        if not section.round:
            yield Fault(
                key,
                f'{name}, around the section "{section.type}"',
                f"a round section, which touches a {name} anywhere around it",
                'section = "round" or { type = "tube", wall = ... } in [beam], or region = "slot"',
                (("beam", "section"),),
            )
        elif mesh.file is not None:
            yield Fault(
                key,
                f"{name}, with a mesh file",
                "a mesh that gapbeam builds: the faces of mesh files look down and up",
                "leave file out, and give the section in [beam]",
                (("mesh", "file"),),
            )


def beams_fit_in(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """The straight beam fits in a support around it."""
    for key, one in _around(support):
        radius = 0.5 * _within(beam, segment, one).thickness
        if any(one.region.faults(key, radius)):
            continue
        (face,) = one.faces
        if (one.offset or one.lateral) and face.smallest < 0.0:
            moved = "offset" if abs(one.offset) >= abs(one.lateral) else "lateral"
            yield Fault(
                (*key[:-1], moved),
                f"{getattr(one, moved):g} m, with which the straight beam is {-face.smallest:.3g} m in the wall",
                "a support that the straight beam fits in",
                f"a smaller {moved}, or a larger clearance",
                ((*key[:-1], "clearance"),),
            )


def planes_are_not_moved_aside(support: AnySupports) -> Iterator[Fault]:
    """A plane below or above the beam is the same wherever it is moved sideways."""
    for key, one in keyed(support):
        if one.lateral and not one.around:
            yield Fault(
                (*key, "lateral"),
                f"{one.lateral:g} m, for a {one.region.type}",
                "no lateral offset: planes across the bending direction are the same everywhere along y",
                'leave it out; region = "hole" and "polygon" hold the beam sideways',
                ((*key, "region"),),
            )


def holes_are_met_along_radii(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """The stress at the points around a section is not known along its radii."""
    for key, one in _around(support):
        if contact.formulation.stress_terms is not None:
            yield Fault(
                ("contact", "formulation"),
                f"{contact.formulation.type}, with a {one.region.type}",
                "a formulation without the stress at the contact points",
                'formulation = "penalty"',
                (key,),
            )
        return
