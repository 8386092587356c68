"""Contradictions between the contact laws that supports name and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gapbeam.solver.case.advised_scheme import advised_scheme
from gapbeam.solver.case.analysis_table import Analysis, Periodic
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.placed_support import own_law
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.integrators.scheme_choice import scheme_names
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport
from gapbeam.solver.wording.short_words import either


def laws_of(support: AnySupports, contact: Contact) -> Iterator[tuple[Key, ChosenLaw]]:
    """Yield the contact laws of a case with their keys: that of [contact] where it acts, and those of supports."""
    if any(own_law(one) is None for _, one in keyed(support)):
        yield ("contact", "law"), contact.law
    yield from ((key, law) for key, _, law in _own_laws(support))


def _own_laws(support: AnySupports) -> Iterator[tuple[Key, OneSupport, ChosenLaw]]:
    for key, one in keyed(support):
        law = own_law(one)
        if law is not None:
            yield (*key, "law"), one, law


def own_laws_follow_the_penetration(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """A support names a law where contact goes by a law of the penetration."""
    if contact.formulation.follows_the_law:
        return
    for key, _, law in _own_laws(support):
        yield Fault(
            key,
            f"{law.type}, with the formulation {contact.formulation.type}",
            "no law: this formulation is for rigid supports",
            'formulation = "penalty" in [contact], or leave law out',
            (("contact", "formulation"),),
        )


def own_laws_have_their_stiffness(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """The stiffness of [contact] has the unit of its own law."""
    usual = contact.law.spring_exponent
    for key, one, law in _own_laws(support):
        if not one.brings_stiffness and law.spring_exponent != usual:
            yield Fault(
                (*key[:-1], "stiffness"),
                f"none, with the law {law.type} of the exponent {law.spring_exponent:g}",
                f"a stiffness in {contact.unit_with(law)}: that of [contact] is in {contact.stiffness_unit}",
                "stiffness = 1e15" if law.spring_exponent > 1.0 else "stiffness = 1e12",
                (key, ("contact", "law")),
            )


def own_laws_fit_the_rest(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """Contradictions between the laws of supports and their damping."""
    if not contact.formulation.follows_the_law:
        return
    for key, one, law in _own_laws(support):
        for fault in law.contradictions(contact.formulation, one.damping or 0.0):
            related = tuple(_placed(other, key) for other in fault.related)
            yield replace(fault, key=_placed(fault.key, key), related=related)


def yielding_laws_are_marched(
    support: AnySupports, contact: Contact, time: Time, analysis: Analysis
) -> Iterator[Fault]:
    """Laws with a plastic set need a march, by a scheme whose work over a step is known."""
    for key, law in laws_of(support, contact):
        if not law.keeps_set:
            continue
        if not time.scheme.marches_sets:
            yield Fault(
                key,
                f"{law.type}, with the scheme {time.scheme.type}",
                f"{either(scheme_names('marches_sets'))}: the plastic work of their steps is known",
                f'scheme = "{advised_scheme(contact)}" in [time]',
                (("time", "scheme"),),
            )
        if isinstance(analysis, Periodic):
            yield Fault(
                key,
                f"{law.type}, which keeps a plastic set, in the search for a periodic response",
                "a law that depends on the state alone: what yields is not the same after a period",
                'type = "transient" in [analysis]',
                (("analysis", "type"),),
            )


def _placed(key: Key, law: Key) -> Key:
    """Return the key of the support that names the law, for a key of [contact]."""
    if key[:2] == ("contact", "law"):
        return (*law, *key[2:])
    return (*law[:-1], *key[1:]) if key == ("contact", "damping") else key
