"""The condensed step without a factor: products with the Delassus operator are solves, and none is kept.

The linearized law on the active points, (diag(c) + s D) x = t, is solved together with the body that responds,

    (A + s H_a^T diag(1/c) G_a) y = H_a^T (t / c) + H_o^T f_o,    x = (t - s G_a y) / c,

by conjugate gradients, whose preconditioner is given these springs where they are stiff. So the law holds to round-off,
y is the response of the body to all forces, and what the iterations leave is an unbalanced force, which the energy
ledger sees.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.solve.condensation import CondensedOperator, ForceResponse
from gapbeam.solver.system.operators import Array, Indices, IterativeFactor, Springs
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem


class MatrixFreeOperator:
    """A = c_m M + c_k K + c_d dashpots (+ springs), solved with by iterations.

    For symmetric contact without friction. Collective to make and to use.

    Args:
        system: The system.
        factor: Solver for A.
        mass: c_m.
        stiffness: c_k.
        dashpots: c_d.
        seconds: Wall time that making the factor took.

    Attributes:
        mass: c_m.
        stiffness: c_k.
        dashpots: c_d times the dashpots of the system; None: it has none.
        symmetric: Whether H = G: yes.
        iterative: Whether A is solved with by iterations: yes.
        largest_compliance: 0: not known, and not needed where the law holds to round-off.
        seconds: Wall time of the set-up.
    """

    iterative, symmetric, largest_compliance = True, True, 0.0

    def __init__(
        self,
        system: SemiDiscreteSystem,
        factor: IterativeFactor,
        mass: float,
        stiffness: float,
        dashpots: float = 0.0,
        seconds: float = 0.0,
    ) -> None:
        self.mass, self.stiffness = mass, stiffness
        self.dashpots = None if system.dashpots is None or dashpots == 0.0 else system.dashpots.times(dashpots)
        self.factor, self._system = factor, system
        self._size: float | None = None
        self.seconds = {"factorization": seconds, "delassus": 0.0}

    def loosen(self, tolerance: float) -> None:
        """Let iterations leave an error of at least this, relative to the solution in the energy norm."""
        self.factor.tolerance = max(self.factor.tolerance, tolerance)

    def solve_free(self, right_side: Array) -> Array:
        """Return A^-1 r: the motion without contact forces, against which errors are measured from then on."""
        free = self.factor.solve(right_side)
        self._size = self.factor.size_of(free, right_side) or None
        return free

    def correct(
        self, x: Array, forces: Array, _friction: Array | None = None, response: ForceResponse | None = None
    ) -> Array:
        """Return x + A^-1 H^T f for point forces f = w p, (m,), N, by their response where it is known."""
        if response is None or response.whole is None:
            response = self.respond(forces)
        assert response.whole is not None
        return np.asarray(x + response.whole)

    def respond(self, forces: Array) -> ForceResponse:
        """Return D f = G A^-1 H^T f and A^-1 H^T f."""
        right_side = self._load(forces)
        if not np.any(forces):
            return ForceResponse(np.zeros(len(forces)), right_side)
        return self._response(self.factor.solve_stiffened(right_side, None, self._size))

    def solve_linearized(
        self,
        scale: float,
        active: Indices,
        compliance: Array,
        target: Array,
        change: Array,
        response: ForceResponse | None,
        _detour: bool = False,
    ) -> tuple[Array, ForceResponse]:
        """Solve (diag(c) + s D_aa) x = t - s D_ao f_o on the active points a; the other forces f_o are known.

        Args:
            scale: s.
            active: Which points, (a,).
            compliance: c > 0, (a,).
            target: t, (a,).
            change: f_o at the other points, 0 at the active ones, (m,), N.
            response: That of a guess at all forces, which the iterations start from, or None.

        Returns:
            All forces, (m,), and their response.
        """
        if len(active) == 0:
            return change, self.respond(change)
        gaps = self._system.contact.gap_matrix[active]
        forces = change.copy()
        forces[active] = target / compliance
        right_side = self._load(forces)
        stiffer = csr_matrix(gaps.T @ gaps.multiply((scale / compliance)[:, None]))
        springs = Springs(self._system.contact.interface, stiffer)
        whole = self.factor.solve_stiffened(
            right_side,
            springs,
            self._size,
            None if response is None else response.whole,
        )
        found = self._response(whole)
        change = change.copy()
        change[active] = (target - scale * found.gaps[active]) / compliance
        return change, found

    def _load(self, forces: Array) -> Array:
        contact = self._system.contact
        right_side = np.zeros(self._system.operators.size)
        contact.interface.add(right_side, contact.resultant(forces))
        return right_side

    def _response(self, whole: Array) -> ForceResponse:
        contact = self._system.contact
        return ForceResponse(
            np.asarray(contact.gap_matrix @ contact.interface.trace(whole, self._system.operators)), whole
        )


Condensed = CondensedOperator | MatrixFreeOperator


def condensed_operator(
    system: SemiDiscreteSystem,
    mass: float,
    stiffness: float,
    dashpots: float = 0.0,
    springs: Springs | None = None,
    seldom: bool = False,
) -> Condensed:
    """Return A = c_m M + c_k K + c_d dashpots (+ springs) condensed onto the contact points, as it can be solved with.

    `seldom`: it is used a few times only, and better quickly made than quick.

    Collective.
    """
    added = None if system.dashpots is None or dashpots == 0.0 else system.dashpots.times(dashpots)
    started = time.perf_counter()
    factor = system.operators.factor(mass, stiffness, springs, added)
    seconds = time.perf_counter() - started
    if isinstance(factor, IterativeFactor):
        return MatrixFreeOperator(system, factor, mass, stiffness, dashpots, seconds)
    return CondensedOperator(system, mass, stiffness, dashpots, springs, factor, seconds, seldom)
