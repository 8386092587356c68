"""Printed results of studies in a Python session: one line in a terminal, their tables in a notebook."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console, RenderableType
from rich.table import Table

WIDTH = 180  # columns
DOUBTFUL = 5  # exit status of a study that finished, but whose result cannot be claimed


class PrintedResult:
    """A result that prints short in a terminal and as its tables in a notebook."""

    def headline(self) -> str:
        """Return the result in one line."""
        raise NotImplementedError

    def tables(self) -> Iterable[RenderableType]:
        """Return the tables below that line in a notebook."""
        return ()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.headline()}>"

    def _repr_html_(self) -> str:
        """Return the HTML for a notebook."""
        return as_html([self.headline(), *self.tables()])


def table_of(heads: Iterable[Any], rows: Iterable[Iterable[Any]], digits: int = 4, caption: str | None = None) -> Table:
    """Return a table: floating-point numbers with so many significant digits, None as an empty cell."""
    table = Table(*map(str, heads), caption=caption, caption_justify="left")
    for row in rows:
        words = ("" if cell is None else f"{cell:.{digits}g}" if isinstance(cell, float) else str(cell) for cell in row)
        table.add_row(*words)
    return table


def as_html(parts: Sequence[RenderableType]) -> str:
    """Return text and tables as one preformatted block of HTML, with user text escaped."""
    console = Console(record=True, width=WIDTH, file=io.StringIO(), highlight=False, markup=False)
    for part in parts:
        console.print(part)
    lines = console.export_html(inline_styles=True, code_format="{code}").splitlines()
    text = "\n".join(line.rstrip() for line in lines)
    return f'<pre style="overflow-x: auto; line-height: 1.3">{text}</pre>'
