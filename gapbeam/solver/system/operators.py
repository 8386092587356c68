"""Operators of a model: products with M and K, factors, and the interface DOFs that gaps depend on.

Loads are patterns times functions of time. Many rows are multiplied with a matrix in blocks of one size, so that bits
do not depend on the number of rows. BLAS adds up in an order that follows from the number of rows, and from the place
of a row among them. Records are made of blocks whose length follows from the clock; a run that is resumed has others.
So rows are multiplied eight at a time, the last ones filled up: of eight rows, kernels of OpenBLAS for AVX-512, AVX2,
AVX and SSE treat each alike. Of 64 rows, as many as here before, those for AVX-512 do not.

The forces with which joints hold the body are rows on the quantities of a record,

    R = A u + B v + F s(t) + P (w p) + T (w t)

Springs and dampers have A and B alone. Where a joint holds a motion that the model has not, the acceleration that the
equation of motion has at the state is put into the equation along that motion (`models.contact_setting`).

Walls of supports that move as given functions of time.

    g(t) = g0 + G u + W(t),    W(t) = sum_k (w_k(t) - w_k(0)) S_k

S_k (m) is by how much a unit of the motion w_k opens the gap at each contact point; g0 is the gap at t = 0. Under point
forces f the walls do the work -f . (W(t1) - W(t0)) on the body over a step.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.integer[Any]]


class Factor(Protocol):
    """Solver for an effective operator."""

    @property
    def tolerance(self) -> float:
        """Error over solution that iterations leave, in the energy norm; 0 where there is only round-off."""

    def keeps(self, columns: int) -> bool:
        """Return whether so many columns A^-1 E X may be kept in memory."""

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b; both arrays hold the owned part (n,). Collective."""

    def solve_columns(self, interface: Interface, columns: scipy.sparse.csr_matrix) -> Array:
        """Return A^-1 E X for columns X (interface.size, r) on the interface DOFs: (n, r), column-major. Collective."""

    def interface_block(self, interface: Interface) -> Array | None:
        """Return E^T A^-1 E, (interface.size, interface.size), symmetric, the same on all ranks. Collective.

        None: no quicker way to it is known than by columns.
        """


@runtime_checkable
class IterativeFactor(Factor, Protocol):
    """Iterative solves with an effective operator, also with springs added to the operator.

    Attributes:
        tolerance: Relative error of a solve in the energy norm.
        solves: Number of solves so far.
        iterations: Number of iterations in these solves.
    """

    tolerance: float
    solves: int
    iterations: int

    def size_of(self, solution: Array, right_side: Array) -> float:
        """Return sqrt(x^T A x) of a solution x of A x = b. Collective."""

    def solve_stiffened(
        self, right_side: Array, springs: Springs | None, size: float | None, start: Array | None = None
    ) -> Array:
        """Return (A + springs)^-1 b. Collective.

        Args:
            right_side: b, (n,).
            springs: Matrix added to A, positive semi-definite; None: none.
            size: sqrt(x^T A x) that the error is compared with; None: the solution's own.
            start: A guess at the solution, (n,).

        Raises:
            RunError: The iterations did not converge.
        """


class Operators(Protocol):
    """M and K of a model, in whatever form they are kept.

    Attributes:
        size: Number of DOFs that this rank owns, n.
        massless: Numbers of the DOFs without mass, (n,): rows and columns of M that are zero.
    """

    size: int
    massless: NDArray[np.bool_]

    def apply_mass(self, x: Array) -> Array:
        """Return M x, (n,) or, of several columns, (n, k). Collective."""

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x, (n,) or, of several columns, (n, k). Collective."""

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off, (n,): eps diag(K) |x|."""

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the weak restraint adds, (n,) or, of several columns, (n, k). Collective."""

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Factor mass M + stiffness K + springs + added; if stiffness = 0, massless rows are those of K. Collective."""

    def sum(self, local: Array) -> Array:
        """Sum a small array over all ranks. Collective."""


@dataclass(frozen=True)
class Interface:
    """The DOFs that gaps depend on, replicated on all ranks.

    Attributes:
        size: Number of interface DOFs, over all ranks.
        owned: Position in the owned vector of those that this rank owns.
        slots: Numbers of the DOFs, 0 ... size-1.
    """

    size: int
    owned: Indices
    slots: Indices

    def trace(self, x: Array, operators: Operators) -> Array:
        """Return the interface values (size,) of a vector on every rank. Collective."""
        values = np.zeros(self.size)
        values[self.slots] = x[self.owned]
        return operators.sum(values)

    def numbers(self, first: int, total: Callable[[Array], Array]) -> Indices:
        """Return the numbers of all interface DOFs over all ranks, (size,). Collective.

        Args:
            first: Number of this rank's first DOF.
            total: Sums an array over ranks.
        """
        mine = np.zeros(self.size)
        mine[self.slots] = self.owned + first
        return np.asarray(total(mine).astype(np.int64))

    def add(self, x: Array, values: Array) -> None:
        """Add interface values (size,) to a vector in place; local."""
        x[self.owned] += values[self.slots]


