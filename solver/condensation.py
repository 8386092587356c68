"""Exact condensation of a linear step onto the contact points.

With A = c_m M + c_k K factored once, the step A x = r + G^T f has x = A^-1 r + Y G^T f with Y = A^-1 on the
interface DOFs, and the gap needs only the Delassus operator D = G A^-1 G^T (m x m). Full accuracy, one
back-substitution per step.
"""

from __future__ import annotations

import time

import numpy as np

from solver.system import Array, SemiDiscreteSystem, Springs


class CondensedOperator:
    """A = c_m M + c_k K (+ springs), factored, with its Delassus operator.

    Collective to make and to use.

    Attributes:
        mass: c_m.
        stiffness: c_k.
        compliance: A^-1 on the interface DOFs, (n_i, n_i).
        delassus: D = G A^-1 G^T, (m, m).
        largest_compliance: The largest entry of its diagonal.
        seconds: Wall time of the factorization and of the Delassus operator.
    """

    def __init__(
        self, system: SemiDiscreteSystem, mass: float, stiffness: float, springs: Springs | None = None
    ) -> None:
        self.mass, self.stiffness = mass, stiffness
        self._operators, self._contact = system.operators, system.contact
        started = time.perf_counter()
        self._factor = system.operators.factor(mass, stiffness, springs)
        factored = time.perf_counter()
        interface = system.contact.interface
        self._columns = self._factor.solve_units(interface)
        mine = np.zeros((interface.size, interface.size))
        mine[interface.slots] = self._columns[interface.owned]
        block = system.operators.sum(mine)
        self.compliance = 0.5 * (block + block.T)
        gap = system.contact.gap_matrix
        self.delassus = np.ascontiguousarray(gap @ (gap @ self.compliance).T)
        self.largest_compliance = float(np.max(np.diagonal(self.delassus), initial=0.0))
        self.seconds = {"factorization": factored - started, "delassus": time.perf_counter() - factored}

    def solve_free(self, right_side: Array) -> Array:
        """Return A^-1 r: the motion without contact forces."""
        return self._factor.solve(right_side)

    def correct(self, x: Array, forces: Array) -> Array:
        """Return x + A^-1 G^T f for point forces f = w p, (m,), N.

        Only the columns of interface DOFs that carry a force are read: contact is local, and the columns are
        what would fill the memory bus. Interface DOFs are ordered along the beam, so these are few runs.
        """
        resultant = self._contact.resultant(forces)
        loaded = np.flatnonzero(resultant)
        if len(loaded) == 0:
            return x
        result = x.copy()
        for run in np.split(loaded, np.flatnonzero(np.diff(loaded) > _RUN_BREAK) + 1):
            span = slice(run[0], run[-1] + 1)
            result += self._columns[:, span] @ resultant[span]
        return result

    def respond(self, forces: Array) -> Array:
        """Return D f = G A^-1 G^T f, (m,)."""
        contact = self._contact
        return np.asarray(contact.gap_matrix @ (self.compliance @ contact.resultant(forces)))


_RUN_BREAK = 8  # a gap of a few unloaded columns is cheaper read than skipped
