"""The parts of loads: a place and a function of time each.

Most loads are one part. One that is random along the beam is several patterns with noises of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from gapbeam.solver.loads.places import Place
from gapbeam.solver.loads.time_function import TimeFunction


@dataclass(frozen=True)
class LoadPart:
    """A part of a load.

    Attributes:
        name: In results.
        place: Where it acts.
        time_function: Returns s(t).
    """

    name: str
    place: Place
    time_function: Callable[[], TimeFunction]


class _Parted(Protocol):
    @property
    def parts(self) -> tuple[LoadPart, ...]: ...


AnyLoad = TypeVar("AnyLoad", bound=_Parted)


def patterned(loads: Iterable[AnyLoad]) -> list[tuple[AnyLoad, LoadPart]]:
    """Return the parts of loads: the first one of each load in their order, and after them the further ones."""
    parts = [(load, load.parts) for load in loads]
    return [(load, of_load[0]) for load, of_load in parts] + [
        (load, part) for load, of_load in parts for part in of_load[1:]
    ]
