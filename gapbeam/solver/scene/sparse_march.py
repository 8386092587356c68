"""The march of large structures: sparse matrices, factored once, around the same compiled feedback and contact."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.condensed_arrays import Linear
from gapbeam.solver.scene.lane_code import kernels
from gapbeam.solver.scene.modal_march import TOLERANCE, Marcher
from gapbeam.solver.scene.step_kernel import DAMPED
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
        if scheme.exact:
            raise UserError("march: exact frequencies are for modes; reduce the structure: structure.reduced(modes)")

        def block(name: str) -> Any:
            parts = (getattr(one, name) for one in scene.structures)
            zero = (sp.csr_matrix((one.size, one.size)) for one in scene.structures)
            return sp.block_diag(
                [none if part is None else sp.csr_matrix(part) for part, none in zip(parts, zero, strict=True)],
                format="csr",
            )

        self.M, self.C, self.K = block("M"), block("C"), block("K")
        effective = scheme.inertia[0] / h * self.M + scheme.drag[0] * self.C + scheme.level * h * self.K
        self.factor = sla.splu(sp.csc_matrix(effective))

        def solve(right: Array) -> Array:
            found = [self.factor.solve(np.ascontiguousarray(column)) for column in right.T]
            return np.column_stack(found) if found else np.zeros(right.shape)

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
        for k in range(steps):
            lag = d[1] * self.v + d[2] * h * a
            push = A.patterns.T @ loads[k] - self.M @ (i0[1] / h * self.v + i0[2] * a) - self.C @ lag - self.K @ self.q
            w = self.factor.solve(push[:, 0])[:, None]
            space.u[:], space.moved[:] = A.ports @ w, walls[k + 1] - walls[k]
            passes = meet(
                A, self.slabs, h, loads[k], space.u, self.y, self.F, self.z, self.inputs, self.ledger, space, self.room,
                TOLERANCE,
            )  # fmt: skip
            if passes < 0:
                return -(k + 1)
            w += A.answers.T @ np.vstack([self.F, space.phi])
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
