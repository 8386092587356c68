"""Contradictions between round holes and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.case import Beam, Mesh
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport

WIDEST = 0.1  # of the radius: up to here the normals of the section stand for those of the hole


def _holes(support: AnySupports) -> Iterator[tuple[Key, OneSupport]]:
    """Yield the holes among the supports of a case."""
    for key, one in keyed(support):
        if one.around:
            yield (*key, "region"), one


def holes_hold_round_beams(beam: Beam, support: AnySupports, mesh: Mesh) -> Iterator[Fault]:
    """A round hole has a round section in it, in a mesh that gapbeam builds."""
    for key, one in _holes(support):
        if not beam.section.round:
            yield Fault(
                key,
                f'hole, around the section "{beam.section.type}"',
                "a round section, which touches a hole anywhere around it",
                'section = "round" or { type = "tube", wall = ... } in [beam], or region = "slot"',
                (("beam", "section"),),
            )
        elif mesh.file is not None:
            yield Fault(
                key,
                "hole, with a mesh file",
                "a mesh that gapbeam builds: the faces of mesh files look down and up",
                "leave file out, and give the section in [beam]",
                (("mesh", "file"),),
            )
        elif abs(one.clearance) > WIDEST * 0.5 * beam.thickness:
            yield Fault(
                (*key[:-1], "clearance"),
                f"{one.clearance:g} m, {one.clearance / (0.5 * beam.thickness):.3g} of the radius of the beam",
                f"at most {WIDEST:g} of it, {WIDEST * 0.5 * beam.thickness:g} m, for contact along its radii",
                "the clearance of a hole is the difference of both radii, not of the diameters",
                (("beam", "thickness"),),
            )
        elif abs(one.offset) > max(one.clearance, 0.0):
            yield Fault(
                (*key[:-1], "offset"),
                f"{one.offset:g} m, more than the clearance of {one.clearance:g} m",
                "a hole that the straight beam fits in",
                "a smaller offset, or a larger clearance",
                ((*key[:-1], "clearance"),),
            )


def holes_are_met_along_radii(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """The stress at the points of a hole is not known along its radii."""
    for key, _ in _holes(support):
        if contact.formulation.stress_terms is not None:
            yield Fault(
                ("contact", "formulation"),
                f"{contact.formulation.type}, with a hole",
                "a formulation without the stress at the contact points",
                'formulation = "penalty"',
                (key,),
            )
        return
