"""Beam on end springs, in N/m and N m/rad: frequencies in Hz, and mode shapes up to the thousandth.

Two functions satisfy the equation and the conditions at the free end, with eta = 1 - xi: those of Krylov,

    sum_k z^k eta^(4k) / (4k)!,    sum_k z^k eta^(4k+1) / (4k+1)!,    z = lambda^4,

near z = 0, where they are the rigid motions, and beyond it two that stay below 3 however high the mode,

    exp(-lambda eta) + cos(lambda eta) - sin(lambda eta),
    exp(-lambda xi) + exp(-lambda) (cos(lambda eta) + sin(lambda eta)).

Their ratio follows from the better conditioned of the two conditions at the springs.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from gapbeam.solver.beam_theory.frequency_roots import SERIES_BELOW, EndSprings, roots
from gapbeam.solver.system.operators import Array

_TERMS = 7
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # for z < 5 exact to round-off
SAMPLES = 12  # of a half wave, between which a node is sought


@dataclass(frozen=True)
class ModeShape:
    """y(xi) with the integral of y^2 over [0, 1] equal to 1 and y(1) > 0.

    Attributes:
        mode: n.
        root: lambda_n.
        weights: Of the two functions.
    """

    mode: int
    root: float
    weights: tuple[float, float]

    def __call__(self, xi: Array, derivative: int = 0) -> Array:
        """Return a derivative of y with respect to xi, 0 to 3, at places xi in [0, 1], 0 at the springs."""
        first, second = _functions(self.root, np.asarray(xi, dtype=float), derivative)
        return np.asarray(self.weights[0] * first + self.weights[1] * second)

    @property
    def nodes(self) -> Array:
        """Places of the nodes in 0 < xi < 1, ascending; n - 1 of them."""
        places = np.asarray(np.linspace(0.0, 1.0, SAMPLES * (self.mode + 2))[1:], dtype=np.float64)
        values = self(places)
        changes = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0.0)
        found = [brentq(lambda xi: float(self(np.array(xi))), places[at], places[at + 1]) for at in changes]
        return np.array(sorted([*found, *places[values == 0.0]]))


def mode_shape(mode: int, draught: float, torsion: float, root: float | None = None) -> ModeShape:
    """Return the shape of mode n.

    Args:
        mode: n >= 1.
        draught: s1 = k1 l^3 / E I in [0, inf].
        torsion: s2 = k2 l / E I in [0, inf].
        root: lambda_n, where it is known already.

    Returns:
        The shape. The free beam has two rigid motions: its mode 1 is the translation, mode 2 turns about the middle.

    Raises:
        ValueError: The mode is not a positive integer, or a spring is negative or not a number.
    """
    root = float(roots(mode, draught, torsion)) if root is None else root
    springs = EndSprings.of(draught, torsion)
    if mode <= 2 and int(springs.rigid_motions) == 2:
        return ModeShape(mode, root, (1.0, 0.0) if mode == 1 else (sqrt(3.0), -2.0 * sqrt(3.0)))
    at_springs = np.array([[float(each) for each in _functions(root, np.array(0.0), order)] for order in range(4)])
    rows = [
        float(springs.loose) * at_springs[3] + float(springs.held) * at_springs[0],
        float(springs.hinged) * at_springs[2] - float(springs.clamped) * at_springs[1],
    ]
    sizes = (
        float(springs.loose) * np.abs(at_springs[3]).max() + float(springs.held) * np.abs(at_springs[0]).max(),
        float(springs.hinged) * np.abs(at_springs[2]).max() + float(springs.clamped) * np.abs(at_springs[1]).max(),
    )
    conditioning = [np.linalg.norm(row) / size if size > 0.0 else 0.0 for row, size in zip(rows, sizes, strict=True)]
    row = rows[int(np.argmax(conditioning))]
    raw = ModeShape(mode, root, (float(-row[1]), float(row[0])))
    scale = 1.0 / sqrt(_square_integral(raw))
    if raw(np.array(1.0)) < 0.0:
        scale = -scale
    return ModeShape(mode, root, (scale * raw.weights[0], scale * raw.weights[1]))


def _square_integral(shape: ModeShape) -> float:
    """Return the integral of y^2: 4 z int y^2 = [3 y y''' - y' y'' + xi (z y^2 - 2 y' y''' + y''^2)] from 0 to 1."""
    if shape.root < SERIES_BELOW:
        return float(0.5 * _WEIGHTS @ shape(0.5 * (1.0 + _POINTS)) ** 2)
    y, slope, moment, shear = (float(shape(np.array(0.0), order)) for order in range(4))
    end = float(shape(np.array(1.0)))
    return 0.25 * (end * end - (3.0 * y * shear - slope * moment) / shape.root**4)


def _functions(root: float, xi: Array, derivative: int) -> tuple[Array, Array]:
    """Return a derivative of both functions at places."""
    if root < SERIES_BELOW:
        return _krylov(root**4, 1.0 - xi, derivative, 0), _krylov(root**4, 1.0 - xi, derivative, 1)
    angle = root * (1.0 - xi)
    less, more = np.cos(angle) - np.sin(angle), np.cos(angle) + np.sin(angle)
    waves = [(less, more), (more, -less), (-less, -more), (-more, less)][derivative]
    first = np.exp(-angle) + waves[0]
    second = (-1.0) ** derivative * np.exp(-root * xi) + np.exp(-root) * waves[1]
    return root**derivative * first, root**derivative * second


def _krylov(z: float, eta: Array, derivative: int, power: int) -> Array:
    """Return a derivative with respect to xi = 1 - eta of sum_k z^k eta^(4k + power) / (4k + power)!."""
    total = np.zeros_like(eta)
    for k in range(_TERMS):
        left = 4 * k + power - derivative
        if left >= 0:
            total += z**k * eta**left / factorial(left)
    return (-1.0) ** derivative * total


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
