"""The base of all coherences: what a distributed load asks how alike it is at two places.

The coherence rho(d) of the forces at two places a distance d apart is their cross-spectral density over the root of
the product of their densities. It is real and does not depend on frequency: what happens at all places is in phase.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Table


class CoherenceTable(Table, ABC):
    """A coherence over distance."""

    @abstractmethod
    def at(self, distances: Array) -> Array:
        """Return rho at distances of at least 0, m, of any shape."""

    @abstractmethod
    def pieces(self, length: float) -> Array:
        """Return distances, ascending from 0, between which rho is smooth, m; it is 0 beyond the last.

        Args:
            length: Of the load, m, where the last piece ends at the latest.
        """

    def faults(self, key: Key) -> Iterator[Fault]:  # noqa: ARG002 - for those that override it
        """Yield what is wrong with the coherence beyond single values.

        Args:
            key: The way to its table in the case, to which a fault adds the key that it is about.
        """
        yield from ()