@dataclass(frozen=True)
class Springs:
    """A sparse matrix (size, size) on the interface DOFs, N/m, with entries between DOFs of one cell only."""

    interface: Interface
    matrix: scipy.sparse.csr_matrix


@dataclass(frozen=True)
class RankOnes:
    """A sum of terms a_j b_j b_j^T of springs, dampers or masses at places of a body.

    Attributes:
        patterns: b_j on the DOFs of this rank, (k, n).
        coefficients: a_j, (k,).
    """

    patterns: Array
    coefficients: Array

    def apply(self, x: Array, operators: Operators) -> Array:
        """Return sum_j a_j b_j (b_j . x), (n,). Collective."""
        return np.asarray((self.coefficients * operators.sum(self.patterns @ x)) @ self.patterns)

    def times(self, factor: float) -> RankOnes:
        """Return the sum times a factor."""
        return RankOnes(self.patterns, factor * self.coefficients)

    def and_also(self, other: RankOnes | None) -> RankOnes:
        """Return both sums together."""
        if other is None:
            return self
        return RankOnes(
            np.concatenate([self.patterns, other.patterns]), np.concatenate([self.coefficients, other.coefficients])
        )

    @property
    def matrix(self) -> Array:
        """The sum as an array, (n, n), on one rank."""
        return np.asarray(self.patterns.T @ (self.coefficients[:, None] * self.patterns))


AT_ONCE = 8192  # times, so that what is made of them stays in the cache


class Alike(Protocol):
    """Function of time that costs little in addition to others of its kind."""

    @property
    def kind(self) -> Hashable:
        """Key that functions computed together share."""

    def rows(self, signals: Sequence[Any], times: Array) -> Array:
        """Return s of some functions of this kind at many times, (times, functions)."""


@dataclass(frozen=True)
class Load:
    """A spatial pattern times a function of time, with the motion of the frame where it is an inertia load.

    Attributes:
        name: Name in the case file.
        pattern: Nodal forces per unit factor, (n,), N.
        factor: s(t).
        static: Whether it acts on the seat before t = 0.
        frame_direction: Direction of a base motion with acceleration s(t), (3,), or None for other loads.
        mean: Mean of s over intervals from starts, (times,), to ends, (times,), of base motions and loads that jump.
        of_arrays: Whether s also takes an array of times.
        signal: Computes s together with other loads of its kind; None: s is computed by itself.
        unit: Unit of s.
    """

    name: str
    pattern: Array
    factor: Callable[[float], float]
    static: bool = False
    frame_direction: Array | None = None
    mean: Callable[[Array, Array], Array] | None = None
    of_arrays: bool = False
    signal: Alike | None = None
    unit: str = "N"

    def factors(self, times: Array) -> Array:
        """Return s at many times, (times,)."""
        if self.of_arrays:
            of_arrays: Callable[[Any], Any] = self.factor
            return np.asarray(np.broadcast_to(of_arrays(times), times.shape), dtype=float)
        return np.array([self.factor(float(time)) for time in times])


def factor_rows_of(loads: Sequence[Load], times: Array) -> Array:
    """Return s_k(t) of loads at many times, (times, loads); loads of one kind together."""
    rows, alike = np.empty((len(times), len(loads))), dict[Hashable, list[int]]()
    for place, load in enumerate(loads):
        if load.signal is None:
            rows[:, place] = load.factors(times)
        else:
            alike.setdefault(load.signal.kind, []).append(place)
    for places in alike.values():
        signals = [loads[place].signal for place in places]
        if (first := signals[0]) is not None:
            together = places[-1] - places[0] == len(places) - 1
            columns = slice(places[0], places[-1] + 1) if together else places
            for begin in range(0, len(times), AT_ONCE):
                here = slice(begin, begin + AT_ONCE)
                rows[here, columns] = first.rows(signals, times[here])
    return rows


ROWS = 8
COLUMNS = 1024  # at once, so that they stay in the cache from one block of rows to the next


