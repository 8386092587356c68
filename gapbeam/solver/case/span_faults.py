"""Order of both ends of what lies along the beam, and their place on it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from gapbeam.solver.case.beam_table import Beam
from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.wording.short_words import apart

ROUNDING = 1.0e-12  # of the length of the beam


class Reach(Protocol):
    """A part of the beam."""

    @property
    def start(self) -> float:
        """Start along the beam, m."""

    @property
    def end(self) -> float:
        """End along the beam, m."""

    @property
    def length(self) -> float:
        """The difference, m."""


def span_lies_on_the_beam(key: Key, one: Reach, beam: Beam, what: str, needs: str) -> Iterator[Fault]:
    """Yield the fault of a span that has no length, or ends beyond the beam.

    Args:
        key: The way to its table.
        one: The span.
        beam: The beam.
        what: The thing, such as "the support".
        needs: A hint where it begins at its end: why it has a length.
    """
    if one.length <= 0.0:
        end, start = apart(one.end, one.start)
        yield Fault(
            (*key, "to"),
            f"{end} m, where {what} begins at {start} m",
            f"more than from, {start} m",
            "swap them?" if one.length < 0.0 else needs,
            ((*key, "from"),),
        )
    elif one.end > beam.length * (1.0 + ROUNDING):
        end, length = apart(one.end, beam.length, ROUNDING)
        in_mm = one.end / 1000.0 <= beam.length < 0.1 * one.end
        yield Fault(
            (*key, "to"),
            f"{end} m, beyond the end of the beam",
            f"at most the length of the beam, {length} m",
            f"is it in mm? In m it is {one.end / 1000.0:g}" if in_mm else "coordinates are in m, from x = 0",
            (("beam", "length"),),
        )
