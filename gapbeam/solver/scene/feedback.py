"""Feedback: a linear force with states that follows the motion.

    z' = A z + B u,     F = C z + D u,     u = (displacements, velocities) of `sense`,     F acts at `act`.

The states follow the scheme and are eliminated exactly, so that stability boundaries of the linear system hold at any
step of the midpoint rule. A joint is a feedback without states. Places may be lists of points: motions one after the
other. Forces of a flow are in `flow_force`. All feedback of a scene is condensed for one time step:

    f = R (z, y, v),     phi = W f,     u1 = u + G phi,     z1 = S (z, y, v1),

where f are forces of free motions, W the loop through the structure, u velocities of ports, v those that are sensed. R
and S are kept as diagonals, which are few where like states of sections lie side by side, and motions as blocks: forces
on a few modes move these alone, together.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import chain, pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sl
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import ARTICLES, ArgumentError, checked, finite, positives, shown
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.operators import Array

One = StructurePoint | tuple[StructurePoint, StructurePoint]
Place = One | list[One]
UNSEEN = 1e-9  # of the norms of A and C: what round-off leaves of a state that no output shows
INTEGRATES = 1e-13  # of the largest singular value of A: a state decays so slowly that it only sums
NOISE = 1e-12  # entry of a row over the largest one: round-off of modes on which a force does not act
LINE = 64  # bytes of a line of the cache
FEW, FOURS = 4, 4  # motions on the same modes from which their reading is a block; ports are padded to a multiple


def parts_of(place: Place) -> list[tuple[StructurePoint, ...]]:
    """Return the points of a place, each alone or with the second of its pair; refuse anything else."""
    given = place if isinstance(place, list) else [place]
    parts: list[tuple[StructurePoint, ...]] = [one if isinstance(one, tuple) else (one,) for one in given]
    for one in chain(*parts):
        if not isinstance(one, StructurePoint):
            raise UserError(f"feedback: found {shown(one)} as a place, expected {ARTICLES['StructurePoint']}")
    return parts


def motions_of(place: Place) -> int:
    """Return the number of motions of a place."""
    return sum(len(first.rows) for first, *_ in parts_of(place))


def outputs_of(feedbacks: Sequence[Feedback]) -> list[slice]:
    """Return the places of the forces of each feedback among those of all."""
    ends = np.cumsum([0, *(motions_of(one.act) for one in feedbacks)])
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def side_by_side(laws: Sequence[Any]) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C, D of linear laws next to each other; B and D take displacements of all, then velocities."""

    def whole(parts: Iterable[Array]) -> Any:
        return sl.block_diag(np.zeros((0, 0)), *parts)

    def halves(name: str) -> Any:
        pairs = [np.split(getattr(one, name), 2, axis=1) for one in laws]
        return np.hstack([whole(pair[i] for pair in pairs) for i in (0, 1)])

    return whole(one.A for one in laws), halves("B"), whole(one.C for one in laws), halves("D")


