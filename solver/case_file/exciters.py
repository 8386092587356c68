"""Contradictions between the exciters of a case and the rest of it."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case import Exciter, Support
from solver.case_file.faults import Fault
from solver.case_file.places import Loads
from solver.case_tables.contact import Contact


def exciters_sit_on_mass(support: Support, contact: Contact, load: Loads) -> Iterator[Fault]:
    """What an exciter adds to the masses cannot stand on nodes without mass."""
    if contact.mass != "redistributed":
        return
    for number, entry in load.items():
        if not isinstance(entry, Exciter):
            continue
        x = entry.point[0] if isinstance(entry.point, tuple) else entry.point
        if x <= support.length:
            yield Fault(
                ("load", number, "point"),
                f"x = {x:g} m, in the support, whose contact nodes have no mass",
                f"an exciter at x above {support.length:g} m, or contact nodes with mass",
                'contact.mass = "consistent", or move the exciter out of the support',
                (("contact", "mass"),),
            )


def preload_names_differ(load: Loads) -> Iterator[Fault]:
    """The preload of an exciter has a name of its own in results, which no other load may have."""
    for number, entry in load.items():
        if not isinstance(entry, Exciter) or entry.preload == 0.0:
            continue
        for other, named in load.items():
            if named.name == entry.preload_name:
                yield Fault(
                    ("load", other, "name"),
                    f'"{named.name}", which the preload of number {number + 1} is called in results',
                    "a different name for every load",
                    f'name = "{named.type}_{other + 1}"',
                    (("load", number, "preload"),),
                )
