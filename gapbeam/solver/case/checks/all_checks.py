"""Contradictions between the tables of a case, each found by a function that takes the tables it needs.

Every public function of a module of checks that yields faults is a check; the names of its parameters are those of the
tables it takes.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks import (
    attachment_checks,
    beam_checks,
    circle_checks,
    contact_checks,
    periodic_checks,
    place_checks,
    run_checks,
    support_checks,
)
from gapbeam.solver.case.reading.known_keys import numbered
from gapbeam.solver.messages.errors import Fault, Key


def _names_differ(array: str, **tables: Any) -> Iterator[Fault]:
    """Entries of an array of tables are distinguished by their names; a single table has no other beside it."""
    if isinstance(tables[array], Mapping):
        yield from place_checks.namesakes(array, tables[array])


NAMED = ("support", "joint", "mass", "fluid", "probe", "segment")
CHECKS: dict[Callable[..., Iterator[Fault]], frozenset[str]] = {
    partial(_names_differ, array): frozenset({array}) for array in NAMED
} | {
    function: frozenset(inspect.signature(function).parameters)
    for module in (
        support_checks, attachment_checks, circle_checks, place_checks, beam_checks, run_checks, contact_checks,
        periodic_checks,
    )
    for name, function in vars(module).items()
    if not name.startswith("_")
    and inspect.isgeneratorfunction(function)
    and function.__module__ == module.__name__
    and function.__annotations__["return"] == "Iterator[Fault]"
}  # fmt: skip
"""The names of the tables that each check takes."""


def contradictions(tables: Mapping[str, object], incomplete: frozenset[str] = frozenset()) -> list[Fault]:
    """Return the faults found by all checks whose tables are there.

    Args:
        tables: The tables without faults of their own, by name; loads and probes as {number: entry}.
        incomplete: Arrays of tables that lack an entry, since it has a fault of its own. What is said of such an array
            as a whole, or of another table for the sake of it, may be the lack of that entry, and is left out.
    """
    faults: dict[tuple[Key, str], Fault] = {}  # a key that clashes with several others is reported once
    for check, names in CHECKS.items():
        if names <= tables.keys():
            partial = incomplete & names
            for fault in check(**{name: tables[name] for name in names}):
                of_an_entry = len(fault.key) > 1 and fault.key[0] in partial
                if (of_an_entry or not partial) and not incomplete & set(fault.lacks):
                    faults.setdefault((fault.key, fault.found), fault)
    return list(faults.values())


def contradictions_in(case: Case) -> list[Fault]:
    """Return the contradictions of a case that was made in Python."""
    return contradictions(numbered(dict(case)))
