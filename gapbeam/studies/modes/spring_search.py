"""The search for end springs, and a length, with given frequencies: a map of the misfit, and least squares from it.

The unknowns are ln k1, ln k2 and, if asked for, ln l; the residuals ln f_n - ln f_n,given.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import exp, log

import numpy as np
from scipy.ndimage import minimum_filter
from scipy.optimize import least_squares

from gapbeam.solver.beam_theory.frequency_roots import roots
from gapbeam.solver.beam_theory.spring_beam import SpringBeam
from gapbeam.solver.system.operators import Array, Indices

LOWEST, HIGHEST = 1.0e-6, 1.0e9  # of the map, in units of E I / l^3 and E I / l
PER_DECADE = 4
NO_ROOT = 1.0e-12  # a root of 0 has a misfit like this one
STARTS = 4  # valleys that are searched


@dataclass(frozen=True)
class Found:
    """Where a search ended.

    Attributes:
        x: Unknowns ln k1, ln k2 (and ln l), (unknowns,).
        cost: Half of the sum of squares.
        jacobian: Slopes of the residuals, (modes, unknowns).
    """

    x: Array
    cost: float
    jacobian: Array


@dataclass(frozen=True)
class SpringSearch:
    """A beam and the frequencies that it shall have.

    Attributes:
        beam: The beam; its length is an unknown where `lengths` says so.
        modes: Numbers n, (modes,).
        wanted: ln f_n, given, (modes,), f_n in Hz.
        lengths: Least and greatest length, m; None: that of the beam.
    """

    beam: SpringBeam
    modes: Indices
    wanted: Array
    lengths: tuple[float, float] | None

    def beam_of(self, x: Array) -> SpringBeam:
        """Return the beam with the length among the unknowns."""
        return self.beam if self.lengths is None else replace(self.beam, length=exp(x[2]))

    def roots(self, x: Array) -> Array:
        """Return lambda_n, (modes,)."""
        return self.beam_of(x).roots(self.modes, *np.exp(x[:2]))

    def residuals(self, x: Array, found: Array) -> Array:
        """Return the residuals, (modes,), from the roots."""
        return np.asarray(2.0 * np.log(np.maximum(found, NO_ROOT)) + log(self.beam_of(x).frequency_unit) - self.wanted)

    def jacobian(self, x: Array, found: Array) -> Array:
        """Return their slopes, (modes, unknowns); d ln f / d ln l = 3 d ln f / d ln k1 + d ln f / d ln k2 - 2."""
        draught, torsion = np.exp(x[:2])
        slopes = self.beam_of(x).sensitivities(self.modes, draught, torsion, found)
        if self.lengths is None:
            return slopes
        return np.column_stack([slopes, slopes @ np.array([3.0, 1.0]) - 2.0])

    def bounds(self, beam: SpringBeam) -> tuple[Array, Array]:
        """Return ends of the unknowns."""
        units = np.log([beam.draught_unit, beam.torsion_unit])
        low, high = units + log(LOWEST), units + log(HIGHEST)
        if self.lengths is None:
            return low, high
        return np.append(low - 1.0, log(self.lengths[0])), np.append(high + 1.0, log(self.lengths[1]))

    def starts(self) -> list[Array]:
        """Return the unknowns at the bottom of the deepest valleys of the map."""
        lengths = [self.beam.length] if self.lengths is None else list(np.linspace(*self.lengths, 5))
        found = []
        draught, torsion, logarithms = _map(tuple(int(mode) for mode in self.modes))
        for length in lengths:
            beam = replace(self.beam, length=length)
            misfits = np.sum((logarithms + log(beam.frequency_unit) - self.wanted[:, None, None]) ** 2, axis=0)
            rows, columns = np.nonzero(misfits == minimum_filter(misfits, size=3, mode="nearest"))
            for row, column in zip(rows, columns, strict=True):
                x = [log(draught[row] * beam.draught_unit), log(torsion[column] * beam.torsion_unit)]
                found.append((misfits[row, column], np.array(x if self.lengths is None else [*x, log(length)])))
        found.sort(key=lambda each: float(each[0]))
        return [x for _, x in found[:STARTS]]

    def search(self, start: Array, held: int | None = None) -> Found:
        """Search from a start, with one unknown held where it is if asked for."""
        low, high = self.bounds(self.beam)
        free = np.arange(len(start)) != held
        width = 1e-9 * (high - low)

        def whole(part: Array) -> Array:
            x = start.copy()
            x[free] = part
            return x

        seen: dict[bytes, Array] = {}  # residuals and slopes are asked for at the same place

        def found(x: Array) -> Array:
            if x.tobytes() not in seen:
                seen[x.tobytes()] = self.roots(x)
            return seen[x.tobytes()]

        result = least_squares(
            lambda part: self.residuals(x := whole(part), found(x)),
            np.clip(start, low + width, high - width)[free],
            lambda part: self.jacobian(x := whole(part), found(x))[:, free],
            bounds=(low[free], high[free]),
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-14,
        )
        x = whole(result.x)
        return Found(x, float(result.cost), self.jacobian(x, found(x)))


@cache
def _map(modes: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """Return s1 (r,), s2 (c,) and 2 ln lambda_n (modes, r, c)."""
    points = round(PER_DECADE * np.log10(HIGHEST / LOWEST)) + 1
    springs = np.logspace(np.log10(LOWEST), np.log10(HIGHEST), points)
    found = roots(np.array(modes)[:, None, None], springs[:, None], springs)
    return springs, springs, 2.0 * np.log(np.maximum(found, NO_ROOT))
