"""Exact condensation of a linear step onto the contact points.

With A = c_m M + c_k K + c_d sum_j c_j b_j b_j^T (dashpots) factored once, the step A x = r + H^T f has
x = A^-1 r + A^-1 H^T f, and the gap needs only the Delassus operator D = G A^-1 H^T (m x m). Full accuracy, one
back-substitution per step. Friction adds T^T h to the right side, and T A^-1 [H^T T^T] to what a step needs.

A^-1 is kept on columns that span H^T and T^T: the interface DOFs, or the contact points where these are fewer. Where
memory has no room for the columns, or few steps are taken, only their part on the interface is computed and kept, for
a fraction of what the columns take (`linear_algebra.mumps_factor`): a step takes a second back-substitution.

Iterative solvers have no factor: products with the Delassus operator are solves, and none is kept.

The linearized law on the active points, (diag(c) + s D) x = t, is solved together with the body that responds,

    (A + s H_a^T diag(1/c) G_a) y = H_a^T (t / c) + H_o^T f_o,    x = (t - s G_a y) / c,

by conjugate gradients, whose preconditioner is given these springs where they are stiff. So the law holds to round-off,
y is the response of the body to all forces, and what the iterations leave is an unbalanced force, which the energy
ledger sees.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from gapbeam.solver.system.operators import Array, Factor, Indices, IterativeFactor, Springs
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem


@dataclass(frozen=True)
class ForceResponse:
    """Response of the body to point forces.

    Attributes:
        gaps: D f = G A^-1 H^T f, (m,), m.
        whole: A^-1 H^T f, (n,), where that is known.
    """

    gaps: Array
    whole: Array | None = None

    def further(self, length: float, other: ForceResponse) -> ForceResponse:
        """Return this response and a share of another one."""
        whole = None if self.whole is None or other.whole is None else self.whole + length * other.whole
        return ForceResponse(self.gaps + length * other.gaps, whole)


class CondensedOperator:
    """A = c_m M + c_k K + c_d dashpots (+ springs), factored, with its Delassus operator.

    Collective to make and to use.

    Args:
        system: The system.
        mass: c_m.
        stiffness: c_k.
        dashpots: c_d.
        springs: Springs added to A.
        factor: Solver for A, where it exists already.
        factored_in: Wall time that it took then, s.
        seldom: Whether it is used a few times only, and quickly made rather than quick.

    Attributes:
        mass: c_m.
        stiffness: c_k.
        dashpots: c_d times the dashpots of the system; None: it has none.
        symmetric: Whether D = G A^-1 H^T is: where H = G.
        iterative: Whether A is solved with by iterations: no.
        motions: [G; T], with friction, or G on the interface DOFs, (m + m k, interface.size).
        block: A^-1 on the interface DOFs, (interface.size, interface.size); None: kept for points, or not symmetric.
        diagonal: Diagonal of D, (m,).
        largest_compliance: Its largest entry.
        seconds: Wall time of the factorization and of the Delassus operator.
    """

    iterative = False

    def __init__(
        self,
        system: SemiDiscreteSystem,
        mass: float,
        stiffness: float,
        dashpots: float = 0.0,
        springs: Springs | None = None,
        factor: Factor | None = None,
        factored_in: float = 0.0,
        seldom: bool = False,
    ) -> None:
        self.mass, self.stiffness, self._dashpots = mass, stiffness, dashpots
        self.dashpots = None if system.dashpots is None or dashpots == 0.0 else system.dashpots.times(dashpots)
        contact = self._contact = system.contact
        self.symmetric = contact.symmetric
        started = time.perf_counter()
        self._factor = system.operators.factor(mass, stiffness, springs, self.dashpots) if factor is None else factor
        factored = time.perf_counter()
        interface, tangents = contact.interface, contact.rubbed
        forces = scipy.sparse.csr_matrix(scipy.sparse.hstack([contact.resultants, contact.friction_resultants]))
        self._by_point = forces.shape[1] < interface.size
        self._columns: Array | None = None
        block: Array | None = None
        if not self._by_point and (seldom or not self._factor.keeps(interface.size)):
            block = self._factor.interface_block(interface)
        if block is None:
            block = self._by_columns(
                system, forces if self._by_point else scipy.sparse.csr_matrix(scipy.sparse.identity(interface.size))
            )
        motions = [contact.gap_matrix] if tangents is None else [contact.gap_matrix, tangents]
        self.motions = scipy.sparse.csr_matrix(scipy.sparse.vstack(motions))
        self.block = block if self.symmetric and not self._by_point else None
        # with friction the product with the motions of all points would be several times as large as the block
        self._all = np.asfortranarray(self.motions @ block) if tangents is None or self.block is None else None
        self.diagonal = self._diagonal()
        self.largest_compliance = float(np.max(self.diagonal, initial=0.0))
        self.seconds = {"factorization": factored - started + factored_in, "delassus": time.perf_counter() - factored}

    def _by_columns(self, system: SemiDiscreteSystem, spanning: scipy.sparse.csr_matrix) -> Array:
        """Return E^T A^-1 E X for columns X on the interface DOFs; keeps A^-1 E X if there is room. Collective."""
        interface, count = system.contact.interface, spanning.shape[1]
        keeps = self._factor.keeps(count)
        mine = np.zeros((interface.size, count))
        for first in range(0, count, max(count, 1) if keeps else _AT_ONCE):
            part = slice(first, None if keeps else first + _AT_ONCE)
            solved = self._factor.solve_columns(interface, spanning[:, part])
            mine[interface.slots, part] = solved[interface.owned]
            self._columns = solved if keeps else None
        block = system.operators.sum(mine)
        return block if self._by_point else 0.5 * (block + block.T)

    def again(self, system: SemiDiscreteSystem) -> CondensedOperator:
        """Return the operator of a system that differs in the directions of its contact alone."""
        return CondensedOperator(system, self.mass, self.stiffness, self._dashpots, factor=self._factor)

    @property
    def _gaps(self) -> Array:
        """G A^-1 times forces on the interface DOFs, or at the points where those are fewer."""
        if self._all is None:
            return np.asfortranarray(self._contact.gap_matrix @ self.block)
        return self._all[: self._contact.size]

    @cached_property
    def delassus(self) -> Array:
        """D = G A^-1 H^T, (m, m)."""
        contact, gaps = self._contact, self._gaps
        whole = gaps[:, : contact.size] if self._by_point else (contact.resultants.T @ gaps.T).T
        return np.ascontiguousarray(0.5 * (whole + whole.T) if self.symmetric else whole)

    @cached_property
    def compliance(self) -> Array:
        """[G; T] A^-1 [G; T]^T, (m + m k, m + m k), symmetric; the Delassus operator without friction."""
        contact = self._contact
        if contact.rubbed is None:
            return self.delassus
        if self._by_point:
            assert self._all is not None
            whole = self._all
        else:
            whole = self.compliance_of(self.motions)
        return np.ascontiguousarray(0.5 * (whole + whole.T))

    def among(self, points: Indices) -> Array:
        """Return D between some of the points, (a, a), of which the whole is kept where it is not too large."""
        if self.block is None or 8.0 * self._contact.size**2 <= _KEPT_WHOLE:
            return np.asarray(self.delassus[np.ix_(points, points)])
        return self.compliance_of(self._contact.gap_matrix[points])

    def compliance_of(self, motions: scipy.sparse.csr_matrix) -> Array:
        """Return R A^-1 R^T of motions R on the interface DOFs."""
        assert self.block is not None
        touched = np.unique(motions.indices)
        motions = motions[:, touched]
        return np.asarray((motions @ (motions @ self.block[np.ix_(touched, touched)]).T).T)

    def loosen(self, tolerance: float) -> None:
        """Nothing: a factor leaves round-off only."""

    def solve_free(self, right_side: Array) -> Array:
        """Return A^-1 r: the motion without contact forces."""
        return self._factor.solve(right_side)

    def correct(
        self, x: Array, forces: Array, friction: Array | None = None, _response: ForceResponse | None = None
    ) -> Array:
        """Return x + A^-1 (H^T f + T^T h) for point forces f = w p, (m,), and h = w t, (m, k), N."""
        if self._columns is not None:
            return np.asarray(x + _product(self._columns, self._loads(forces, friction)))
        right_side = np.zeros_like(x)
        self._contact.interface.add(right_side, self._contact.resultant(forces, friction))
        return np.asarray(x + self._factor.solve(right_side))

    def respond(self, forces: Array) -> ForceResponse:
        """Return D f = G A^-1 H^T f."""
        if self._all is None:
            return ForceResponse(self._contact.gap_matrix @ self.moved(self._loads(forces, None)))
        return ForceResponse(_product(self._gaps, self._loads(forces, None)))

    def respond_all(self, forces: Array, friction: Array) -> tuple[Array, Array]:
        """Return G A^-1 (H^T f + T^T h), (m,), and T A^-1 (H^T f + T^T h), (m, k); with friction only."""
        loads = self._loads(forces, friction)
        moved = self.motions @ self.moved(loads) if self._all is None else _product(self._all, loads)
        return moved[: len(forces)], moved[len(forces) :].reshape(friction.shape)

    def moved(self, loads: Array) -> Array:
        """Return the motion of the interface DOFs under forces on them."""
        assert self.block is not None
        return _product(self.block if self.block.flags.f_contiguous else self.block.T, loads)

    def solve_linearized(
        self,
        scale: float,
        active: Indices,
        compliance: Array,
        target: Array,
        change: Array,
        _response: ForceResponse | None,
        detour: bool,
    ) -> tuple[Array, ForceResponse]:
        """Solve (diag(c) + s D_aa) x = t - s D_ao f_o on the active points a; the other forces f_o are known.

        Args:
            scale: s.
            active: Numbers of the active points, (a,).
            compliance: c > 0, (a,).
            target: t, (a,), overwritten.
            change: f_o at the other points, 0 at the active ones, (m,), N; overwritten.
            detour: Whether the way by the interface DOFs may be taken where it is quicker; it costs digits.

        Returns:
            All forces, (m,), and their response.
        """
        if change.any():
            target -= scale * self.respond(change).gaps[active]
        if len(active) > 0:
            change[active] = self._solve_active(scale, active, compliance, target, detour)
        return change, self.respond(change)

    def _solve_active(self, scale: float, active: Indices, compliance: Array, target: Array, detour: bool) -> Array:
        """Solve (diag(c) + s D) x = t on the active points."""
        detoured = self.solve_by_interface(scale, active, compliance, target) if detour else None
        if detoured is not None:
            return detoured
        matrix = self.among(active)
        matrix *= scale
        _add_on_diagonal(matrix, compliance)
        if self.symmetric:
            # transposed it is column-major, and factored in place
            _, solution, failed = scipy.linalg.lapack.dposv(matrix.T, target, overwrite_a=True)
            if not failed:
                return np.asarray(solution)
        else:
            try:
                return np.asarray(scipy.linalg.solve(matrix, target, check_finite=False))
            except scipy.linalg.LinAlgError:
                pass
        # Compliances of nearly rigid laws vanish against round-off in D: take the smallest solution.
        matrix = scale * self.among(active)
        _add_on_diagonal(matrix, compliance)
        return np.asarray(np.linalg.lstsq(matrix, target, rcond=1.0e-14)[0])

    def solve_by_interface(self, scale: float, points: Indices, compliance: Array, target: Array) -> Array | None:
        """Solve (diag(c) + s D) x = t on some of the points by way of the interface DOFs, where these are fewer.

        With D = G B G^T and N = G^T diag(1/c) G:  (1 + s N B) z = G^T (t / c),  x = (t - s G B z) / c, and once more
        for what is then missing of t.

        Args:
            scale: s.
            points: Numbers of these points, (a,).
            compliance: c > 0, (a,).
            target: t, (a,).

        Returns:
            x, (a,); None where that is not worth it, or would cost digits: stiff contact makes t and s G B z cancel.
        """
        if self.block is None or len(points) < _MANY:
            return None
        if scale * float(np.sum(self.diagonal[points] / compliance)) > _STIFF:
            return None
        gaps = self._contact.gap_matrix[points]
        touched = np.unique(gaps.indices)
        if 2 * len(touched) > len(points):
            return None
        gaps = gaps[:, touched]
        block = scale * self.block[np.ix_(touched, touched)]
        shared = scipy.sparse.csr_matrix(gaps.T @ gaps.multiply((1.0 / compliance)[:, None]))
        small = np.asarray(shared @ block)
        _add_on_diagonal(small, 1.0)
        factor = scipy.linalg.lu_factor(small, overwrite_a=True, check_finite=False)

        def solved(right: Array) -> Array:
            found = scipy.linalg.lu_solve(factor, gaps.T @ (right / compliance), check_finite=False)
            return np.asarray((right - gaps @ (block @ found)) / compliance)

        once = solved(target)
        return once + solved(target - compliance * once - gaps @ (block @ (gaps.T @ once)))

    def _loads(self, forces: Array, friction: Array | None) -> Array:
        if not self._by_point:
            return self._contact.resultant(forces, friction)
        along = self.motions.shape[0] - len(forces)
        if along == 0:
            return forces
        return np.concatenate([forces, np.zeros(along) if friction is None else friction.reshape(-1)])

    def _diagonal(self) -> Array:
        if self._by_point:
            return np.array(np.diagonal(self._gaps))
        return np.asarray(self._contact.resultants.T.multiply(self._gaps).sum(axis=1)).reshape(-1)


_KEPT_WHOLE = 0.5e9  # bytes: a larger Delassus operator, which every rank would hold, is made where it is asked for
_AT_ONCE = 64  # columns that are made at once where they are not kept
_RUN_BREAK = 8  # a gap of a few unloaded columns is cheaper read than skipped
_MANY = 200  # points, below which a factorization of their own is quicker than any detour
_STIFF = 1.0e5  # ratio of compliances above which a detour costs more digits than that
_SMALL = 20_000  # entries of a matrix that is read faster than loads are sorted


def _add_on_diagonal(matrix: Array, values: Array | float) -> None:
    matrix.flat[:: len(matrix) + 1] += values


def _product(columns: Array, loads: Array) -> Array:
    """Return columns @ loads, (rows,), for a column-major matrix.

    Only the columns that carry a load are read: contact is local, and the columns are what would fill the memory bus.
    They are ordered along the beam, so these are few runs.
    """
    if columns.size <= _SMALL:
        return np.asarray(columns @ loads)
    (loaded,) = loads.nonzero()
    if len(loaded) == 0:
        return np.zeros(len(columns))
    runs = np.split(loaded, np.flatnonzero(np.diff(loaded) > _RUN_BREAK) + 1)
    spans = [slice(run[0], run[-1] + 1) for run in runs]
    result = np.asarray(columns[:, spans[0]] @ loads[spans[0]])
    for span in spans[1:]:
        result += columns[:, span] @ loads[span]
    return result


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
            active: Numbers of the active points, (a,).
            compliance: c > 0, (a,).
            target: t, (a,).
            change: f_o at the other points, 0 at the active ones, (m,), N.
            response: Response to a guess at all forces, which the iterations start from, or None.

        Returns:
            All forces, (m,), and their response.
        """
        if len(active) == 0:
            return change, self.respond(change)
        gaps = self._system.contact.gap_matrix[active]
        forces = change.copy()
        forces[active] = target / compliance
        right_side = self._load(forces)
        stiffer = scipy.sparse.csr_matrix(gaps.T @ gaps.multiply((scale / compliance)[:, None]))
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
