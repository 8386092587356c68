"""Labels in rows: each goes to the first row where it covers no other one."""

from __future__ import annotations

from collections.abc import Sequence


def rows_of(spans: Sequence[tuple[float, float]], most: int, apart: float) -> list[int | None]:
    """Return the row of each label, 0 being nearest; None: no row has room for it.

    Args:
        spans: Where labels begin and end.
        most: Rows.
        apart: Room between two labels of a row.
    """
    rows: list[list[tuple[float, float]]] = [[] for _ in range(most)]
    found = list[int | None]()
    for first, last in spans:
        free = (
            number
            for number, row in enumerate(rows)
            if all(last + apart <= begin or first >= end + apart for begin, end in row)
        )
        found.append(next(free, None))
        if found[-1] is not None:
            rows[found[-1]].append((first, last))
    return found
