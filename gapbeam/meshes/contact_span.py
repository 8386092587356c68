"""The part of the upper or lower surface of a beam that faces a support."""

from __future__ import annotations

from typing import NamedTuple


class ContactSpan(NamedTuple):
    """Facets of the upper or lower surface of a beam between two places along it.

    Attributes:
        name: Name of the group of facets.
        below: Whether they belong to the lower surface.
        start: Where they begin along the beam, m.
        end: Where they end, m.
        around: Whether they belong to both surfaces of a round section, all around it.
    """

    name: str
    below: bool
    start: float
    end: float
    around: bool = False
