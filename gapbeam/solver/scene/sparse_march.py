"""Marches by one back-substitution a step: of large structures, and of contacts at points that move."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.lane_code import kernels
from gapbeam.solver.scene.linear_scheme import MIDPOINT, Linear
from gapbeam.solver.scene.marcher import TOLERANCE, Marcher
from gapbeam.solver.scene.moving_point import MovingPoint
from gapbeam.solver.scene.step_kernel import DAMPED, WALLED
from gapbeam.solver.system.dense_operators import SparseFactor
from gapbeam.solver.system.operators import Array


class SparseMarcher(Marcher):
    """A march in the degrees of freedom of the structures; one lane. A step is one back-substitution."""

    M: Any
    C: Any
    K: Any
    factor: Any

    def condensed(self) -> Linear:
        """Return the arrays of the scene for the step; factors the effective operator."""
        scene, h, scheme = self.scene, self.h, self.scheme
        if scheme.exact and scene.is_large:
            raise UserError("march: exact frequencies are for modes; reduce the structure: structure.reduced(modes)")

        def block(name: str) -> Any:
            parts = (getattr(one, name) for one in scene.structures)
            zero = (sp.csr_matrix((one.size, one.size)) for one in scene.structures)
            return sp.block_diag(
                [none if part is None else sp.csr_matrix(part) for part, none in zip(parts, zero, strict=True)],
                format="csr",
            )

        if scene.is_large:
            self.M, self.C, self.K = block("M"), block("C"), block("K")
        else:
            C = scene.damping
            self.M, self.K = sp.identity(scene.size, format="csr"), sp.diags(scene.squares, format="csr")
            self.C = sp.diags(C[0], format="csr") if len(C) == 1 else sp.csr_matrix(C)
        effective = scheme.inertia[0] / h * self.M + scheme.drag[0] * self.C + scheme.level * h * self.K
        skew = abs(self.C - self.C.T).max() if self.C.nnz else 0.0
        # a symmetric factor has less fill
        self.factor = (SparseFactor if skew == 0.0 else sla.splu)(sp.csc_matrix(effective))

        def solve(right: Array) -> Array:
            return np.asarray(self.factor.solve(np.asfortranarray(right))) if right.size else np.zeros(right.shape)

        none = np.zeros(0)
        return scene.linear(h, scheme, none, none[None], none, none[None], none, solve)

    def without_inertia(self, force: Array) -> Array:
        """Return M^-1 (force - C v - K q)."""
        found: Array = sla.splu(sp.csc_matrix(self.M)).solve(force - self.C @ self.v - self.K @ self.q)
        return found

    def march(self, steps: int, loads: Array, walls: Array) -> int:
        """March so many steps into `kept`; see `Marcher.march`."""
        A, h, meet, kept, total = self.linear, self.h, kernels(1)["meet"], self.kept, 0
        (i0, d, e, g), space = A.scheme, self.space
        a: Array = self.a if len(self.a) else np.zeros_like(self.v)
        _, _, sensed, pushed = A.feed.matrices(len(self.v))
        ports, answers = np.vstack([A.ports, sensed]), np.vstack([A.answers, pushed])
        phi = space.u[len(ports) :][: len(pushed)]
        for k in range(steps):
            drift = self.turn(k, ports, answers)
            lag = d[1] * self.v + d[2] * h * a
            push = A.patterns.T @ loads[k] - self.M @ (i0[1] / h * self.v + i0[2] * a) - self.C @ lag - self.K @ self.q
            w = self.factor.solve(push[:, 0])[:, None]
            space.u[: len(ports)], space.u[len(ports) :] = ports @ w, 0.0
            space.moved[:] = (walls[k + 1] - walls[k] if len(walls) > 1 else 0.0) - drift
            passes = meet(
                A, self.slabs, h, loads[k], space.u, self.y, self.F, self.z, self.inputs, self.ledger, space, self.room,
                TOLERANCE,
            )  # fmt: skip
            if passes < 0:
                return -(k + 1)
            w += answers.T @ np.vstack([self.F, phi])
            self.drive(w)
            self.ledger[DAMPED] += h * (w.T @ (self.C @ (d[0] * w + lag)))[0]
            self.q += h * w
            self.v[:], a = e[0] * w + e[1] * self.v + e[2] * h * a, (g[0] * w + g[1] * self.v) / h + g[2] * a
            total += passes
            if len(kept.seen):
                kept.seen[k], kept.felt[k] = A.watch @ self.q, self.F
            if len(kept.energies):
                kept.speeds[k], kept.places[k], kept.works[k] = A.watch @ self.v, self.y, self.worked
                kept.energies[k] = np.vstack([self.ledger, *self.inertia()])
        self.a = a if len(self.a) else self.a
        return total

    def inertia(self) -> tuple[Array, Array]:
        """Return kinetic and strain energy, (1,), J."""
        v, q = self.v[:, 0], self.q[:, 0]
        return np.array([0.5 * v @ (self.M @ v)]), np.array([0.5 * q @ (self.K @ q)])

    def turn(self, k: int, ports: Array, answers: Array) -> Any:
        """Bring the rows of contacts to step k of a block; return how far they move their places, (motions, 1), m."""
        del k, ports, answers
        return 0.0

    def drive(self, w: Array) -> None:
        """Count the work of the drive that moves points along a structure, by the mean velocities of the step."""


class MovingMarcher(SparseMarcher):
    """A march with contacts at points that move along structures: their rows B change from step to step.

    The place at the end of a step is r1 = B1 q1, and the force acts along the mean row,

        r1 - r0 = B1 (q1 - q0) + (B1 - B0) q0,     f = ((B0 + B1) / 2)^T F,

    so that F . (r1 - r0) is the work on the structures and F . (B1 - B0) (q0 + q1) / 2, the work of what drives the
    points along: energy is conserved as with points that stay.
    """

    def condensed(self) -> Linear:
        """Return the arrays of the scene for the first step.

        Raises:
            UserError: The scheme is another one than the midpoint rule.
        """
        if self.scheme != MIDPOINT:
            raise UserError("march: found another scheme, expected the midpoint rule where points move")
        scene = self.scene
        ends = [
            (slice(first, first + one.motions), sign, point)
            for one, first in zip(scene.contacts, scene.first, strict=False)
            for sign, point in zip((1.0, -1.0), one.points, strict=False)
            if isinstance(point, MovingPoint)
        ]
        self.motions = np.unique(np.concatenate([np.arange(scene.motions)[some] for some, _, _ in ends]))
        self.still = scene.contact_rows.copy()
        self.ways = []
        for some, sign, point in ends:
            self.still[some] -= sign * scene.rows_at(point)
            along = np.stack([sign * scene.rows_of(point.structure, one.rows) for one in point.track.points])
            self.ways.append((some, point.track, along))
        linear = super().condensed()
        R, _, self.sense, _ = linear.feed.matrices(scene.size)
        self.by_speed = R[:, R.shape[1] - (len(linear.feed.port) - len(linear.feed.acted)) :]
        return linear

    def rows(self, times: Array) -> Array:
        """Return the rows of the motions at points that move, (times, motions, n)."""
        found = np.repeat(self.still[None], len(times), axis=0)
        for some, track, along in self.ways:
            found[:, some] += np.tensordot(track.weights(times), along, 1)
        return found[:, self.motions]

    def places(self) -> Array:
        """Return the places of the contacts at the start, (motions, 1), m."""
        found = super().places()
        found[self.motions] += (self.rows(np.array([self.t0]))[0] - self.scene.contact_rows[self.motions]) @ self.q
        return found

    def march(self, steps: int, loads: Array, walls: Array) -> int:
        """March so many steps into `kept`; see `Marcher.march`."""
        self.B = self.rows(self.t + self.h * np.arange(steps + 1))
        return super().march(steps, loads, walls)

    def turn(self, k: int, ports: Array, answers: Array) -> Array:
        """Bring the rows of contacts to step k of a block; see `SparseMarcher.turn`."""
        A, moved, (B0, B1) = self.linear, self.motions, self.B[k : k + 2]
        m, p, feed = len(A.delassus), len(ports), A.feed
        self.change = B1 - B0
        ports[moved], answers[moved] = B1, self.factor.solve((0.5 * (B0 + B1)).T).T
        across, reach = ports @ answers[moved].T, B1 @ answers.T
        loop = feed.acted[:, p : p + len(feed.acted)].T
        feed.acted[:, moved] = (reach[:, m:] @ loop).T
        inputs = feed.port[: self.by_speed.shape[1]].astype(int)
        sensed = self.by_speed @ (ports[inputs] @ answers[:m].T)
        A.delassus[:, moved] = (reach[:, :m] + feed.acted[:, moved].T @ sensed).T
        met = feed.acted[:, : p + len(loop)].T @ sensed[:, moved]
        met[:p] += across
        A.delassus[moved], A.carry[moved] = met[:m].T, met[m:].T
        drift = np.zeros((m, 1))
        drift[moved] = self.change @ self.q
        return drift

    def drive(self, w: Array) -> None:
        """Count the work of the drive that moves points; see `SparseMarcher.drive`."""
        self.ledger[WALLED] -= 0.5 * self.h * (self.F[self.motions] * (self.change @ w)).sum(0)
