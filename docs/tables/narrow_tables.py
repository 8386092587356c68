"""Split Markdown tables into tables of at most seven columns, which fit a page."""

from __future__ import annotations

import re

MOST = 7  # columns
ROWS = re.compile(r"(?:^\|.*\|[ ]*\n)+", re.MULTILINE)


def narrow(text: str, keys: int = 1, most: int = MOST) -> str:
    """Return a text with every wide table split into several, each of which begins with the same key columns.

    Args:
        text: Markdown.
        keys: Number of columns at the left that say what a row is.
        most: Largest number of columns of a table.
    """
    return ROWS.sub(lambda found: _split(found[0], keys, most), text)


def columns_of(row: str) -> list[str]:
    """Return the cells of a row of a Markdown table; a bar behind a backslash belongs to its cell."""
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", row.strip())[1:-1]]


def _split(table: str, keys: int, most: int) -> str:
    rows = [columns_of(row) for row in table.splitlines()]
    width = len(rows[0])
    if width <= most:
        return table
    pieces = -(-(width - keys) // (most - keys))
    size = -(-(width - keys) // pieces)
    tables = []
    for start in range(keys, width, size):
        chosen = [*range(keys), *range(start, min(start + size, width))]
        tables.append("".join(f"| {' | '.join(row[column] for column in chosen)} |\n" for row in rows))
    return "\n".join(tables)
