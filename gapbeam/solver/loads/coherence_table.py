"""Coherences of distributed random loads: their base, their tables, and their integrals along a load.

The coherence rho(d) of the forces at two places a distance d apart is their cross-spectral density over the root of
the product of their densities. It is real and does not depend on frequency: what happens at all places is in phase.

Double integrals of shapes along a load under its coherence give joint acceptances,

    C_jk = int int s_j(x) s_k(x') rho(|x - x'|) dx dx',    J^2_mn = C_mn / L^2

The mean square of the force of a distributed load on a mode is its density at a place times L^2 J^2_mm; between two
modes, times L^2 J^2_mn. The integral over the distance d = x - x' is taken last,

    C = int_0^L rho(d) (A(d) + A(d)^T) dd,    A_jk(d) = int_0^(L-d) s_j(x + d) s_k(x) dx,

so that the kink of rho at d = 0 lies at an end: all integrals are those of smooth functions, by Gauss's rule. Between
the knots of piecewise polynomials the inner integral is exact.

Source: Powell, On the fatigue failure of structures due to vibrations excited by random pressure fields (1958).

A coherence may be given at some distances, with straight lines in between and 0 beyond the last. Not every curve is a
coherence. A sum of forces cannot have a negative mean square, so that the matrix of the coherences of any places has no
negative eigenvalue (it is positive semidefinite). A curve that falls from 1 on, ever more slowly down to 0, always is
one (Polya's criterion); one with a plateau and a step never is.

Forces that vary smoothly along the beam have rho(d) = exp(-pi d^2 / (4 length^2)), tubes in cross flow
rho(d) = exp(-d / length). The integrals of both over d > 0 are the length: they load waves that are long beside it
alike. One force at all places, such as the sound of a long wave or the flow at the tip of a jet, has rho = 1.

Source: Axisa, Antunes and Villard, Journal of Fluids and Structures 4 (1990), 321-341, for the exponential.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import pairwise
from math import pi
from typing import Annotated, Literal

import numpy as np
import scipy
from pydantic import Field

from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.table import OF_TYPE, NonNegative, Number, Positive, Table
from gapbeam.solver.system.operators import Array


class CoherenceTable(Table, ABC):
    """A coherence over distance."""

    @abstractmethod
    def at(self, distances: Array) -> Array:
        """Return rho at distances of at least 0, m, of any shape."""

    @abstractmethod
    def pieces(self, length: float) -> Array:
        """Return distances, ascending from 0, between which rho is smooth, m; it is 0 beyond the last.

        Args:
            length: Length of the load, m, where the last piece ends at the latest.
        """

    def faults(self, key: Key) -> Iterator[Fault]:  # noqa: ARG002 - for those that override it
        """Yield the faults of the coherence beyond single values.

        Args:
            key: The way to its table in the case, to which a fault adds the key that it is about.
        """
        yield from ()


OUTER = 16  # Gauss points in a piece of the distances

Shapes = Callable[[Array], Array]
"""Shapes at places from 0 to L, (places,) to (places, shapes)."""


def double_integrals(
    shapes: Shapes, coherence: CoherenceTable, length: float, half_waves: float = 20.0, knots: Array | None = None
) -> Array:
    """Return C_jk, (shapes, shapes), which is L^2 J^2_jk: the joint acceptances of the shapes are J^2.

    Args:
        shapes: Shapes as a function of places from 0 to the length.
        coherence: Coherence of the load.
        length: Length L of the load, m.
        half_waves: Most half waves of a shape in the length: what the number of Gauss points follows.
        knots: Places between which the shapes are smooth, m; none: smooth all along.
    """
    inner = int(12 + 2.0 * half_waves)
    given = coherence.pieces(length)
    most = 4.0 * length / (1.0 + half_waves)
    counts = [1 + int(np.ceil((end - start) / most)) for start, end in _pairs(given)]
    cuts = [np.linspace(*pair, count)[1:] for pair, count in zip(_pairs(given), counts, strict=True)]
    edges = np.concatenate([[0.0], *cuts])
    places, weights = np.polynomial.legendre.leggauss(OUTER)
    inside = np.empty(0) if knots is None else knots[(knots > 0.0) & (knots < length)]
    total = 0.0
    for start, end in _pairs(edges):
        distances = 0.5 * (start + end) + 0.5 * (end - start) * places
        rho = 0.5 * (end - start) * weights * coherence.at(distances)
        total = total + sum(
            value * _shifted(shapes, float(distance), length, inner, inside)
            for value, distance in zip(rho, distances, strict=True)
        )
    return np.asarray(total + np.transpose(total))


def _shifted(shapes: Shapes, distance: float, length: float, count: int, knots: Array) -> Array:
    """Return A(d), (shapes, shapes)."""
    edges = np.unique(np.clip(np.concatenate([[0.0, length], knots, knots - distance]), 0.0, length - distance))
    places, weights = np.polynomial.legendre.leggauss(count)
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    x = (middle[:, None] + half[:, None] * places).ravel()
    return np.asarray(shapes(x + distance).T @ ((half[:, None] * weights).ravel()[:, None] * shapes(x)))


def _pairs(edges: Array) -> list[tuple[float, float]]:
    return list(pairwise(map(float, edges)))


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
                f"{len(values)} for {counted(len(distances), 'distance')}",
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
            length = max(float(np.trapezoid(values, distances)), 0.1 * distances[-1])  # with the same integral
            yield Fault(
                (*key, "values"),
                f"a curve that is no coherence: some forces would have a mean square of {least:.2g} times the largest",
                "a positive semidefinite curve, such as one that falls ever more slowly from 1 down to 0",
                f'type = "exponential" with length = {length:.3g}, or values that end at 0 smoothly',
                ((*key, "distances"),),
            )


@lru_cache(maxsize=16)
def _least_eigenvalue(coherence: MeasuredCoherence) -> float:
    """Return the least eigenvalue of the coherences of places at equal distances, over the largest."""
    places = np.asarray(np.linspace(0.0, 4.0 * coherence.distances[-1], PLACES))
    found = scipy.linalg.eigvalsh(scipy.linalg.toeplitz(coherence.at(places)))
    return float(found[0] / found[-1])


REACH = 8.0  # lengths, over which it falls to 1e-22


class GaussianCoherence(CoherenceTable):
    """exp(-pi d^2 / (4 length^2)): of forces without a kink over distance."""

    type: Literal["gaussian"] = Field(description="kind of coherence")
    length: Positive = Field(description="coherence length: the integral of the coherence over distance, m")

    def at(self, distances: Array) -> Array:
        """Return exp(-pi d^2 / (4 length^2))."""
        return np.asarray(np.exp(-0.25 * pi * (distances / self.length) ** 2))

    def pieces(self, length: float) -> Array:
        """Return pieces of at most one coherence length."""
        end = min(length, REACH * self.length)
        return np.asarray(np.linspace(0.0, end, 1 + int(np.ceil(end / self.length))))


EXPONENTIAL_COHERENCE_REACH = 40.0  # lengths, over which it falls to 4e-18


class ExponentialCoherence(CoherenceTable):
    """exp(-d / length): of cross flow, where length is some diameters."""

    type: Literal["exponential"] = Field(description="kind of coherence")
    length: Positive = Field(description="coherence length, m", examples=[0.05])

    def at(self, distances: Array) -> Array:
        """Return exp(-d / length)."""
        return np.asarray(np.exp(-distances / self.length))

    def pieces(self, length: float) -> Array:
        """Return pieces of at most two coherence lengths."""
        end = min(length, EXPONENTIAL_COHERENCE_REACH * self.length)
        return np.asarray(np.linspace(0.0, end, 1 + int(np.ceil(0.5 * end / self.length))))


class FullCoherence(CoherenceTable):
    """1 at all distances."""

    type: Literal["full"] = Field(description="kind of coherence")

    def at(self, distances: Array) -> Array:
        """Return 1."""
        return np.ones(np.shape(distances))

    def pieces(self, length: float) -> Array:
        """Return the whole length."""
        return np.array([0.0, length])


CoherenceChoice = Annotated[ExponentialCoherence | GaussianCoherence | MeasuredCoherence | FullCoherence, OF_TYPE]
