"""Harmonic balance: the periodic response as a Fourier series, contact by samples in time.

    Z_k Q_k = F_k + Phi^T f_k,    Z_k = s - (k w)^2 + i k w C,    f = weights p(d, d'),    d = -(g0 + Phi q)

in the modal coordinates of a dense system. The forces f are found at N instants of a period and taken back to
harmonics (alternating frequency-time; Cameron and Griffin 1989), their Jacobian likewise. At an instant stands the mean
pressure over the N-th part of the period around it, the discrete gradient of the law: it is continuous in the motion
where the law itself, sampled, would jump at touch, and off by the square of that time.

Gaps see q through r = rank(Phi) traces only: Phi = U V, y = V q. With springs sigma_k on the traces, taken off again
on the right, the mean of a body that contact alone holds is not singular either:

    y_k = V Z'_k^-1 (F_k + V^T (U^T f_k + sigma_k y_k)),    Z'_k = Z_k + sigma_k V^T V,    sigma_k = 0 for k > 0

These are r (2 H + 1) equations, solved by Newton's method with a line search. sigma leaves no trace in the answer.

Consumers of marched steps take a harmonic solution as steps: states of the series at the ends of a step, its balance in
the middle. The energy ledger is then a quadrature by the midpoint rule, and its residual the power of what the
harmonics leave of the balance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, step_slopes
from gapbeam.solver.contact.solve.contact_solve import UNRESOLVED
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.periodic.shooting import Fourier, Iterated, no_pause
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, Stage, State, Step, imaged

MOST_UNKNOWNS = 8000  # 0.5 GB for the Jacobian, and half a minute for its factorization
NO_TRACE = 1.0e-12  # of the largest singular value
SHORTEST_UPDATE = 2.0**-8


@dataclass(frozen=True)
class HarmonicSolution(Iterated):
    """A solution of the balance.

    Attributes:
        series: Harmonics, samples and base frequency.
        traces: Coefficients of y, (2 H + 1, r), m.
        coordinates: Coefficients of the modal coordinates q, (2 H + 1, n).
        residuals: |R| / |y| of every iteration.
        truncated: Norm of the contact forces beyond harmonic H, relative to all but their mean.
    """

    series: Fourier
    traces: Array
    coordinates: Array
    residuals: tuple[float, ...]
    truncated: float

    def motion(self, times: Array) -> tuple[Array, Array, Array]:
        """Return q, q', q'' at any instants, (times, n) each."""
        waves = self.series.waves_at(times)
        rates = self.series.rates(self.coordinates)
        return waves @ self.coordinates, waves @ rates, waves @ self.series.rates(rates)


