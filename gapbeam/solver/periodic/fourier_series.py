"""Real Fourier series of a period, and what multiplication by a periodic function does to their coefficients.

y(t) = a_0 + sum_k a_k cos k w t + b_k sin k w t,    coefficients in the order a_0, a_1 ... a_H, b_1 ... b_H
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class Fourier:
    """Harmonics up to H, sampled N times a period.

    Attributes:
        harmonics: H.
        samples: N > 4 H: products of two series and a third are not aliased onto harmonics up to H.
        omega: w, rad/s.
    """

    harmonics: int
    samples: int
    omega: float

    @property
    def size(self) -> int:
        """Number of coefficients, 2 H + 1."""
        return 2 * self.harmonics + 1

    @property
    def times(self) -> Array:
        """Instants of the samples, (N,), s."""
        return np.asarray(2.0 * np.pi / self.omega * np.arange(self.samples) / self.samples)

    @cached_property
    def waves(self) -> Array:
        """The series of each coefficient at the samples, (N, 2 H + 1)."""
        return self.waves_at(self.times)

    def waves_at(self, times: Array) -> Array:
        """Return the series of each coefficient at any instants, (times, 2 H + 1)."""
        angles = np.outer(self.omega * times, np.arange(1, self.harmonics + 1))
        return np.concatenate([np.ones((len(times), 1)), np.cos(angles), np.sin(angles)], axis=1)

    def analyze(self, values: Array) -> Array:
        """Return the coefficients, (2 H + 1, r), of sampled values, (N, r)."""
        mean, *rest = np.fft.rfft(values, axis=0)[: self.harmonics + 1] / self.samples
        waves = 2.0 * np.array(rest).reshape(self.harmonics, *values.shape[1:])
        return np.concatenate([mean.real[None], waves.real, -waves.imag])

    def rates(self, coefficients: Array) -> Array:
        """Return the coefficients of y'."""
        a, b = self._parts(coefficients)
        speeds = self._speeds(coefficients)
        return np.concatenate([np.zeros_like(coefficients[:1]), speeds * b, -speeds * a])

    def respond(self, compliance: Array, forces: Array) -> Array:
        """Return the coefficients of what answers to forces, harmonic by harmonic.

        Args:
            compliance: D_k for k = 0 ... H, complex, (H + 1, r, s): the answer to e^(i k w t) is D_k e^(i k w t).
            forces: Coefficients, (2 H + 1, s) or (2 H + 1, s, columns).
        """
        a, b = self._parts(forces)
        real, imaginary = compliance.real, compliance.imag
        mean = np.tensordot(real[0], forces[0], axes=1)[None]

        def times(matrices: Array, vectors: Array) -> Array:
            flat = vectors.reshape(*vectors.shape[:2], -1)
            return np.asarray(matrices[1:] @ flat).reshape(self.harmonics, matrices.shape[1], *vectors.shape[2:])

        return np.concatenate([mean, times(real, a) + times(imaginary, b), times(real, b) - times(imaginary, a)])

    def multiplication(self, factors: Array) -> Array:
        """Return the matrix from coefficients of y to those of f y, for sampled factors f.

        Args:
            factors: f at the samples, (N, ...).

        Returns:
            Array of shape (2 H + 1, 2 H + 1, ...).
        """
        count = self.harmonics
        spectrum = np.fft.rfft(factors, axis=0)[: 2 * count + 1] / self.samples
        even, odd = spectrum.real, -spectrum.imag  # means of f cos m w t and of f sin m w t, m = 0 ... 2 H
        k = np.arange(count + 1)
        total, apart = k[:, None] + k, np.abs(k[:, None] - k)
        sign = np.sign(k[:, None] - k).reshape(count + 1, count + 1, *(1,) * (factors.ndim - 1))
        cosines = even[apart] + even[total]
        mixed = odd[total] + sign * odd[apart]  # rows of sines, columns of cosines
        sines = even[apart] - even[total]
        other = odd[total] - sign * odd[apart]
        left = np.concatenate([cosines, mixed[1:]])
        right = np.concatenate([other[:, 1:], sines[1:, 1:]])
        whole = np.concatenate([left, right], axis=1)
        whole[0] *= 0.5
        return np.asarray(whole)

    def shifted_columns(self, matrix: Array, ahead: float) -> Array:
        """Return the matrix from coefficients of y to those of f(t) y(t + ahead), for a matrix of `multiplication`."""
        count = self.harmonics
        angles = (self.omega * ahead * np.arange(1, count + 1)).reshape(1, count, *(1,) * (matrix.ndim - 2))
        cosines, sines = matrix[:, 1 : count + 1], matrix[:, count + 1 :]
        parts = (
            matrix[:, :1],
            np.cos(angles) * cosines - np.sin(angles) * sines,
            np.sin(angles) * cosines + np.cos(angles) * sines,
        )
        return np.concatenate(parts, axis=1)

    def extended(self, coefficients: Array, harmonics: int) -> Array:
        """Return coefficients, (2 H + 1, r), with zeros for harmonics up to another, or without those above it."""
        a, b = self._parts(coefficients)
        kept = min(harmonics, self.harmonics)
        more = np.zeros((harmonics - kept, *coefficients.shape[1:]))
        return np.concatenate([coefficients[:1], a[:kept], more, b[:kept], more])

    def amplitudes(self, coefficients: Array) -> Array:
        """Return sqrt(a_k^2 + b_k^2), (H, r)."""
        return np.hypot(*self._parts(coefficients))

    def _parts(self, coefficients: Array) -> tuple[Array, Array]:
        return coefficients[1 : self.harmonics + 1], coefficients[self.harmonics + 1 :]

    def _speeds(self, coefficients: Array) -> Array:
        speeds = self.omega * np.arange(1, self.harmonics + 1)
        return np.asarray(speeds.reshape(-1, *(1,) * (coefficients.ndim - 1)))
