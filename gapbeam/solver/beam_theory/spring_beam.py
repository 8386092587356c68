"""A beam on end springs with its dimensions: stiffness in N/m and N m/rad, frequencies in Hz."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.beam_theory.frequency_roots import roots
from gapbeam.solver.beam_theory.mode_shapes_of_theory import ModeShape, mode_shape
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class SpringBeam:
    """An Euler-Bernoulli beam; f_n = lambda_n^2 / (2 pi l^2) sqrt(E I / rho A).

    Attributes:
        length: l, m.
        bending: E I, N m^2.
        mass: rho A, kg/m.
    """

    length: float
    bending: float
    mass: float

    @property
    def draught_unit(self) -> float:
        """E I / l^3, N/m: k1 = s1 times that."""
        return self.bending / self.length**3

    @property
    def torsion_unit(self) -> float:
        """E I / l, N m/rad: k2 = s2 times that."""
        return self.bending / self.length

    @property
    def frequency_unit(self) -> float:
        """sqrt(E I / rho A) / (2 pi l^2), Hz: f = lambda^2 times that."""
        return sqrt(self.bending / self.mass) / (2.0 * pi * self.length**2)

    def roots(self, modes: ArrayLike, draught: ArrayLike, torsion: ArrayLike) -> Array:
        """Return lambda_n for springs k1 (N/m) and k2 (N m/rad), all of shapes that broadcast; see `roots`."""
        return roots(modes, np.asarray(draught) / self.draught_unit, np.asarray(torsion) / self.torsion_unit)

    def frequencies(self, modes: ArrayLike, draught: ArrayLike, torsion: ArrayLike) -> Array:
        """Return f_n, Hz, for springs k1 (N/m) and k2 (N m/rad), all of shapes that broadcast; see `roots`."""
        return np.asarray(self.frequency_unit * self.roots(modes, draught, torsion) ** 2)

    def shape(self, mode: int, draught: float, torsion: float) -> ModeShape:
        """Return the shape of mode n over xi = x / l, x from the springs; see `mode_shape`."""
        return mode_shape(mode, draught / self.draught_unit, torsion / self.torsion_unit)

    def sensitivities(self, modes: ArrayLike, draught: float, torsion: float, known: Array | None = None) -> Array:
        """Return d ln f_n / d (ln k1, ln k2), (modes, 2).

        A root moves as its shape moves the spring: d lambda^4 / d s1 = y(0)^2, d lambda^4 / d s2 = y'(0)^2, with y
        normalized. So an entry is half of the spring's share of the elastic energy, and both together are at most 1/2.

        Args:
            modes: Numbers n, (modes,).
            draught: k1, N/m, finite.
            torsion: k2, N m/rad, finite.
            known: lambda_n, (modes,), where they are known already.
        """
        numbers = np.atleast_1d(modes)
        springs = draught / self.draught_unit, torsion / self.torsion_unit
        found = np.zeros((len(numbers), 2))
        for row, root in enumerate(roots(numbers, *springs) if known is None else known):
            shape = mode_shape(int(numbers[row]), *springs, float(root))
            y, slope, moment, shear = (float(shape(np.array(0.0), order)) for order in range(4))
            if shape.root > 0.0:  # s1 y(0)^2 = -y y''', s2 y'(0)^2 = y' y''
                found[row] = 0.5 * np.array([-y * shear, slope * moment]) / shape.root**4
        return found
