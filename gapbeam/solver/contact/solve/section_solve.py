"""The linearized laws of points that share their motions, solved for these motions and not for the forces.

Of c forces on u motions, f = f0 - E z is what the laws give for the motions z, and the balance adds

    z = s D S^T f,    (I + s D S^T E) z = s D S^T f0

with S the share of each motion in the displacement along each force. Where many points of a section touch, u is far
below c.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.contact.solve.elimination import eliminate
from gapbeam.solver.system.operators import Array, Indices

WORTH = 2  # forces for each motion from which it pays


class SharedMotions(NamedTuple):
    """Room for the motions that forces act on.

    Attributes:
        used: Motions that any force acts on, the first u, (b,).
        place: Number of each motion among them, (b,); -1: none.
        number: u, (1,).
        effect: S^T E of these, (b, b), N/m.
        known: S^T f0, (b,), N.
        matrix: Room for the equations, (b, b).
        moved: z, (b,), m.
    """

    used: Indices
    place: Indices
    number: Indices
    effect: Array
    known: Array
    matrix: Array
    moved: Array


def room_for_motions(size: int) -> SharedMotions:
    """Return room for b = `size` motions, which no force acts on."""
    square = (np.zeros((size, size)) for _ in range(2))
    effect, matrix = square
    whole = np.zeros(size, dtype=np.int64)
    return SharedMotions(whole, whole - 1, np.zeros(1, dtype=np.int64), effect, np.zeros(size), matrix, np.zeros(size))


@compiled
def use_none(shared: SharedMotions) -> None:
    """Forget which motions forces act on."""
    for number in range(shared.number[0]):
        shared.place[shared.used[number]] = -1
    shared.number[0] = 0


@compiled
def use(shared: SharedMotions, motion: int) -> None:
    """List a motion, without effects and known forces."""
    if shared.place[motion] < 0:
        count = shared.number[0]
        shared.used[count], shared.place[motion], shared.known[count] = motion, count, 0.0
        for other in range(count + 1):
            shared.effect[count, other], shared.effect[other, count] = 0.0, 0.0
        shared.number[0] = count + 1


@compiled
def find_motions(shared: SharedMotions, compliance: Array, scale: float) -> bool:
    """Solve for z; tell whether that can be.

    Args:
        shared: Effects and known forces; the motions are set.
        compliance: D of all motions, (b, b).
        scale: s.
    """
    count, matrix = shared.number[0], shared.matrix
    for i in range(count):
        row, mine = compliance[shared.used[i]], matrix[i]
        for j in range(count):
            mine[j] = 0.0
        mine[i], total = 1.0, 0.0
        for k in range(count):
            share, effect = scale * row[shared.used[k]], shared.effect[k]
            total += share * shared.known[k]
            for j in range(count):
                mine[j] += share * effect[j]
        shared.moved[i] = total
    return eliminate(matrix, shared.moved, count)
