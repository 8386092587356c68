"""Contradictions between contact, scheme and what is in contact."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.advised_scheme import advised_scheme
from gapbeam.solver.case.analysis_table import Analysis
from gapbeam.solver.case.case import Output
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.contact.laws.law_choice import LAWS
from gapbeam.solver.faults import Fault
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports
from gapbeam.solver.wording.short_words import apart


def contact_is_shallow(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """The damped law is switched on over a depth far smaller than the gap."""
    for key, one in keyed(support):
        if contact.touch_depth != "auto" and 0 < one.clearance <= contact.touch_depth:
            depth, clearance = apart(contact.touch_depth, one.clearance)
            yield Fault(
                ("contact", "touch_depth"),
                f"{depth} m",
                f"far less than the clearance, {clearance} m",
                f"touch_depth = {one.clearance / 1e4:.3g}",
                ((*key, "clearance"),),
            )


def law_fits_the_formulation(contact: Contact) -> Iterator[Fault]:
    """Formulation, law, stiffness and damping go together."""
    formulation, law = contact.formulation, contact.law
    plain, where = formulation.follows_the_law, (("contact", "formulation"),)
    if not plain and not law.exact:
        known = " or ".join(name for name, table in LAWS.items() if table.exact)
        expected = f"{known}, the law that the formulation {formulation.type} knows"
        yield Fault(("contact", "law"), law.type, expected, 'formulation = "penalty"', where)
    if contact.damping > 0.0 and not (plain and law.takes_damping):
        what = f"the law {law.type} brings its own" if plain else f"the formulation {formulation.type} has no"
        found = f"{contact.damping:g} {contact.damping_unit}"
        related = (("contact", "law" if plain else "formulation"),)
        yield Fault(("contact", "damping"), found, f"0: {what} damping", "leave damping out", related)
    if contact.stiffness != "auto" and not formulation.takes_stiffness:
        expected = f'"auto": the formulation {formulation.type} has no stiffness to choose'
        yield Fault(("contact", "stiffness"), f"{contact.stiffness:g} Pa/m", expected, "leave stiffness out", where)
    if contact.stiffness == "auto" and law.spring_exponent > 1.0:
        expected = f"a number in {contact.stiffness_unit}: it cannot be computed for a law with an exponent"
        hint = "stiffness = 1e15" if contact.points is None else "stiffness = 1e12"
        yield Fault(("contact", "stiffness"), '"auto"', expected, hint, (("contact", "law"),))


def point_results_follow_the_law(contact: Contact, output: Output) -> Iterator[Fault]:
    """Results of contact points follow from the penetration, which exact formulations do not have."""
    if output.points and not contact.formulation.follows_the_law:
        yield Fault(
            ("output", "points"),
            f"true, with the formulation {contact.formulation.type}",
            "contact by a law of the penetration, which shows where a point is pressed",
            'formulation = "penalty" in [contact], or leave points out',
            (("contact", "formulation"),),
        )


def law_fits_the_rest(contact: Contact) -> Iterator[Fault]:
    """Contradictions between the law, the formulation and contact.damping."""
    yield from contact.law.contradictions(contact.formulation, contact.damping)


def impulses_are_unilateral(contact: Contact, time: Time) -> Iterator[Fault]:
    """Some schemes replace the law of contact by impulses."""
    if time.scheme.impulses and not contact.formulation.takes_impulses:
        yield Fault(
            ("contact", "formulation"),
            contact.formulation.type,
            f"unilateral: the scheme {time.scheme.type} knows impulses, no law",
            f'scheme = "{advised_scheme(contact)}" in [time]; or exact contact, the formulation unilateral, with a '
            "model that takes it and no stiffness, damping and law",
            (("time", "scheme"),),
        )


def exact_contact_starts_outside(support: AnySupports, contact: Contact, analysis: Analysis) -> Iterator[Fault]:
    """Exact contact has no state within the faces: what a march from there does follows from the step alone."""
    formulation = contact.formulation
    exact = not formulation.follows_the_law and formulation.stress_terms is None
    if not exact or getattr(analysis, "start", None) != "undeformed":
        return
    for key, one in keyed(support):
        deepest = -min((face.gap for face in one.faces), default=0.0)
        if deepest > 0.0:
            yield Fault(
                ("analysis", "start"),
                f"undeformed, {deepest:g} m within the faces, with the formulation {formulation.type}",
                "seat: exact contact allows no pose within the faces to start from",
                'start = "seat", or formulation = "penalty" in [contact]',
                ((*key, "clearance"), ("contact", "formulation")),
            )


def scheme_fits_the_formulation(contact: Contact, time: Time) -> Iterator[Fault]:
    """A discrete gradient needs a contact potential."""
    found = contact.formulation.without_potential
    if found and time.scheme.needs_potential:
        yield Fault(
            ("time", "scheme"),
            f"{time.scheme.type} with the formulation {found}",
            "a scheme that asks for no contact potential, which this formulation does not have",
            'scheme = "implicit-midpoint"',
            (("contact", "formulation"),),
        )


def explicit_scheme_fits_the_contact(contact: Contact, time: Time) -> Iterator[Fault]:
    """An explicit scheme takes contact by a law, or exactly on massless nodes."""
    if not time.scheme.explicit:
        return
    where = (("time", "scheme"),)
    if contact.formulation.stress_terms is not None:
        expected = f"penalty, or unilateral with massless contact nodes: the scheme {time.scheme.type} is explicit"
        yield Fault(("contact", "formulation"), contact.formulation.type, expected, 'formulation = "penalty"', where)
    elif not contact.formulation.follows_the_law and contact.mass == "consistent":
        expected = f"redistributed: only massless nodes meet {contact.formulation.type} contact in an explicit step"
        yield Fault(("contact", "mass"), "consistent", expected, 'mass = "redistributed"', where)


def impulses_need_mass(contact: Contact, time: Time) -> Iterator[Fault]:
    """Impulses act on masses."""
    if time.scheme.impulses and contact.mass == "redistributed":
        expected = f"consistent: the impulses of the scheme {time.scheme.type} act on the mass of the contact nodes"
        yield Fault(("contact", "mass"), "redistributed", expected, "leave mass out", (("time", "scheme"),))


def friction_fits_the_formulation(contact: Contact) -> Iterator[Fault]:
    """Friction needs the contact pressure apart from the stress of the body."""
    if contact.rubs is not None and contact.formulation.stress_terms is not None:
        yield Fault(
            ("contact", "friction"),
            f"a coefficient of {contact.rubs.coefficient:g} with the formulation {contact.formulation.type}",
            "penalty, unilateral or augmented-lagrangian: friction by the stress of the body is not there",
            'formulation = "penalty", or leave friction out',
            (("contact", "formulation"),),
        )


def friction_is_implicit(contact: Contact, time: Time) -> Iterator[Fault]:
    """Regularized friction is far too stiff for an explicit step."""
    if contact.rubs is not None and time.scheme.explicit:
        yield Fault(
            ("contact", "friction"),
            f"a coefficient of {contact.rubs.coefficient:g} with the scheme {time.scheme.type}",
            "an implicit scheme: a damper of mu p / v0 asks for steps far below the stable one",
            f'scheme = "{advised_scheme(contact)}" in [time], or leave friction out',
            (("time", "scheme"),),
        )
