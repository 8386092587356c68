"""Bounds on the extent of a case file, so that checking it ends soon."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.solver.faults import Fault
from gapbeam.solver.wording.short_words import printable

MOST_ENTRIES = 1000
"""Entries of an array of tables, and items of a list."""
DEEPEST = 20
"""Lists and tables within each other."""


def beyond_bounds(data: Mapping[str, Any], source: str) -> list[Fault]:
    """Return a fault for every top-level key that holds too many entries or too many levels.

    Args:
        data: The file as read, overrides included.
        source: Its path.
    """
    if len(data) > MOST_ENTRIES:
        return [Fault((), f"{len(data)} tables and keys", f"at most {MOST_ENTRIES}", where=source)]
    faults = []
    for name, table in data.items():
        level, depth, most = [table], 0, 0
        while level and depth <= DEEPEST:
            level = [value for value in level if isinstance(value, Mapping | list | tuple)]
            most = max([most, *map(len, level)])
            inside = [value.values() if isinstance(value, Mapping) else value for value in level]
            level, depth = [entry for values in inside for entry in values], depth + 1
        where = f"{source}: {printable(name)}"
        if depth > DEEPEST:
            faults.append(Fault((), f"more than {DEEPEST} levels of lists and tables", "at most a few", where=where))
        elif most > MOST_ENTRIES:
            faults.append(Fault((), f"{most} entries", f"at most {MOST_ENTRIES}", where=where))
    return faults
