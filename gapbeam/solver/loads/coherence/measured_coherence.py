"""A coherence given at some distances: straight lines in between, 0 beyond the last.

Not every curve is a coherence. A sum of forces cannot have a negative mean square, so that the matrix of the coherences
of any places has no negative eigenvalue (it is positive semidefinite). A curve that falls from 1 on, ever more slowly
down to 0, always is one (Polya's criterion); one with a plateau and a step never is.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.linalg import eigvalsh, toeplitz

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import NonNegative, Number

MOST = 200  # rows
PLACES = 400  # of the matrix whose eigenvalues are looked at, over four times the last distance
NEGATIVE = 1.0e-3  # of the largest eigenvalue: what rounded figures may cause

Distances = Annotated[tuple[NonNegative, ...], Field(min_length=2, max_length=MOST)]
Coherences = Annotated[tuple[Number, ...], Field(min_length=2, max_length=MOST)]


class MeasuredCoherence(CoherenceTable):
    """A table over distance, straight lines in between, 0 beyond."""

    type: Literal["table"] = Field(description="kind of coherence")
    distances: Distances = Field(
        description="ascending distances between two places, the first 0, m", examples=[[0.0, 0.02, 0.05, 0.15]]
    )
    values: Coherences = Field(
        description="coherence at each distance, the first 1, no unit", examples=[[1.0, 0.6, 0.25, 0.0]]
    )

    def at(self, distances: Array) -> Array:
        """Return rho by straight lines."""
        return np.asarray(np.interp(distances, self.distances, self.values, right=0.0))

    def pieces(self, length: float) -> Array:
        """Return the distances of the table."""
        inside = [distance for distance in self.distances if distance < length]
        return np.array([*inside, min(length, self.distances[-1])])

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield columns that do not pair, distances that do not ascend, and curves that are no coherence."""
        distances, values = self.distances, self.values
        if len(distances) != len(values):
            yield Fault(
                (*key, "values"),
                f"{len(values)} for {len(distances)} distances",
                "one value for each distance",
                related=((*key, "distances"),),
            )
            return
        wrong = False
        if distances[0] != 0.0 or any(one >= following for one, following in pairwise(distances)):
            wrong = True
            yield Fault(
                (*key, "distances"), f"{list(distances)}", "0 first, and distances that ascend", "sort the rows"
            )
        if values[0] != 1.0 or max(np.abs(values)) > 1.0:
            wrong = True
            yield Fault(
                (*key, "values"),
                f"{values[0]:g} first, and up to {max(values, key=abs):g}",
                "1 first, and values from -1 to 1: a force is fully coherent with itself, and no more with another",
                "divide all values by the first, and measure distances from 0",
            )
        if not wrong and (least := _least_eigenvalue(self)) < -NEGATIVE:
            yield Fault(
                (*key, "values"),
                f"a curve that is no coherence: some forces would have a mean square of {least:.2g} times the largest",
                "a positive semidefinite curve, such as one that falls ever more slowly from 1 down to 0",
                f'type = "exponential" with length = {self._equal_length():.3g}, or values that end at 0 smoothly',
                ((*key, "distances"),),
            )

    def _equal_length(self) -> float:
        """Return the length of the exponential coherence with the same integral, at least a tenth of the table's, m."""
        integral = float(np.trapezoid(self.values, self.distances))
        return max(integral, 0.1 * self.distances[-1])


@lru_cache(maxsize=16)
def _least_eigenvalue(coherence: MeasuredCoherence) -> float:
    """Return the least eigenvalue of the coherences of places at equal distances, over the largest."""
    places = np.asarray(np.linspace(0.0, 4.0 * coherence.distances[-1], PLACES))
    found = eigvalsh(toeplitz(coherence.at(places)))
    return float(found[0] / found[-1])
