"""Shooting: Newton's method on the period map x -> P(x), the state after p forcing periods.

    (I - P'(x)) dx = P(x) - x

The time scheme gives the map, by a whole number of steps: the result is a periodic response of the discrete system to
the last digits, and approximates one of the continuous system as well as the step allows.

A curve that runs into a known one is followed no further. Responses are the same if their states at the start of a
period agree, or agree after the time is shifted by whole forcing periods, or after both halves of the period are
exchanged with the sign changed, where the system has that symmetry.

Responses are given by their real Fourier series:

y(t) = a_0 + sum_k a_k cos k w t + b_k sin k w t,    coefficients in the order a_0, a_1 ... a_H, b_1 ... b_H
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.periodic.floquet import Stability
from gapbeam.solver.system.operators import Array

SHORTEST_UPDATE = 2.0**-6  # of Newton's update
SLACK = 1.2  # a residual may grow so much before the update is shortened: impacts make the map uneven


class PeriodMap(Protocol):
    """The state after a period as a function of the state at its start."""

    @property
    def scale(self) -> Array:
        """Factors that make the entries of x comparable, (2n,)."""

    def after(self, x: Array) -> Array:
        """Return P(x), (2n,)."""

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return P(x), (2n,), and P'(x), (2n, 2n)."""

    def stability(self, tangent: Array) -> Stability:
        """Return the multipliers of a response from the derivative of this map there, (2n, 2n)."""

    def reach(self, x: Array) -> Array:
        """Return the largest penetration of each face over the period, (faces,), m; negative where it stays open."""

    def part(self, count: int) -> PeriodMap | None:
        """Return the flow over the first of `count` equal parts of the period; None where these have no whole steps."""


class Iterated:
    """A solution by Newton's method.

    Attributes:
        residuals: Relative residual of every iteration, such as the change of the state over a period.
    """

    residuals: tuple[float, ...]

    @property
    def residual(self) -> float:
        """The last one."""
        return self.residuals[-1]

    @property
    def iterations(self) -> int:
        """Newton iterations."""
        return len(self.residuals) - 1


@dataclass(frozen=True)
class Orbit(Iterated):
    """A periodic response, by its state at the start of a period.

    Attributes:
        x: The state, (2n,).
        monodromy: P'(x), (2n, 2n).
        residuals: |P(x) - x| / |x| of every iteration, scaled norms.
    """

    x: Array
    monodromy: Array
    residuals: tuple[float, ...]


def no_pause() -> None:
    """Go on: called between two iterations of a search that nothing can stop."""


def shoot(
    period_map: PeriodMap,
    start: Array,
    tolerance: float = 1.0e-9,
    max_iterations: int = 20,
    pause: Callable[[], None] = no_pause,
) -> Orbit:
    """Find a periodic response near a state.

    Args:
        period_map: P.
        start: State to start from, (2n,).
        tolerance: Largest |P(x) - x| / |x|.
        max_iterations: Limit of Newton iterations.
        pause: Called before every iteration; what it raises ends the search.

    Raises:
        NotConverged: The iterations did not converge; the error has the residual of every one.
    """
    x, length, residuals = start, 1.0, list[float]()
    kept: tuple[Array, Array] | None = None  # where the last update started from, and the update
    for _ in range(max_iterations + 1):
        pause()
        end, tangent = period_map.with_tangent(x)
        residual = relative_change(period_map.scale, x, end)
        shortened = kept is not None and length > SHORTEST_UPDATE and not residual <= SLACK * residuals[-1]
        if kept is not None and shortened:
            length *= 0.5
            x = kept[0] + length * kept[1]
            continue
        residuals.append(residual)
        if not np.isfinite(residual):
            break
        if residual <= tolerance:
            return Orbit(x, tangent, tuple(residuals))
        try:
            update = np.asarray(np.linalg.solve(np.eye(len(x)) - tangent, end - x), dtype=float)
        except np.linalg.LinAlgError:
            break
        kept, length = (x, update), 1.0
        x = x + update
    raise no_orbit(max_iterations, residuals, tolerance)


def no_orbit(max_iterations: int, residuals: Sequence[float], tolerance: float) -> NotConverged:
    """Return the error of a search that ended without a periodic response."""
    return NotConverged(
        f"shooting found no periodic response in {max_iterations} iterations: the state still changes by "
        f"{residuals[-1]:.2e} over a period, relative (allowed: {tolerance:.1e}); start nearer, by a longer march, "
        "try another number of periods, or more steps per period",
        tuple(residuals),
    )


def relative_change(scale: Array, x: Array, end: Array) -> float:
    """Return |end - x| / max(|x|, |end|) in the scaled norm."""
    size = max(np.linalg.norm(scale * x), np.linalg.norm(scale * end))
    change = np.linalg.norm(scale * (end - x))
    return float(change / size) if size > 0.0 else float(change)


SAME = 100.0  # tolerances of the search: relative difference of two states of one response
NEAR = 1.0  # of the distance of two neighbors on a curve; a state farther from their chord is not between them
RECENT = 3  # chords of a curve behind its last point that this point may lie near to without being known


class Passed(Protocol):
    """A point of a curve."""

    @property
    def value(self) -> float:
        """The parameter."""

    @property
    def x(self) -> Array:
        """State at the start of a period, (2n,)."""


@dataclass
class KnownOrbits:
    """The points of all curves so far.

    Attributes:
        map_at: The period map for a value of the parameter.
        images_at: The states of the same response, and of its mirror image, for a value and a state; without the state.
        tolerance: Tolerance of the change over a period, relative.
        curves: Points of each curve, in order.
    """

    map_at: Callable[[float], PeriodMap]
    images_at: Callable[[float, Array], Sequence[Array]]
    tolerance: float
    curves: list[Sequence[Passed]] = field(default_factory=list)

    @property
    def same(self) -> float:
        """Relative difference of two states of one response."""
        return SAME * self.tolerance

    def holds(self, value: float, x: Array, behind: Sequence[Passed] = ()) -> bool:
        """Return whether a response lies on a known curve, or its curve has come back to where it has been.

        Args:
            value: The parameter.
            x: State at the start of a period, (2n,).
            behind: The points of its own curve so far.
        """
        for own, state in [(True, x), *((False, image) for image in self.images_at(value, x))]:
            chords = [chord for curve in self.curves for chord in pairwise(curve)]
            chords += list(pairwise(behind[: len(behind) - RECENT] if own else behind))
            if any(self._is_same(value, state, near) for near in self._between(value, state, chords)):
                return True
        return False

    def _between(self, value: float, x: Array, chords: Sequence[tuple[Passed, Passed]]) -> Iterator[Array]:
        """Yield the states on chords at a value that are near enough to be the state."""
        for first, last in chords:
            low, high = sorted((first.value, last.value))
            if not low <= value <= high:
                continue
            share = (value - first.value) / (last.value - first.value) if last.value != first.value else 0.0
            near = first.x + share * (last.x - first.x)
            scale = self.map_at(value).scale
            length = np.linalg.norm(scale * (last.x - first.x))
            if np.linalg.norm(scale * (x - near)) <= NEAR * length + self.same * np.linalg.norm(scale * x):
                yield near

    def _is_same(self, value: float, x: Array, near: Array) -> bool:
        """Return whether the response next to a known one is a given one."""
        period_map = self.map_at(value)
        try:
            found = shoot(period_map, near, self.tolerance).x
        except NotConverged:
            found = near
        return relative_change(period_map.scale, x, found) <= self.same


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
        """Return the coefficients of the motion under forces, harmonic by harmonic.

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