@dataclass(frozen=True)
class HarmonicBalance:
    """The equations for one number of harmonics.

    Attributes:
        modal: The system; its loads are those of the steady state.
        law: Contact law.
        series: Harmonics, samples and base frequency.
    """

    modal: ModalSystem
    law: ContactLaw
    series: Fourier
    pause: Callable[[], None] = no_pause

    def solve(self, start: Array, tolerance: float = 1.0e-9, max_iterations: int = 40) -> HarmonicSolution:
        """Solve the balance from a start.

        Args:
            start: Coefficients of y, (2 H + 1, r), m.
            tolerance: Largest |R| / |y|.
            max_iterations: Limit.

        Raises:
            NotConverged: The iterations did not converge; the error has the residual of every one.
            UserError: There are more unknowns than a dense Jacobian is good for.
        """
        self.refuse_large()
        y, residuals = start, list[float]()
        missed, forces = self._residual(y)
        for _ in range(max_iterations + 1):
            self.pause()
            size = max(float(np.linalg.norm(y)), np.finfo(float).tiny)
            residuals.append(float(np.linalg.norm(missed)) / size)
            if residuals[-1] <= tolerance:
                return HarmonicSolution(self.series, y, self._coordinates(forces), tuple(residuals), self._truncated(y))
            try:
                update = -np.linalg.solve(self._jacobian(y), missed.reshape(-1)).reshape(y.shape)
            except np.linalg.LinAlgError:
                break
            length = 1.0
            while True:
                tried, tried_forces = self._residual(y + length * update)
                if np.linalg.norm(tried) < (1.0 - 1.0e-4 * length) * np.linalg.norm(missed):
                    break
                length *= 0.5
                if length < SHORTEST_UPDATE:
                    raise self._failure(residuals)
            y, missed, forces = y + length * update, tried, tried_forces
        raise self._failure(residuals)

    @cached_property
    def basis(self) -> tuple[Array, Array]:
        """U, (m, r), with orthonormal columns, and V, (r, n)."""
        left, values, right = np.linalg.svd(self.modal.gaps, full_matrices=False)
        kept = values > NO_TRACE * max(float(np.max(values, initial=0.0)), np.finfo(float).tiny)
        return left[:, kept], values[kept, None] * right[kept]

    @property
    def unknowns(self) -> int:
        """Number of unknowns, r (2 H + 1)."""
        return self.basis[1].shape[0] * self.series.size

    @cached_property
    def _springs(self) -> float:
        """sigma_0, 1/s^2 over the square of V."""
        stiffest = float(np.max(np.sum(self.basis[1] ** 2, axis=1), initial=0.0))
        return self.series.omega**2 / stiffest if stiffest > 0.0 else 0.0

    @cached_property
    def _responses(self) -> tuple[Array, Array]:
        """Z'_k^-1 V^T, (H + 1, n, r), and Z'_k^-1 F_k as coefficients, (2 H + 1, n)."""
        modal, series, v = self.modal, self.series, self.basis[1]
        speeds = series.omega * np.arange(series.harmonics + 1)
        factors = np.array([[load.factor(time) for load in modal.system.loads] for time in series.times])
        loads = series.analyze(factors.reshape(series.samples, len(modal.loads)) @ modal.loads)
        damping = np.diag(modal.damping) + modal.dashpots.matrix
        inverses = np.empty((series.harmonics + 1, len(modal.squares), len(modal.squares)), dtype=complex)
        for k, speed in enumerate(speeds):
            dynamic = np.diag(modal.squares - speed**2) + 1j * speed * damping
            try:
                inverses[k] = np.linalg.inv(dynamic + (self._springs * (v.T @ v) if k == 0 else 0.0))
            except np.linalg.LinAlgError:
                raise NotConverged(
                    f"harmonic {k} of the response, {speed / (2.0 * np.pi):.4g} Hz, meets an undamped mode: no "
                    "response is bounded; add damping, or change the frequency"
                ) from None
        return inverses @ v.T, series.respond(inverses, loads)

    @cached_property
    def _trace_responses(self) -> tuple[Array, Array]:
        """V Z'_k^-1 V^T, (H + 1, r, r), and V Z'_k^-1 F_k as coefficients, (2 H + 1, r)."""
        columns, driven = self._responses
        return self.basis[1] @ columns, driven @ self.basis[1].T

    def _residual(self, y: Array) -> tuple[Array, Array]:
        """Return R, (2 H + 1, r), and the coefficients of U^T f_k + sigma_k y_k, (2 H + 1, r)."""
        forces = self.series.analyze(self._sampled_forces(y))
        forces[0] += self._springs * y[0]
        compliance, driven = self._trace_responses
        return y - driven - self.series.respond(compliance, forces), forces

    def _sampled_forces(self, y: Array) -> Array:
        """Return U^T f around the samples, (N, r)."""
        pressure = self.law.discrete_gradient(*self._depths(y), self._interval).pressure
        return np.asarray((self.modal.system.contact.weights * pressure) @ self.basis[0])

    def _jacobian(self, y: Array) -> Array:
        old, new = self._depths(y)
        touched = np.flatnonzero(np.any(np.maximum(old, new) > 0.0, axis=0))
        weights, u, series, dt = self.modal.system.contact.weights, self.basis[0][touched], self.series, self._interval
        slopes = step_slopes(self.law, False, old, new, dt)
        shifts = (-0.5 * dt, 0.5 * dt)
        by_point = sum(
            series.shifted_columns(series.multiplication((weights * slope)[:, touched]), shift)
            for slope, shift in zip(slopes, shifts, strict=True)
        )
        size, r = series.size, u.shape[1]
        products = (u[:, :, None] * u[:, None, :]).reshape(len(touched), r * r)
        stiffness = (np.asarray(by_point).reshape(size * size, -1) @ products).reshape(size, size, r, r)
        forces = -stiffness.transpose(0, 2, 1, 3)
        forces[0, :, 0, :] += self._springs * np.eye(r)
        flat = series.respond(self._trace_responses[0], forces.reshape(size, r, size * r)).reshape(size * r, size * r)
        return np.asarray(np.eye(size * r) - flat)

    @property
    def _interval(self) -> float:
        """The N-th part of a period, s."""
        return 2.0 * np.pi / (self.series.omega * self.series.samples)

    @cached_property
    def _waves_before(self) -> Array:
        """The series half an interval before the samples, (N, 2 H + 1)."""
        return self.series.waves_at(self.series.times - 0.5 * self._interval)

    def _depths(self, y: Array) -> tuple[Array, Array]:
        """Return d half an interval before and behind the samples, (N, m) each."""
        before = -(self.modal.system.contact.initial_gap + self._waves_before @ (y @ self.basis[0].T))
        return before, np.roll(before, -1, axis=0)

    def _coordinates(self, forces: Array) -> Array:
        columns, driven = self._responses
        return np.asarray(driven + self.series.respond(columns, forces))

    def _truncated(self, y: Array) -> float:
        forces = self._sampled_forces(y)
        kept = self.series.waves @ self.series.analyze(forces)
        whole = float(np.linalg.norm(forces - forces.mean(axis=0)))
        return float(np.linalg.norm(forces - kept)) / whole if whole > 0.0 else 0.0

    def refuse_large(self) -> None:
        """Refuse more unknowns than a dense Jacobian is good for.

        Raises:
            UserError: There are more unknowns.
        """
        if self.unknowns > MOST_UNKNOWNS:
            rank = self.basis[1].shape[0]
            raise UserError(
                f"harmonic balance: {rank} contact traces times {self.series.size} coefficients are "
                f"{self.unknowns} unknowns, a dense Jacobian of {8e-9 * self.unknowns**2:.2g} GB\n"
                f"  expected: at most {MOST_UNKNOWNS} unknowns\n"
                f"  try:      at most {max((MOST_UNKNOWNS // max(rank, 1) - 1) // 2, 1)} harmonics, a model with "
                "fewer modes or contact points, or shooting"
            )

    def _failure(self, residuals: list[float]) -> NotConverged:
        return NotConverged(
            f"harmonic balance with {self.series.harmonics} harmonics did not converge in {len(residuals) - 1} "
            f"iterations: {min(residuals):.2e} of the response is left; start from a march, or use shooting",
            tuple(residuals),
        )


