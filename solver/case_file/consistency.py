"""Contradictions between the tables of a case, each found by a function that takes the tables it needs."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping

from solver.case import (
    Beam,
    Case,
    Damping,
    Gates,
    Gravity,
    Material,
    Support,
)
from solver.case_file.faults import Fault, Key
from solver.case_file.geometry import (
    cells_fit_the_beam,
    cells_fit_the_dimension,
    clearance_is_small,
    mesh_file_says_it_all,
    support_is_part_of_the_beam,
)
from solver.case_file.keys import numbered
from solver.case_file.places import (
    Loads,
    directions_point_somewhere,
    load_names_differ,
    loads_have_a_node,
    loads_lie_in_the_beam,
    points_keep_apart,
    probe_names_differ,
    probes_have_a_node,
    probes_lie_in_the_beam,
)
from solver.case_file.timing import (
    adaptive_steps_resolve_a_contact,
    interest_covers_the_forcing,
    outputs_fall_on_steps,
    run_has_steps,
    step_follows_the_forcing,
)
from solver.case_tables.contact import AugmentedLagrangian, Contact, NitscheMethod, Penalty, Unilateral
from solver.case_tables.time import MoreauJean, Time


def contradictions(tables: Mapping[str, object]) -> list[Fault]:
    """Return the faults found by all checks whose tables are there.

    Args:
        tables: The tables without faults of their own, by name; loads and probes as {number: entry}.
    """
    faults: dict[tuple[Key, str], Fault] = {}  # a key that clashes with several others is told once
    for check in CHECKS:
        names = inspect.signature(check).parameters
        if set(names) <= set(tables):
            for fault in check(**{name: tables[name] for name in names}):
                faults.setdefault((fault.key, fault.found), fault)
    return list(faults.values())


def contradictions_in(case: Case) -> list[Fault]:
    """Return the contradictions of a case that was made in Python."""
    return contradictions(numbered(dict(case)))


def damping_is_given_once(damping: Damping) -> Iterator[Fault]:
    """Rayleigh damping is given by frequencies and ratios, or by its two coefficients, and never by half."""
    pairs = (("frequencies", "ratios"), ("mass", "stiffness"))
    given = [name for pair in pairs for name in pair if getattr(damping, name) is not None]
    ways = [[name for name in pair if name in given] for pair in pairs]
    if all(ways):
        yield Fault(
            ("damping", given[-1]),
            f"{', '.join(given)}: damping given in two ways",
            "frequencies and ratios, or mass and stiffness",
            "remove one of the two pairs",
            tuple(("damping", name) for name in given[:-1]),
        )
        return
    for pair, way in zip(pairs, ways, strict=True):
        if len(way) == 1:
            missing = pair[1 - pair.index(way[0])]
            zero = f"; {missing} = 0.0 if there is none" if missing in pairs[1] else ""
            yield Fault(
                ("damping", way[0]),
                f"{way[0]} without {missing}",
                f"both {pair[0]} and {pair[1]}",
                f"add {missing}{zero}",
            )


def damping_is_positive(damping: Damping) -> Iterator[Fault]:
    """Two different frequencies, and ratios for which neither coefficient is negative."""
    if damping.frequencies is None or damping.ratios is None:
        return
    (low, low_ratio), (high, high_ratio) = sorted(zip(damping.frequencies, damping.ratios, strict=True))
    if low == high:
        yield Fault(
            ("damping", "frequencies"),
            f"{low:g} Hz twice",
            "two different frequencies",
            "one below and one above the frequencies of interest",
        )
        return
    least, most = low_ratio * low / high, low_ratio * high / low
    if not least * (1 - 1e-9) <= high_ratio <= most * (1 + 1e-9):
        coefficient = "mass" if high_ratio > most else "stiffness"
        yield Fault(
            ("damping", "ratios"),
            f"{low_ratio:g} at {low:g} Hz and {high_ratio:g} at {high:g} Hz: {coefficient} becomes negative",
            f"a ratio from {least:.4g} to {most:.4g} at {high:g} Hz, for {low_ratio:g} at {low:g} Hz",
            "bring the ratios closer together, or the frequencies further apart",
            (("damping", "frequencies"),),
        )


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
        found, related = f"{contact.damping:g} Pa s/m", (("contact", "law" if plain else "formulation"),)
        yield Fault(("contact", "damping"), found, f"0: {what} damping", "leave damping out", related)
    if contact.stiffness != "auto" and isinstance(formulation, NitscheMethod | Unilateral):
        expected = f'"auto": the formulation {formulation.type} has no stiffness to choose'
        yield Fault(("contact", "stiffness"), f"{contact.stiffness:g} Pa/m", expected, "leave stiffness out", where)
    if contact.stiffness == "auto" and exponent > 1.0:
        expected = f"a number in Pa/m^{exponent:g}: it cannot be computed for a law with an exponent"
        yield Fault(("contact", "stiffness"), '"auto"', expected, "stiffness = 1e15", (("contact", "law"),))


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


def contact_carries_the_beam(
    beam: Beam, material: Material, support: Support, contact: Contact, load: Loads
) -> Iterator[Fault]:
    """The contact is stiff enough for the weight not to push the beam through its support."""
    gravity = max((entry.acceleration for entry in load.values() if isinstance(entry, Gravity)), default=0.0)
    if contact.stiffness == "auto" or gravity == 0.0 or getattr(contact.law, "exponent", 1.0) > 1.0:
        return
    pressure = material.density * gravity * beam.thickness * beam.length / support.length
    if pressure / contact.stiffness > beam.thickness:
        yield Fault(
            ("contact", "stiffness"),
            f"{contact.stiffness:g} Pa/m: the weight pushes the beam {pressure / contact.stiffness:.3g} m in",
            f"far more than {pressure / beam.thickness:.3g} Pa/m; it is N/m divided by the area in m^2",
            'stiffness = "auto"',
            (("material", "density"), ("beam", "thickness")),
        )


def gates_are_in_order(gates: Gates) -> Iterator[Fault]:
    """What one impact may do does not end the run at once."""
    if gates.total_growth < gates.impact_growth:
        yield Fault(
            ("gates", "total_growth"),
            f"{gates.total_growth:g}, less than impact_growth, {gates.impact_growth:g}",
            "at least impact_growth: one impact may not end the run while it keeps its own limit",
            f"total_growth = {max(0.05, 20 * gates.impact_growth):g}",
            (("gates", "impact_growth"),),
        )


CHECKS: tuple[Callable[..., Iterator[Fault]], ...] = (
    support_is_part_of_the_beam,
    clearance_is_small,
    damping_is_given_once,
    damping_is_positive,
    cells_fit_the_dimension,
    cells_fit_the_beam,
    mesh_file_says_it_all,
    loads_lie_in_the_beam,
    loads_have_a_node,
    directions_point_somewhere,
    load_names_differ,
    probes_lie_in_the_beam,
    probes_have_a_node,
    probe_names_differ,
    points_keep_apart,
    run_has_steps,
    step_follows_the_forcing,
    interest_covers_the_forcing,
    outputs_fall_on_steps,
    contact_is_shallow,
    law_fits_the_formulation,
    impulses_are_unilateral,
    adaptive_steps_resolve_a_contact,
    scheme_fits_the_formulation,
    contact_carries_the_beam,
    gates_are_in_order,
)
"""All checks; the names of their parameters are those of the tables they take."""
