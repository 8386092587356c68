"""Contradictions between the supports of a case: their names, their places, and what they hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

from gapbeam.solver.attachments.attachment_tables import Joint, bending_rank
from gapbeam.solver.case.case import Beam
from gapbeam.solver.case.checks.place_checks import Loads, same_name
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.placed_support import law_at, own_law
from gapbeam.solver.case.span_faults import span_lies_on_the_beam
from gapbeam.solver.faults import Fault
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland
from gapbeam.solver.wording.short_words import exceeds


def support_names_differ(support: AnySupports) -> Iterator[Fault]:
    """Supports are distinguished by their names."""
    taken: dict[str, int] = {}
    for key, one in keyed(support):
        if len(key) == 2:
            first = taken.setdefault(one.name, int(key[1]))
            if first != key[1]:
                yield same_name((*key, "name"), one.name, (("support", first, "name"),))


def supports_lie_on_the_beam(beam: Beam, support: AnySupports) -> Iterator[Fault]:
    """Every support begins before it ends, and ends on the beam."""
    if isinstance(support, BaseAndGland):
        return
    for key, one in keyed(support):
        needs = "a support has a length: its planes touch the beam along it"
        yield from span_lies_on_the_beam(key, one, beam, "the support", needs)


def supports_keep_apart(support: AnySupports) -> Iterator[Fault]:
    """No part of the beam faces two supports on the same side."""
    if isinstance(support, BaseAndGland):
        return
    for (_, one), (key, other) in combinations(keyed(support), 2):
        first, last = max(one.start, other.start), min(one.end, other.end)
        sides = set(one.sides) & set(other.sides)
        if sides and exceeds(last, first):
            where = " and ".join("below" if side > 0.0 else "above" for side in sorted(sides, reverse=True))
            yield Fault(
                (*key, "from"),
                f"{other.start:g} m: the supports {one.name} and {other.name} both stand {where} the beam "
                f"from x = {first:g} to x = {last:g} m",
                "supports that do not overlap on the same side: each place of the beam has one contact on each side; a "
                "soft stop before a hard one is a law whose stiffness grows, piecewise-linear",
                f"from = {one.end:g}" if other.start >= one.start else f"to = {one.start:g}",
                ((*key, "to"),),
            )


def own_contact_fits_the_case(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """A support brings stiffness, damping and friction of its own where those of [contact] could stand."""
    formulation = contact.formulation
    for key, one in keyed(support):
        law, own = law_at(contact, one), own_law(one) is not None
        if one.stiffness is not None and not formulation.follows_the_law:
            yield Fault(
                (*key, "stiffness"),
                f"{one.stiffness:g} {contact.unit_with(law)}, with the formulation {formulation.type}",
                "no stiffness: this formulation is for rigid supports",
                'formulation = "penalty" in [contact], or leave stiffness out',
                (("contact", "formulation"),),
            )
        name, unit = ("support_damping", "N s/m") if one.damping is None else ("damping", contact.damping_unit)
        damping = getattr(one, name)
        if damping is not None and not (formulation.follows_the_law and law.takes_damping):
            plain = formulation.follows_the_law
            what = f"the law {law.type} brings its own" if plain else f"the formulation {formulation.type} has no"
            yield Fault(
                (*key, name),
                f"{damping:g} {unit}",
                f"no damping here: {what} damping",
                f"leave {name} out",
                ((*key, "law"),) if own and plain else (("contact", "law" if plain else "formulation"),),
            )
        elif damping is not None and getattr(law, "restitution", None) is not None:
            where = (*key, "law", "restitution") if own else ("contact", "law", "restitution")
            yield Fault(
                (*key, name),
                f"{damping:g} {unit}, with a restitution in {'its law' if own else '[contact]'}",
                "one of the two: the damping is computed from the restitution",
                f"leave {name} out, or give every support its damping and leave restitution out",
                (where,),
            )
        if one.friction is not None and contact.rubs is None:
            yield Fault(
                (*key, "friction"),
                f"{one.friction:g}, without friction in [contact]",
                "[contact.friction] with a coefficient above 0, which the other supports have",
                "friction = {coefficient = 0.2} in [contact], and friction = 0.0 for supports without",
                (("contact", "friction"),) if contact.friction is not None else (),
            )


def something_carries_the_beam(support: AnySupports, load: Loads, joint: Mapping[int, Joint]) -> Iterator[Fault]:
    """A beam with weight rests on something, where no other static force may press it against supports above."""
    gravity = max((entry.weight_acceleration for entry in load.values()), default=0.0)
    if gravity == 0.0 or isinstance(support, BaseAndGland):
        return
    pushes = (
        entry.static_force is not None or (entry.static and entry.weight_acceleration == 0.0) for entry in load.values()
    )
    if any(pushes):
        return
    if bending_rank(tuple(joint.values()), held_only=False) > 0:
        return
    if not any(face.carries for _, one in keyed(support) for face in one.faces):
        yield Fault(
            ("support",),
            "supports above the beam only, with gravity",
            "at least one plane below: nothing else carries the weight",
            'region = "slot", or side = "below" of a stop',
            (("load",),),
        )
