"""Short words of messages: lists of options, and text of the user's that fits on a line."""

from __future__ import annotations

from collections.abc import Iterable


def either(options: Iterable[str]) -> str:
    """Return "a, b or c"."""
    *first, last = options
    return f"{', '.join(first)} or {last}" if first else last


def printable(text: object, longest: int = 60) -> str:
    """Return a text for one line of a message: not too long, without control characters."""
    cut = str(text)[:longest] + "..." * (len(str(text)) > longest)
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in cut)
