"""What may reach the terminal."""

from __future__ import annotations


def harmless(text: object) -> str:
    """Return a text whose control characters, which a file may have brought, are written out; lines stay lines."""
    return "".join(
        one if one.isprintable() or one in "\n\t" else one.encode("unicode_escape").decode("ascii") for one in str(text)
    )