def row_product(rows: Array, matrix: Array) -> Array:
    """Return x A of rows x, (times, n), and a matrix A, (n, k): (times, k), each row the same bits in any company."""
    times, count = len(rows), -(-len(rows) // ROWS)
    blocks = np.zeros((count, ROWS, rows.shape[1]))
    blocks.reshape(count * ROWS, rows.shape[1])[:times] = rows
    product = np.empty((count, ROWS, matrix.shape[1]))
    for begin in range(0, matrix.shape[1], COLUMNS):
        some = slice(begin, begin + COLUMNS)
        np.matmul(blocks, matrix[:, some], out=product[..., some])
    return product.reshape(count * ROWS, matrix.shape[1])[:times]


@dataclass(frozen=True)
class Reactions:
    """Rows for r forces and moments.

    Attributes:
        displacement: A on the DOFs of this rank, (r, n).
        velocity: B, (r, n).
        loads: F, (r, loads).
        pressure: P, (r, m).
        friction: T, (r, m k).
        stations: Effect of the forces at stations in round holes, (r, 6k), see `Circles.forces`; P and T are 0 there.
    """

    displacement: Array | scipy.sparse.csr_matrix
    velocity: Array | scipy.sparse.csr_matrix
    loads: Array
    pressure: Array
    friction: Array
    stations: Array | None = None

    def of_contact(self, forces: Array, friction: Array | None, turned: Array | None = None) -> Array:
        """Return the part of contact, (r,), N and N m.

        Args:
            forces: w p, (m,), N.
            friction: w t, (m, k), N; None: nothing rubs.
            turned: Forces at stations in round holes, (6k,), see `Circles.forces`; None: there are none.
        """
        found = np.asarray(self.pressure @ forces)
        if self.stations is not None and turned is not None:
            found = found + self.stations @ turned
        return found if friction is None else np.asarray(found + self.friction @ friction.reshape(-1))

    def total(self, u: Array, v: Array, factors: Array, of_contact: Array, operators: Operators) -> Array:
        """Return the forces on the body, (times, r), N and N m.

        Args:
            u: DOFs of this rank, (times, n).
            v: Their velocities, (times, n).
            factors: s_k, (times, loads).
            of_contact: The part of contact, (times, r).
            operators: Operators, for sums over ranks.

        Collective.
        """
        moved = operators.sum(_product(u, self.displacement) + _product(v, self.velocity))
        return np.asarray(moved + row_product(factors, self.loads.T) + of_contact)


def _product(x: Array, rows: Array | scipy.sparse.csr_matrix) -> Array:
    """Return the products of rows (r, n) with vectors (times, n): (times, r), the same bits for any number of times."""
    return row_product(x, rows.T) if isinstance(rows, np.ndarray) else np.ascontiguousarray((rows @ x.T).T)


@dataclass(frozen=True)
class WallMotion:
    """One motion of the walls of a support.

    Attributes:
        load: Number of the load of the system that it is, under which its work is entered.
        place: w of a time or an array of times.
        speed: Its derivative.
    """

    load: int
    place: Callable[[Any], Any]
    speed: Callable[[Any], Any]


@dataclass(frozen=True)
class Walls:
    """All motions of walls.

    Attributes:
        motions: k of them.
        growths: S, by how much a unit of each opens the gaps, (k, m); without motions (0, 1), for any m.
    """

    motions: tuple[WallMotion, ...]
    growths: Array

    def places(self, times: Array) -> Array:
        """Return w(t) - w(0), (times, k)."""
        return _columns([motion.place(times) - motion.place(0.0) for motion in self.motions], times)

    def speeds(self, times: Array) -> Array:
        """Return w'(t), (times, k)."""
        return _columns([motion.speed(times) for motion in self.motions], times)

    def opened(self, time: float) -> Array:
        """Return W at a time, (m,), m; one zero without motions."""
        return self._gaps(motion.place(time) - motion.place(0.0) for motion in self.motions)

    def opening_speed(self, time: float) -> Array:
        """Return W' at a time, (m,), m/s; one zero without motions."""
        return self._gaps(motion.speed(time) for motion in self.motions)

    def grown(self, start: float, end: float) -> Array:
        """Return W(end) - W(start), (m,), m; one zero without motions."""
        return self._gaps(motion.place(end) - motion.place(start) for motion in self.motions)

    def works(self, forces: Array, start: float, end: float, loads: int) -> Array:
        """Return the work of the walls on the body between two times, entered by load, (loads,), J.

        Args:
            forces: Point forces meanwhile, (m,), N.
            start: s.
            end: s.
            loads: Number of loads.
        """
        found = np.zeros(loads)
        for motion, growth in zip(self.motions, self.growths, strict=True):
            found[motion.load] -= float(growth @ forces) * float(motion.place(end) - motion.place(start))
        return found

    def _gaps(self, factors: Any) -> Array:
        total = np.zeros(self.growths.shape[1])
        for factor, growth in zip(factors, self.growths, strict=True):
            total += float(factor) * growth
        return total


def _columns(values: list[Any], times: Array) -> Array:
    columns = [np.broadcast_to(value, times.shape) for value in values]
    return np.array(columns, dtype=float).reshape(len(columns), len(times)).T


NO_WALLS = Walls((), np.zeros((0, 1)))
