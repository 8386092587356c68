"""All feedback of a scene, condensed for one time step.

    f = R (z, y, v),     phi = W f,     u1 = u + G phi,     z1 = S (z, y, v1),

where f are forces of free motions, W the loop through the structure, u velocities of ports, v those that are sensed. R
and S are kept as diagonals, which are few where like states of sections lie side by side, and motions as blocks: forces
on a few modes move these alone, together.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.scene.feedback import Feedback, side_by_side
from gapbeam.solver.system.operators import Array

NOISE = 1e-12  # entry of a row over the largest one: round-off of modes on which a force does not act
LINE = 64  # bytes of a line of the cache
FEW, FOURS = 4, 4  # motions on the same modes from which their reading is a block; ports are padded to a multiple


class MotionBlocks(NamedTuple):
    """A matrix that is 0 but for blocks, whose columns follow each other in `value` from `at` on.

    The others are of (blocks,): row and column of the first entry, and the numbers of rows and columns.
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
    """Return a matrix and the transpose of another one as blocks, and the number of those of the first.

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
    """Return matrices one after the other as diagonals, and the number of those of the first matrix."""
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


def without_noise(rows: Array) -> Array:
    """Return rows without entries that are round-off beside the largest of the row."""
    largest = np.abs(rows).max(axis=1, initial=0.0, keepdims=True)
    return np.where(np.abs(rows) > NOISE * largest, rows, 0.0)


def joined(feedbacks: Sequence[Feedback], h: float, level: float) -> tuple[Array, Array]:
    """Return states and force of all feedbacks, forces at a level of the step, as matrices of (z0, y0, v)."""
    A, B, C, D = side_by_side(feedbacks)
    (Bd, Bv), (Dd, Dv), g = np.split(B, 2, axis=1), np.split(D, 2, axis=1), level * h
    S = np.linalg.inv(np.eye(len(A)) - g * A)
    middle: Any = np.hstack([S, g * S @ Bd, g * S @ (g * Bd + Bv)])
    kept = np.hstack([np.eye(len(A)), h * Bd, h * (g * Bd + Bv)])
    return kept + h * A @ middle, C @ middle + np.hstack([np.zeros((len(C), len(A))), Dd, g * Dd + Dv])


def feedback_loop(
    states: Array, force: Array, rows: Array, answers: Array, G: Array, port: Any
) -> tuple[FeedbackLoop, Array]:
    """Return the arrays of the feedback, and velocities of the ports, then feedback forces, for unit contact forces.

    Given are states and force of `joined`, the rows of motions that feedback senses or acts on, (motions, n), and
    velocities of unit forces, (outputs, n); G, (ports, m + outputs), velocities of the ports for unit forces at
    contacts, then of the feedback; and the port of each input and output.
    """
    inputs, outputs = len(port) - len(answers), len(answers)
    m, by_speed = G.shape[1] - outputs, force[:, force.shape[1] - inputs :]
    sensed = by_speed @ G[port[:inputs]]
    loop = np.linalg.inv(np.eye(outputs) - sensed[:, m:])
    acted: Array = np.vstack([G[:, m:] @ loop, loop])
    met = np.vstack([G[:, :m], np.zeros((outputs, m))]) + acted @ sensed[:, :m]
    padded = np.pad(acted.T, ((0, 0), (0, -len(acted) % FOURS)))
    law, width = diagonals(force, states), force.shape[1]
    return FeedbackLoop(*law, width, len(rows), *blocks(rows, answers), aligned(padded), port), met
