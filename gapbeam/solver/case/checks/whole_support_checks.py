"""Contradictions in figures of whole supports: support_stiffness, support_damping and yield_force."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.contact_table import Contact, whole_unit
from gapbeam.solver.case.placed_support import law_at, own_law
from gapbeam.solver.contact.laws.law_tables import ElasticPlastic
from gapbeam.solver.faults import Fault
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import WHOLE, AnySupports


def figures_are_of_one_kind(support: AnySupports) -> Iterator[Fault]:
    """A figure belongs to the whole support, or is per area."""
    for key, one in keyed(support):
        for name in WHOLE:
            per_area = name.removeprefix("support_")
            if getattr(one, name) is not None and getattr(one, per_area) is not None:
                yield Fault(
                    (*key, name),
                    f"{getattr(one, name):g}, together with {per_area} = {getattr(one, per_area):g}",
                    f"one of the two: {name} belongs to the whole support, {per_area} is per area",
                    f"leave {per_area} out",
                    ((*key, per_area),),
                )
        if one.support_damping is not None and one.support_stiffness is None:
            yield Fault(
                (*key, "support_damping"),
                f"{one.support_damping:g} N s/m, without support_stiffness",
                "both for the whole support, or stiffness and damping per area",
                "support_stiffness = 1e6, N/m",
            )


def whole_supports_follow_the_law(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """The stiffness of a whole support is that of a law of the penetration."""
    for key, one in keyed(support):
        if one.support_stiffness is not None and not contact.formulation.follows_the_law:
            yield Fault(
                (*key, "support_stiffness"),
                f"{one.support_stiffness:g} {whole_unit(law_at(contact, one))}, with the formulation "
                f"{contact.formulation.type}",
                "no stiffness: this formulation is for rigid supports",
                'formulation = "penalty" in [contact], or leave support_stiffness out',
                (("contact", "formulation"),),
            )


def whole_supports_touch_at_once(support: AnySupports) -> Iterator[Fault]:
    """A region is met along lines or areas that do not grow with the penetration."""
    for key, one in keyed(support):
        if one.support_stiffness is None or one.region.touches_at_once:
            continue
        circle = ', or contact = "circle"' if one.region.type == "hole" else ""
        yield Fault(
            (*key, "support_stiffness"),
            f"{one.support_stiffness:g}, with points around the section in a {one.region.type}",
            f"a slot, a stop, a polygon or a hole that is met as a circle{circle}: points around a section touch one "
            "after the other, and no one stiffness is that of all",
            'contact = "circle" in the region' if circle else "stiffness, per area",
            ((*key, "region"),),
        )


def yield_forces_are_of_whole_supports(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """A law that yields at a force acts at supports whose stiffness belongs to the whole support."""
    for key, one in keyed(support):
        law = law_at(contact, one)
        if isinstance(law, ElasticPlastic) and law.yield_force is not None and one.support_stiffness is None:
            where = ("contact", "law") if own_law(one) is None else (*key, "law")
            yield Fault(
                (*where, "yield_force"),
                f"{law.yield_force:g} N, at the support {one.name} without support_stiffness",
                "support_stiffness at every support where the law acts, or yield_pressure",
                f"support_stiffness = 1e6 in [[support]] {one.name}, N/m",
                (key,),
            )


WHOLE_SUPPORT_CHECKS = (
    figures_are_of_one_kind,
    whole_supports_follow_the_law,
    whole_supports_touch_at_once,
    yield_forces_are_of_whole_supports,
)
"""The checks of figures of whole supports."""
