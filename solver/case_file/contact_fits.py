"""Contradictions between contact, scheme and what is in contact."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case import Beam, Gravity, Material, Support
from solver.case_file.faults import Fault
from solver.case_file.places import Loads
from solver.case_tables.contact import AugmentedLagrangian, Contact, NitscheMethod, Penalty, Unilateral
from solver.case_tables.time import CentralDifference, MoreauJean, Time


def contact_is_shallow(support: Support, contact: Contact) -> Iterator[Fault]:
    """The damped law is switched on over a depth far smaller than the gap."""
    if contact.touch_depth != "auto" and 0 < support.clearance <= contact.touch_depth:
        yield Fault(
            ("contact", "touch_depth"),
            f"{contact.touch_depth:g} m",
            f"far less than the clearance, {support.clearance:g} m",
            f"touch_depth = {support.clearance / 1e4:.3g}",
            (("support", "clearance"),),
        )


def law_fits_the_formulation(contact: Contact) -> Iterator[Fault]:
    """Formulation, law, stiffness and damping go together."""
    formulation, law = contact.formulation, contact.law
    plain, where = isinstance(formulation, Penalty), (("contact", "formulation"),)
    exponent = getattr(law, "exponent", 1.0)
    if not plain and law.type != "kelvin-voigt":
        expected = f"kelvin-voigt, the law that the formulation {formulation.type} knows"
        yield Fault(("contact", "law"), law.type, expected, 'formulation = "penalty"', where)
    if contact.damping > 0.0 and not (plain and law.type == "kelvin-voigt"):
        what = f"the law {law.type} brings its own" if plain else f"the formulation {formulation.type} has no"
        found = f"{contact.damping:g} {contact.damping_unit}"
        related = (("contact", "law" if plain else "formulation"),)
        yield Fault(("contact", "damping"), found, f"0: {what} damping", "leave damping out", related)
    if contact.stiffness != "auto" and isinstance(formulation, NitscheMethod | Unilateral):
        expected = f'"auto": the formulation {formulation.type} has no stiffness to choose'
        yield Fault(("contact", "stiffness"), f"{contact.stiffness:g} Pa/m", expected, "leave stiffness out", where)
    if contact.stiffness == "auto" and exponent > 1.0:
        expected = f"a number in {contact.stiffness_unit}: it cannot be computed for a law with an exponent"
        hint = "stiffness = 1e15" if contact.points is None else "stiffness = 1e12"
        yield Fault(("contact", "stiffness"), '"auto"', expected, hint, (("contact", "law"),))


def impulses_are_unilateral(contact: Contact, time: Time) -> Iterator[Fault]:
    """Moreau and Jean's scheme replaces the law of contact by impulses."""
    if isinstance(time.scheme, MoreauJean) and not isinstance(contact.formulation, Unilateral):
        yield Fault(
            ("contact", "formulation"),
            contact.formulation.type,
            "unilateral: the scheme moreau-jean knows impulses, no law",
            'formulation = "unilateral"',
            (("time", "scheme"),),
        )


def scheme_fits_the_formulation(contact: Contact, time: Time) -> Iterator[Fault]:
    """A discrete gradient needs a contact potential."""
    match contact.formulation:
        case AugmentedLagrangian():
            found = "augmented-lagrangian"
        case NitscheMethod(theta=theta) if theta != 1:
            found = f"nitsche, theta = {theta}"
        case _:
            return
    if time.scheme.type == "discrete-gradient":
        yield Fault(
            ("time", "scheme"),
            f"discrete-gradient with the formulation {found}",
            "a scheme that asks for no contact potential, which this formulation does not have",
            'scheme = "implicit-midpoint"',
            (("contact", "formulation"),),
        )


def explicit_scheme_fits_the_contact(contact: Contact, time: Time) -> Iterator[Fault]:
    """An explicit scheme takes contact by a law, or exactly on massless nodes."""
    if not isinstance(time.scheme, CentralDifference):
        return
    where = (("time", "scheme"),)
    if isinstance(contact.formulation, NitscheMethod):
        expected = "penalty, or unilateral with massless contact nodes: the scheme central-difference is explicit"
        yield Fault(("contact", "formulation"), "nitsche", expected, 'formulation = "penalty"', where)
    elif not isinstance(contact.formulation, Penalty) and contact.mass == "consistent":
        expected = f"redistributed: only massless nodes meet {contact.formulation.type} contact in an explicit step"
        yield Fault(("contact", "mass"), "consistent", expected, 'mass = "redistributed"', where)


def impulses_need_mass(contact: Contact, time: Time) -> Iterator[Fault]:
    """Impulses act on masses."""
    if isinstance(time.scheme, MoreauJean) and contact.mass == "redistributed":
        expected = "consistent: the impulses of the scheme moreau-jean act on the mass of the contact nodes"
        yield Fault(("contact", "mass"), "redistributed", expected, "leave mass out", (("time", "scheme"),))


def friction_fits_the_formulation(contact: Contact) -> Iterator[Fault]:
    """Friction needs the contact pressure apart from the stress of the body."""
    if contact.rubs is not None and isinstance(contact.formulation, NitscheMethod):
        yield Fault(
            ("contact", "friction"),
            f"a coefficient of {contact.rubs.coefficient:g} with the formulation nitsche",
            "penalty, unilateral or augmented-lagrangian: friction by the stress of the body is not there",
            'formulation = "penalty", or leave friction out',
            (("contact", "formulation"),),
        )


def friction_is_implicit(contact: Contact, time: Time) -> Iterator[Fault]:
    """Regularized friction is far too stiff for an explicit step."""
    if contact.rubs is not None and isinstance(time.scheme, CentralDifference):
        yield Fault(
            ("contact", "friction"),
            f"a coefficient of {contact.rubs.coefficient:g} with the scheme central-difference",
            "an implicit scheme: a damper of mu p / v0 asks for steps far below the stable one",
            'scheme = "discrete-gradient", or leave friction out',
            (("time", "scheme"),),
        )


def contact_carries_the_beam(
    beam: Beam, material: Material, support: Support, contact: Contact, load: Loads
) -> Iterator[Fault]:
    """The contact is stiff enough for the weight not to push the beam through its support."""
    gravity = max((entry.acceleration for entry in load.values() if isinstance(entry, Gravity)), default=0.0)
    if contact.stiffness == "auto" or gravity == 0.0 or getattr(contact.law, "exponent", 1.0) > 1.0:
        return
    pressure = material.density * gravity * beam.thickness * beam.length / support.length
    meaning = "it is N/m divided by the area in m^2"
    if contact.points:
        pressure *= beam.width * support.length / len(contact.points)
        meaning = "it is that of each point"
    if pressure / contact.stiffness > beam.thickness:
        unit = contact.stiffness_unit
        yield Fault(
            ("contact", "stiffness"),
            f"{contact.stiffness:g} {unit}: the weight pushes the beam {pressure / contact.stiffness:.3g} m in",
            f"far more than {pressure / beam.thickness:.3g} {unit}; {meaning}",
            'stiffness = "auto"',
            (("material", "density"), ("beam", "thickness")),
        )
