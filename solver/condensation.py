"""Exact condensation of a linear step onto the contact points.

With A = c_m M + c_k K factored once, the step A x = r + H^T f has x = A^-1 r + A^-1 H^T f, and the gap needs only
the Delassus operator D = G A^-1 H^T (m x m). Full accuracy, one back-substitution per step.

A^-1 is kept on columns that span H^T: the interface DOFs, or the contact points where these are fewer.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.sparse import csr_matrix, identity

from solver.system import Array, SemiDiscreteSystem, Springs


class CondensedOperator:
    """A = c_m M + c_k K (+ springs), factored, with its Delassus operator.

    Collective to make and to use.

    Attributes:
        mass: c_m.
        stiffness: c_k.
        delassus: D = G A^-1 H^T, (m, m); symmetric where H = G.
        symmetric: Whether it is.
        largest_compliance: The largest entry of its diagonal.
        seconds: Wall time of the factorization and of the Delassus operator.
    """

    def __init__(
        self, system: SemiDiscreteSystem, mass: float, stiffness: float, springs: Springs | None = None
    ) -> None:
        self.mass, self.stiffness = mass, stiffness
        contact = self._contact = system.contact
        self.symmetric = contact.symmetric
        started = time.perf_counter()
        self._factor = system.operators.factor(mass, stiffness, springs)
        factored = time.perf_counter()
        interface = contact.interface
        self._by_point = contact.size < interface.size
        spanning = contact.resultants if self._by_point else csr_matrix(identity(interface.size))
        self._columns = self._factor.solve_columns(interface, spanning)
        mine = np.zeros((interface.size, spanning.shape[1]))
        mine[interface.slots] = self._columns[interface.owned]
        block = system.operators.sum(mine)
        if not self._by_point:
            block = 0.5 * (block + block.T)
        self._gaps = np.ascontiguousarray(contact.gap_matrix @ block)
        delassus = self._gaps if self._by_point else (contact.resultants.T @ self._gaps.T).T
        self.delassus = np.ascontiguousarray(0.5 * (delassus + delassus.T) if self.symmetric else delassus)
        self.largest_compliance = float(np.max(np.diagonal(self.delassus), initial=0.0))
        self.seconds = {"factorization": factored - started, "delassus": time.perf_counter() - factored}

    def solve_free(self, right_side: Array) -> Array:
        """Return A^-1 r: the motion without contact forces."""
        return self._factor.solve(right_side)

    def correct(self, x: Array, forces: Array) -> Array:
        """Return x + A^-1 H^T f for point forces f = w p, (m,), N.

        Only the columns that carry a force are read: contact is local, and the columns are what would fill the
        memory bus. They are ordered along the beam, so these are few runs.
        """
        loads = self._loads(forces)
        loaded = np.flatnonzero(loads)
        if len(loaded) == 0:
            return x
        result = x.copy()
        for run in np.split(loaded, np.flatnonzero(np.diff(loaded) > _RUN_BREAK) + 1):
            span = slice(run[0], run[-1] + 1)
            result += self._columns[:, span] @ loads[span]
        return result

    def respond(self, forces: Array) -> Array:
        """Return D f = G A^-1 H^T f, (m,)."""
        return np.asarray(self._gaps @ self._loads(forces))

    def _loads(self, forces: Array) -> Array:
        return forces if self._by_point else self._contact.resultant(forces)


_RUN_BREAK = 8  # a gap of a few unloaded columns is cheaper read than skipped
