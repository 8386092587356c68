"""Checks of loads by themselves, and of what they add to the beam against the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.faults import Fault
from gapbeam.solver.supports.layout import support_at
from gapbeam.solver.supports.support_tables import AnySupports


def loads_are_sound(load: Loads) -> Iterator[Fault]:
    """Each load by itself, such as the file of a record."""
    for number, entry in load.items():
        yield from entry.faults(("load", number))


def loads_fit_each_other(load: Loads) -> Iterator[Fault]:
    """Loads agree with each other, such as those that share the noise of another one."""
    for number, entry in load.items():
        yield from entry.faults_among(("load", number), load)


def loads_fit_the_run(time: Time, load: Loads) -> Iterator[Fault]:
    """Each load in the run, such as a record that has to cover it."""
    for number, entry in load.items():
        yield from entry.faults_in_run(("load", number), time.end, None if time.step == "auto" else time.step)


def attached_masses_sit_on_mass(support: AnySupports, contact: Contact, load: Loads) -> Iterator[Fault]:
    """Masses of loads, such as exciters, need nodes with mass."""
    if contact.mass != "redistributed":
        return
    for number, entry in load.items():
        point = entry.place.point
        if entry.attachment is None or point is None:
            continue
        x = point[0] if isinstance(point, tuple) else point
        held = support_at(support, x)
        if held is not None:
            yield Fault(
                ("load", number, "point"),
                f"x = {x:g} m, in the support, whose contact nodes have no mass",
                f"an {entry.type} at x above {held.end:g} m, or contact nodes with mass",
                f'contact.mass = "consistent", or move the {entry.type} out of the support',
                (("contact", "mass"),),
            )


def static_force_names_differ(load: Loads) -> Iterator[Fault]:
    """The static force that a load adds, such as a preload, has a name in results, which no other load may have."""
    for number, entry in load.items():
        if (added := entry.static_force) is None:
            continue
        for other, named in load.items():
            if named.name == added.name:
                yield Fault(
                    ("load", other, "name"),
                    f'"{named.name}", which the static force of number {number + 1} is called in results',
                    "a different name for every load",
                    f'name = "{named.type}_{other + 1}"',
                    (("load", number, "name"),),
                )
