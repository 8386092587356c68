"""All feedback of a scene, condensed for one time step.

    f = R (z, y, v),     phi = W f,     u1 = u + G phi,     z1 = S (z, y, v1),

where f are forces of free motions, W the loop through the structure, u velocities of ports, v those that are sensed. R
and S are kept as diagonals, which are few where like states of sections lie side by side, and motions as bands: a force
on a few modes moves these alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sl

from gapbeam.solver.scene.feedback import Feedback
from gapbeam.solver.system.operators import Array

NOISE = 1e-12
"""Entry of a row over the largest one: what round-off leaves of modes on which a force does not act."""

LINE = 64
"""Bytes of a line of the cache."""


class Bands(NamedTuple):
    """A matrix whose rows are kept from their first entry to their last.

    Attributes:
        value: Entries, row after row.
        first: (rows,) column of the first entry.
        start: (rows + 1,) where each row begins in `value`.
    """

    value: Array
    first: Any
    start: Any


def bands(*matrices: Array) -> Bands:
    """Return matrices below each other as bands."""
    rows = [row for A in matrices for row in A]
    found = [np.flatnonzero(row) for row in rows]
    ends = [(int(one[0]), int(one[-1]) + 1) if len(one) else (0, 0) for one in found]
    parts = [row[a:b] for row, (a, b) in zip(rows, ends, strict=True)]
    start = np.cumsum([0] + [len(part) for part in parts])
    first = np.array([a for a, _ in ends], dtype=np.uint64)
    return Bands(aligned(np.concatenate([np.zeros(0), *parts])), first, start.astype(np.uint64))


class Diagonals(NamedTuple):
    """A matrix whose diagonals are kept from their first entry to their last.

    Attributes:
        value: Entries, diagonal after diagonal.
        row: (diagonals,) of the first entry.
        column: (diagonals,) of the first entry.
        at: (diagonals + 1,) where each diagonal begins in `value`.
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
        rows: The motions (motions, n), then velocities of unit forces (outputs, n).
        acted: (outputs, ports + outputs): transposes of G W, then W.
        port: (inputs + outputs,) port of each input and output.
    """

    law: Diagonals
    forces: int
    stack: int
    rows: Bands
    acted: Array
    port: Any

    def matrices(self, n: int) -> tuple[Array, Array, Array, Array]:
        """Return R, S, the motions, (motions, n), and velocities of unit forces, (outputs, n), as whole matrices."""
        outputs, law, rows = len(self.acted), self.law, self.rows
        states = self.stack - 2 * (len(self.port) - outputs)
        R, S, kept = np.zeros((outputs, self.stack)), np.zeros((states, self.stack)), np.zeros((len(rows.first), n))
        for k, (row, column) in enumerate(zip(law.row, law.column, strict=True)):
            line = law.value[law.at[k] : law.at[k + 1]]
            (R if k < self.forces else S)[np.arange(len(line)) + int(row), np.arange(len(line)) + int(column)] = line
        for i, first in enumerate(rows.first):
            line = rows.value[rows.start[i] : rows.start[i + 1]]
            kept[i, int(first) :][: len(line)] = line
        return R, S, kept[: len(kept) - outputs], kept[len(kept) - outputs :]


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

    def blocks(name: str) -> Array:
        found: Array = sl.block_diag(*(getattr(one, name) for one in feedbacks)) if feedbacks else np.zeros((0, 0))
        return found

    def half(name: str, which: int) -> Array:
        parts = [np.split(getattr(one, name), 2, axis=1)[which] for one in feedbacks]
        found: Array = sl.block_diag(*parts) if parts else np.zeros((0, 0))
        return found

    A, C, g = blocks("A"), blocks("C"), level * h
    Bd, Bv, Dd, Dv = half("B", 0), half("B", 1), half("D", 0), half("D", 1)
    S = np.linalg.inv(np.eye(len(A)) - g * A)
    middle: Any = np.hstack([S, g * S @ Bd, g * S @ (g * Bd + Bv)])
    kept = np.hstack([np.eye(len(A)), h * Bd, h * (g * Bd + Bv)])
    return kept + h * A @ middle, C @ middle + np.hstack([np.zeros((len(C), len(A))), Dd, g * Dd + Dv])


def feedback_loop(
    states: Array, force: Array, rows: Array, answers: Array, G: Array, port: Any
) -> tuple[FeedbackLoop, Array]:
    """Return the arrays of the feedback, and velocities of the ports, then feedback forces, for unit contact forces.

    Args:
        states: Of `joined`.
        force: Of `joined`.
        rows: Motions that feedback senses or acts on, (motions, n).
        answers: Velocities of unit forces, (outputs, n).
        G: Velocities of the ports for unit forces at contacts, then of the feedback, (ports, m + outputs).
        port: Of each input and output.
    """
    inputs, outputs = len(port) - len(answers), len(answers)
    m, by_speed = G.shape[1] - outputs, force[:, force.shape[1] - inputs :]
    sensed = by_speed @ G[port[:inputs]]
    loop = np.linalg.inv(np.eye(outputs) - sensed[:, m:])
    acted: Array = np.vstack([G[:, m:] @ loop, loop])
    met = np.vstack([G[:, :m], np.zeros((outputs, m))]) + acted @ sensed[:, :m]
    return FeedbackLoop(*diagonals(force, states), force.shape[1], bands(rows, answers), aligned(acted.T), port), met
