"""The elastic part of a contact law, per area: p = K d^n for d > 0."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.operators import Array

FAR_APART = 1.0e-3  # of the depth: beyond it the difference quotient of the potential is exact enough
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Spring:
    """K > 0 (Pa/m^n) and n >= 1.

    Attributes:
        stiffness: K, Pa/m^n, one number or one per point, (m,).
        exponent: n; 1 is linear, 1.5 that of Hertz.
    """

    stiffness: float | Array
    exponent: float = 1.0

    def pressure(self, depth: Array) -> Array:
        """Return K <d>^n, Pa."""
        closed = np.maximum(depth, 0.0)
        return np.asarray(self.stiffness * (closed if self.exponent == 1.0 else closed**self.exponent))

    def slope(self, depth: Array) -> Array:
        """Return n K d^(n-1) where closed, else 0, Pa/m."""
        if self.exponent == 1.0:
            return np.where(depth > 0.0, self.stiffness, 0.0)
        closed = np.maximum(depth, 0.0)
        return np.asarray(self.exponent * self.stiffness * closed ** (self.exponent - 1.0))

    def potential(self, depth: Array) -> Array:
        """Return psi = K <d>^(n+1) / (n+1), J/m^2."""
        closed = np.maximum(depth, 0.0)
        power = self.exponent + 1.0
        return np.asarray(self.stiffness / power * closed**power)

    def mean(self, old: Array, new: Array) -> tuple[Array, Array]:
        """Return the discrete gradient (psi(d1) - psi(d0)) / (d1 - d0) and its slope in d1.

        Both are written without cancellation: exactly for n = 1, by Gauss-Legendre quadrature of K d^n between two
        close depths otherwise.
        """
        return self._linear_mean(old, new) if self.exponent == 1.0 else self._power_mean(old, new)

    def _linear_mean(self, old: Array, new: Array) -> tuple[Array, Array]:
        mean, slope = np.zeros_like(new), np.zeros_like(new)
        half = np.broadcast_to(0.5 * self.stiffness, new.shape)
        was, closes = old > 0.0, new > 0.0
        # few points touch at all; ratios first: squares of tiny depths would underflow
        stays = np.nonzero(was & closes)
        mean[stays], slope[stays] = half[stays] * (new[stays] + old[stays]), half[stays]
        lands = np.nonzero(closes & ~was)
        start, end, stiffness = old[lands], new[lands], half[lands]
        apart = end - start
        mean[lands] = stiffness * (end * (end / apart))
        slope[lands] = stiffness * (end / apart) * ((end - 2.0 * start) / apart)
        leaves = np.nonzero(was & ~closes)
        start, stiffness = old[leaves], half[leaves]
        apart = start - new[leaves]
        mean[leaves], slope[leaves] = stiffness * (start * (start / apart)), stiffness * (start / apart) ** 2
        return mean, slope

    def _power_mean(self, old: Array, new: Array) -> tuple[Array, Array]:
        apart = new - old
        close = np.abs(apart) <= FAR_APART * np.maximum(np.abs(old), np.abs(new))
        divisor = np.where(close, 1.0, apart)
        mean = (self.potential(new) - self.potential(old)) / divisor
        slope = (self.pressure(new) - mean) / divisor
        if np.any(close):
            shares = 0.5 * (1.0 + _NODES)
            between = old + np.multiply.outer(shares, apart)
            mean = np.where(close, np.tensordot(0.5 * _WEIGHTS, self.pressure(between), 1), mean)
            slope = np.where(close, np.tensordot(0.5 * _WEIGHTS * shares, self.slope(between), 1), slope)
        return mean, np.maximum(slope, 0.0)