class Feedback:
    """A linear force with n states; see the module.

    Args:
        sense: StructurePoint or pair of points whose displacements and velocities it reads, or a list of these.
        act: StructurePoint or pair of points that its force acts on, or a list of these; equal and opposite on the
            second of a pair.
        A: (n, n), 1/s; [] without states.
        B: (n, 2 motions of `sense`): displacements first.
        C: (motions of `act`, n).
        D: (motions of `act`, 2 motions of `sense`); default 0.
        name: Name in messages and paths.

    Raises:
        UserError: A shape does not fit, or a state grows by itself and no output shows that.
    """

    delay = 0.0
    """Time that the force lags behind the motion, s."""

    @checked
    def __init__(
        self, sense: Place, act: Place, A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike | None = None,
        name: str = "",
    ) -> None:  # fmt: skip
        self.sense, self.act, self.name = sense, act, name
        inputs, outputs, where = 2 * motions_of(sense), motions_of(act), f"feedback {name or '?'}"
        for one in self.points:
            one.refuse_moving(where, "points that stay, or a contact")
        square = np.atleast_2d(finite(A, where)) if np.size(np.asarray(A)) else np.zeros((0, 0))
        n, direct = len(square), np.zeros((outputs, inputs)) if D is None else D

        def shaped(key: str, value: Any, *shape: int) -> Array:
            if np.size(np.asarray(value)) != shape[0] * shape[1]:
                raise ArgumentError(f"{where}: found {key} of shape {np.shape(value)}, expected {shape}", key)
            return finite(value, where).reshape(shape)

        self.A, self.B = shaped("A", square, n, n), shaped("B", B, n, inputs)
        self.C, self.D = shaped("C", C, outputs, n), shaped("D", direct, outputs, inputs)
        size, shows = np.linalg.norm(self.A), self.C / (np.linalg.norm(self.C) or 1.0)
        for value in np.linalg.eigvals(self.A):
            if value.real > UNSEEN * size:
                seen = np.vstack([(self.A - value * np.eye(n)) / size, shows])
                if np.linalg.svd(seen, compute_uv=False)[-1] <= UNSEEN:
                    raise ArgumentError(
                        f"{where}: a state grows as exp({value.real:.4g} t) and no output shows it; remove that state, "
                        "or show it by C",
                        "A",
                    )

    @property
    def points(self) -> tuple[StructurePoint, ...]:
        """All points that it reads or acts on."""
        return tuple(chain(*parts_of(self.sense), *parts_of(self.act)))

    @cached_property
    def integrals(self) -> Array:
        """Projector Q on states that integrate, along all others, (n, n): A Q = Q A = 0; 0 where none does.

        Raises:
            UserError: A state integrates another one that does, and has no rest.
        """
        right, left = (sl.null_space(one, rcond=INTEGRATES) for one in (self.A, self.A.T))
        inner = left.T @ right
        if right.shape[1] and np.linalg.svd(inner, compute_uv=False)[-1] <= INTEGRATES:
            raise UserError(f"feedback {self.name or '?'}: a state has no rest; march from rest instead")
        return np.asarray(right @ np.linalg.solve(inner, left.T))

    @property
    def resting(self) -> Array:
        """States at rest for unit displacements of `sense`, without what integrators hold, (n, motions).

        Raises:
            UserError: See `integrals`.
        """
        scale = np.linalg.norm(self.A) or 1.0
        inverse = np.linalg.inv(self.A + scale * self.integrals) - self.integrals / scale
        return np.asarray(-inverse @ self.B[:, : self.B.shape[1] // 2])

    def check(self, *frequencies: float) -> None:
        """Raise UserError if the law does not hold at angular frequencies, rad/s; without any, at those of interest."""

    def replaced(self, name: str, value: Any) -> Feedback:  # noqa: ARG002
        """Return the feedback with another value of that name; refuse a name that it has not."""
        raise UserError(f"feedback {self.name or '?'} has no value {name!r}; forces of a flow have a velocity")


class Joint(Feedback):
    """A spring and damper between two points, or from a point to the frame; as stiff as you like.

    Args:
        between: A point, or (point, point).
        stiffness: Stiffness in each motion, N/m.
        damping: Damping in each motion, N s/m.
        name: Name in messages and paths.
        force: Whether marches record its force on the first point along x, y and z, by its name, as of supports.

    Raises:
        UserError: A value is negative or not finite; or a force is asked for without a name, or at a point whose
            directions in space are unknown.
    """

    @checked
    def __init__(
        self, between: Place, stiffness: float, damping: float = 0.0, name: str = "", force: bool = False
    ) -> None:
        k, c = positives(f"joint {name or '?'}", zero=True, stiffness=stiffness, damping=damping)
        unit = np.eye(motions_of(between))
        super().__init__(between, between, [], [], [], np.hstack([-k * unit, -c * unit]), name)
        self.force = force
        if force and not name:
            raise ArgumentError(
                "joint: found a force without a name, expected a name, under which it is recorded", "force"
            )
        first = self.points[0] if self.points else None
        if force and first is not None and (first.turns or first.directions is None):
            raise ArgumentError(
                f"joint {name}: found a force on point {first.name or '?'}, whose motions have no directions in space, "
                "expected a point of a structure that is placed in space, and no rotation",
                "force",
            )


class MotionBlocks(NamedTuple):
    """A matrix that is 0 except for blocks.

    Attributes:
        value: Entries of all blocks, column after column.
        row: Row of the first entry of each block, (blocks,); likewise the other attributes.
        column: Column of the first entry.
        rows: Number of rows.
        columns: Number of columns.
        at: Place of the first entry in `value`.
    """

    value: Array
    row: Any
    column: Any
    rows: Any
    columns: Any
    at: Any


def extents(rows: Array) -> Array:
    """Return the columns of the first entry of each row and behind the last one, (rows, 2)."""
    found = [np.flatnonzero(row) for row in rows]
    ends = [(int(one[0]), int(one[-1]) + 1) if len(one) else (0, 0) for one in found]
    return np.array(ends, dtype=int).reshape(-1, 2)


def blocks(rows: Array, answers: Array) -> tuple[MotionBlocks, int]:
    """Return a matrix and the transpose of another one as blocks, and how many blocks the first has.

    Neighbors that begin and end at the same column are a block; of the first matrix, where they are FEW or more.
    """
    parts, counts = list[tuple[int, int, Array]](), list[int]()
    for A, few in ((rows, FEW), (answers, 1)):
        ends = extents(A)
        cuts = [0, *(np.flatnonzero(np.diff(ends, axis=0).any(axis=1)) + 1), len(A)]
        for i, j in pairwise(map(int, cuts)):
            spans = [(i, j)] if j - i >= few else [(k, k + 1) for k in range(i, j)]
            for k, last in spans:
                a, b = ends[k] if len(ends) else (0, 0)
                if a < b:
                    parts.append((k, a, A[k:last, a:b]) if A is rows else (a, k, A[k:last, a:b].T))
        counts.append(len(parts))
    shapes = np.array([(row, column, *part.shape) for row, column, part in parts], dtype=np.uint64).reshape(-1, 4)
    at = np.cumsum([0, *(part.size for _, _, part in parts)])[:-1].astype(np.uint64)
    value = np.concatenate([np.zeros(0), *(part.T.ravel() for _, _, part in parts)])
    row, column, height, width = (np.ascontiguousarray(one) for one in shapes.T)
    return MotionBlocks(aligned(value), row, column, height, width, at), counts[0]


class Diagonals(NamedTuple):
    """A matrix whose diagonals are kept in `value` from their first entry, at row and column, to their last.

    `row` and `column` are of (diagonals,); `at` says where each begins in `value`, and where the last ends.
    """

    value: Array
    row: Any
    column: Any
    at: Any


def diagonals(*matrices: Array) -> tuple[Diagonals, int]:
    """Return matrices one after the other as diagonals, and how many diagonals the first has."""
    parts: list[Array] = [np.zeros(0)]
    ends, counts = list[tuple[int, int]](), list[int]()
    for A in matrices:
        for offset in range(1 - A.shape[0], A.shape[1]):
            line = np.diagonal(A, offset)
            seen = np.flatnonzero(line)
            if len(seen):
                parts.append(line[seen[0] : seen[-1] + 1])
                ends.append((int(seen[0]) + max(-offset, 0), int(seen[0]) + max(offset, 0)))
        counts.append(len(ends))
    row, column = np.array(ends, dtype=np.uint64).reshape(-1, 2).T
    at = np.cumsum([len(part) for part in parts]).astype(np.uint64)
    kept = np.ascontiguousarray(row), np.ascontiguousarray(column)
    return Diagonals(aligned(np.concatenate(parts)), *kept, at), counts[0]


class FeedbackLoop(NamedTuple):
    """Arrays of the feedback for one time step.

    Ports are contact motions, patterns of the loads, then the motions that feedback senses or acts on, each once.

    Attributes:
        law: R (outputs, states + 2 inputs), then S (states, states + 2 inputs).
        forces: Number of diagonals of R.
        stack: Number of states and inputs: columns of R and S.
        motions: Number of motions that feedback senses or acts on.
        rows: The motions (motions, n), then velocities of unit forces (n, outputs).
        sensed: Number of blocks of the motions.
        acted: (outputs, ports + outputs or more): transposes of G W, then W, then of 0.
        port: (inputs + outputs,) port of each input and output.
    """

    law: Diagonals
    forces: int
    stack: int
    motions: int
    rows: MotionBlocks
    sensed: int
    acted: Array
    port: Any

    def matrices(self, n: int) -> tuple[Array, Array, Array, Array]:
        """Return R, S, the motions, (motions, n), and velocities of unit forces, (outputs, n), as whole matrices."""
        outputs, law = len(self.acted), self.law
        states = self.stack - 2 * (len(self.port) - outputs)
        R, S = np.zeros((outputs, self.stack)), np.zeros((states, self.stack))
        for k, (row, column) in enumerate(zip(law.row, law.column, strict=True)):
            line = law.value[law.at[k] : law.at[k + 1]]
            (R if k < self.forces else S)[np.arange(len(line)) + int(row), np.arange(len(line)) + int(column)] = line
        read, pushed = np.zeros((self.motions, n)), np.zeros((n, outputs))
        for b, (row, column, rows, columns, at) in enumerate(np.column_stack(self.rows[1:]).astype(int)):
            part = self.rows.value[at : at + rows * columns].reshape(columns, rows).T
            (read if b < self.sensed else pushed)[row : row + rows, column : column + columns] = part
        return R, S, read, pushed.T


def aligned(x: Array) -> Array:
    """Return a copy that begins at a line of the cache: reads across two lines cost twice."""
    room = np.empty(x.nbytes + LINE, dtype=np.uint8)
    found: Array = room[-room.ctypes.data % LINE :][: x.nbytes].view(x.dtype).reshape(x.shape)
    found[...] = x
    return found


def motions_once(rows: Array) -> tuple[Array, Any]:
    """Return rows without round-off, each once, those on the same modes side by side, and the place of each row."""
    largest = np.abs(rows).max(axis=1, initial=0.0, keepdims=True)
    once, places = np.unique(np.where(np.abs(rows) > NOISE * largest, rows, 0.0), axis=0, return_inverse=True)
    order = np.lexsort(extents(once).T)
    return once[order], np.argsort(order)[places.reshape(-1)]


def joined(feedbacks: Sequence[Feedback], h: float, level: float) -> tuple[Array, Array]:
    """Return states and force of all feedbacks, forces at a level of the step, as matrices of (z0, y0, v)."""
    A, B, C, D = side_by_side(feedbacks)
    (Bd, Bv), (Dd, Dv), g = np.split(B, 2, axis=1), np.split(D, 2, axis=1), level * h
    S = np.linalg.inv(np.eye(len(A)) - g * A)
    middle: Any = np.hstack([S, g * S @ Bd, g * S @ (g * Bd + Bv)])
    kept = np.hstack([np.eye(len(A)), h * Bd, h * (g * Bd + Bv)])
    return kept + h * A @ middle, C @ middle + np.hstack([np.zeros((len(C), len(A))), Dd, g * Dd + Dv])


def feedback_loop(
    law: tuple[Array, Array], rows: Array, answers: Array, G: Array, port: Any
) -> tuple[FeedbackLoop, Array]:
    """Return the arrays of the feedback, and velocities of the ports, then feedback forces, for unit contact forces.

    The law is of `joined`. Given are the rows of motions that feedback senses or acts on, (motions, n), and velocities
    of unit forces, (outputs, n); G, (ports, m + outputs), velocities of the ports for unit forces at contacts, then of
    the feedback; and the port of each input and output.
    """
    states, force = law
    inputs, outputs = len(port) - len(answers), len(answers)
    m, by_speed = G.shape[1] - outputs, force[:, force.shape[1] - inputs :]
    sensed = by_speed @ G[port[:inputs]]
    loop = np.linalg.inv(np.eye(outputs) - sensed[:, m:])
    acted: Array = np.vstack([G[:, m:] @ loop, loop])
    met = np.vstack([G[:, :m], np.zeros((outputs, m))]) + acted @ sensed[:, :m]
    padded = np.pad(acted.T, ((0, 0), (0, -len(acted) % FOURS)))
    return FeedbackLoop(
        *diagonals(force, states), force.shape[1], len(rows), *blocks(rows, answers), aligned(padded), port
    ), met