def series_steps(
    modal: ModalSystem, law: ContactLaw, solution: HarmonicSolution, dt: float, steps: int
) -> tuple[State, Iterator[Step]]:
    """Return the state at t = 0 and the steps that follow.

    Args:
        modal: The system.
        law: Its contact law.
        solution: The harmonics.
        dt: Step, s.
        steps: Number of steps.
    """
    places, speeds, rates = solution.motion(np.asarray(0.5 * dt * np.arange(2 * steps + 1), dtype=float))
    operators, weights = modal.system.operators, modal.system.contact.weights
    depths = -(modal.system.contact.initial_gap + places[::2] @ modal.gaps.T)
    before = law.discrete_gradient(depths[-2], depths[-1], dt).pressure

    def state(number: int, pressure: Array) -> State:
        u, v = (imaged(operators, modal.dofs(part[2 * number])) for part in (places, speeds))
        return State(dt * number, u, v, depths[number], pressure)

    def walk(old: State) -> Iterator[Step]:
        for number in range(steps):
            middle = 2 * number + 1
            u, v, a = (imaged(operators, modal.dofs(part[middle])) for part in (places, speeds, rates))
            law_there = law.discrete_gradient(depths[number], depths[number + 1], dt)
            factors = modal.system.load_factors(0.5 * dt * middle)
            unresolved = UNRESOLVED * float(np.max(np.abs(depths[number]))) * float(weights @ law_there.pressure)
            stage = Stage(
                factors, a[MASS] + u[STIFFNESS], v, law_there.pressure, law_there.elastic, unresolved=unresolved
            )
            new = state(number + 1, law_there.pressure)
            yield Step(old, new, stage, 0, timings={"back_substitution": 0.0})
            old = new

    start = state(0, before)
    return start, walk(start)
