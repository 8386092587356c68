"""Contradictions between contact and the rest of a case: scheme, law, patch, points and resultants."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

from gapbeam.solver.case.analysis_table import Analysis, Periodic
from gapbeam.solver.case.beam_profile import Beam, beam_at
from gapbeam.solver.case.case import Contact, Mesh, Output, acting_friction, advised_scheme, own_law, takes_damping
from gapbeam.solver.case.checks.place_checks import Segments
from gapbeam.solver.case.computed_defaults import PATCH_SHARE
from gapbeam.solver.case.solution_tables import Time
from gapbeam.solver.contact.laws.law_choice import LAWS, KelvinVoigt
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.integrators.scheme_choice import scheme_names
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, either
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland, OneSupport


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


def law_fits_the_formulation(support: AnySupports, contact: Contact, time: Time) -> Iterator[Fault]:
    """Formulation, law, stiffness and damping go together."""
    formulation, law = contact.formulation, contact.law
    plain, where = formulation.follows_the_law, (("contact", "formulation"),)
    if not plain and not law.exact:
        known = [name for name, table in LAWS.items() if table.exact]
        expected = f"{' or '.join(known)}, the law that the formulation {formulation.type} knows"
        advice = f'law = "{known[0]}"' if time.scheme.impulses else 'formulation = "penalty"'
        yield Fault(("contact", "law"), law.type, expected, advice, where)
    if contact.damping > 0.0 and not (plain and law.takes_damping):
        what = f"the law {law.type} brings its own" if plain else f"the formulation {formulation.type} has no"
        found = f"{contact.damping:g} {contact.damping_unit}"
        related = (("contact", "law" if plain else "formulation"),)
        yield Fault(("contact", "damping"), found, f"0: {what} damping", "leave damping out", related)
    if contact.stiffness != "auto" and not formulation.takes_stiffness:
        expected = f'"auto": the formulation {formulation.type} has no stiffness to choose'
        yield Fault(("contact", "stiffness"), f"{contact.stiffness:g} Pa/m", expected, "leave stiffness out", where)
    shared = any(own_law(one) is None and not one.brings_stiffness for _, one in keyed(support))
    if contact.stiffness == "auto" and law.spring_exponent > 1.0 and shared:
        expected = f"a number in {contact.stiffness_unit}: it cannot be computed for a law with an exponent"
        hint = "stiffness = 1e15" if contact.points is None else "stiffness = 1e12"
        yield Fault(("contact", "stiffness"), '"auto"', expected, hint, (("contact", "law"),))


def point_results_follow_the_law(contact: Contact, output: Output, time: Time) -> Iterator[Fault]:
    """Results of contact points follow from the penetration, which exact formulations do not have."""
    if output.points and not contact.formulation.follows_the_law:
        yield Fault(
            ("output", "points"),
            f"true, with the formulation {contact.formulation.type}",
            "contact by a law of the penetration, which shows where a point is pressed",
            f"{by_penalty(contact, time)}, or leave points out",
            (("contact", "formulation"),),
        )


def law_fits_the_rest(contact: Contact) -> Iterator[Fault]:
    """Contradictions between the law, the formulation and contact.damping."""
    yield from contact.law.contradictions(contact.formulation, contact.damping)


def by_penalty(contact: Contact, time: Time) -> str:
    """Return the advice to take the penalty formulation, with a scheme that takes it."""
    scheme = f', and scheme = "{advised_scheme(contact)}" in [time]' if time.scheme.impulses else ""
    return f'formulation = "penalty" in [contact]{scheme}'


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


def exact_contact_starts_outside(
    support: AnySupports, contact: Contact, analysis: Analysis, time: Time
) -> Iterator[Fault]:
    """Exact contact has no state within the faces: a march from there follows from the step alone."""
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
                f'start = "seat", or {by_penalty(contact, time)}',
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


def rubbing(support: AnySupports, contact: Contact) -> tuple[Key, float] | None:
    """Return the key and the coefficient of the first friction that acts, of a support or of all; None without any."""
    for key, one in keyed(support):
        sliding, _ = contact.usual_friction.at_support(one.friction, one.static_friction)
        if sliding > 0.0:
            return (("contact", "friction") if one.friction is None else (*key, "friction")), sliding
    return None


def friction_fits_the_formulation(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """Friction needs the contact pressure apart from the stress of the body."""
    if (rubs := rubbing(support, contact)) is not None and contact.formulation.stress_terms is not None:
        key, sliding = rubs
        yield Fault(
            key,
            f"a coefficient of {sliding:g} with the formulation {contact.formulation.type}",
            "penalty, unilateral or augmented-lagrangian: friction by the stress of the body is not there",
            'formulation = "penalty", or leave friction out',
            (("contact", "formulation"),),
        )


def friction_is_implicit(support: AnySupports, contact: Contact, time: Time) -> Iterator[Fault]:
    """Regularized friction is far too stiff for an explicit step."""
    if (rubs := rubbing(support, contact)) is not None and time.scheme.explicit:
        key, sliding = rubs
        yield Fault(
            key,
            f"a coefficient of {sliding:g} with the scheme {time.scheme.type}",
            "an implicit scheme: a damper of mu p / v0 asks for steps far below the stable one",
            f'scheme = "{advised_scheme(contact)}" in [time], or leave friction out',
            (("time", "scheme"),),
        )


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


def laws_of(support: AnySupports, contact: Contact) -> list[tuple[Key, ChosenLaw]]:
    """Return the contact laws of a case with their keys: that of [contact] where it acts, and those of supports."""
    laws: list[tuple[Key, ChosenLaw]] = [(key, law) for key, _, law in _own_laws(support)]
    if any(own_law(one) is None for _, one in keyed(support)):
        laws.insert(0, (("contact", "law"), contact.law))
    return laws


def _own_laws(support: AnySupports) -> Iterator[tuple[Key, OneSupport, ChosenLaw]]:
    for key, one in keyed(support):
        law = own_law(one)
        if law is not None:
            yield (*key, "law"), one, law


def idle_keys(contact: Contact, layout: Layout) -> list[str]:
    """Return the keys of [contact] that are given and act at no support, since each brings its own."""
    supports = layout.supports
    acts = {
        "law": contact.law == KelvinVoigt() or not all(own_law(one) for one in supports),
        "stiffness": contact.stiffness == "auto" or not all(one.brings_stiffness for one in supports),
        "damping": contact.damping == 0.0 or any(takes_damping(contact, one) for one in supports),
        "friction": contact.friction is None or acting_friction(contact, layout) is not None,
    }
    return [key for key, found in acts.items() if not found]


def own_laws_follow_the_penetration(support: AnySupports, contact: Contact, time: Time) -> Iterator[Fault]:
    """A support names a law where contact goes by a law of the penetration."""
    if contact.formulation.follows_the_law:
        return
    for key, _, law in _own_laws(support):
        yield Fault(
            key,
            f"{law.type}, with the formulation {contact.formulation.type}",
            "no law: this formulation is for rigid supports",
            f"{by_penalty(contact, time)}, or leave law out",
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
