"""Feedback: a linear force with states that follows the motion.

    z' = A z + B u,     F = C z + D u,     u = (displacements, velocities) of `sense`,     F acts at `act`.

The states follow the scheme and are eliminated exactly, so that stability boundaries of the linear system hold at any
step of the midpoint rule. A joint is a feedback without states.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import ArrayLike

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.given_numbers import finite, positive
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.operators import Array

Place = StructurePoint | tuple[StructurePoint, StructurePoint]


def motions_of(place: Place) -> int:
    """Return the number of motions of a point or a pair of points."""
    return len((place[0] if isinstance(place, tuple) else place).rows)


class Feedback:
    """A linear force with n states; see the module.

    Args:
        sense: StructurePoint or pair of points whose displacements and velocities it reads.
        act: StructurePoint or pair of points that its force acts on; equal and opposite on the second of a pair.
        A: (n, n), 1/s; [] without states.
        B: (n, 2 motions of `sense`): displacements first.
        C: (motions of `act`, n).
        D: (motions of `act`, 2 motions of `sense`); default 0.
        name: For messages and paths.

    Raises:
        UserError: A shape does not fit.
    """

    def __init__(
        self, sense: Place, act: Place, A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike | None = None,
        name: str = "",
    ) -> None:  # fmt: skip
        self.sense, self.act, self.name = sense, act, name
        inputs, outputs, where = 2 * motions_of(sense), motions_of(act), f"feedback {name or '?'}"
        self.A = np.atleast_2d(finite(A, where)) if np.size(np.asarray(A)) else np.zeros((0, 0))
        n = len(self.A)
        shapes = {"A": (self.A, (n, n)), "B": (B, (n, inputs)), "C": (C, (outputs, n))}
        shapes |= {} if D is None else {"D": (D, (outputs, inputs))}
        for key, (value, shape) in shapes.items():
            if np.size(np.asarray(value)) != shape[0] * shape[1]:
                raise UserError(f"{where}: found {key} of shape {np.shape(value)}, expected {shape}")
        self.B, self.C = finite(B, where).reshape(n, inputs), finite(C, where).reshape(outputs, n)
        self.D = np.zeros((outputs, inputs)) if D is None else finite(D, where).reshape(outputs, inputs)

    @property
    def points(self) -> tuple[StructurePoint, ...]:
        """All points that it reads or acts on."""
        places = (self.sense, self.act)
        return tuple(point for place in places for point in (place if isinstance(place, tuple) else (place,)))


class Joint(Feedback):
    """A spring and damper between two points, or from a point to the frame; as stiff as you like.

    Args:
        between: A point, or (point, point).
        stiffness: In each motion, N/m.
        damping: In each motion, N s/m.
        name: For messages and paths.

    Raises:
        UserError: A value is negative or not finite.
    """

    def __init__(self, between: Place, stiffness: float, damping: float = 0.0, name: str = "") -> None:
        for value, key in ((stiffness, "stiffness"), (damping, "damping")):
            positive(value, f"joint {name or '?'}: {key}", zero=True)
        unit = np.eye(motions_of(between))
        super().__init__(between, between, [], [], [], np.hstack([-stiffness * unit, -damping * unit]), name)


def memory(
    point: StructurePoint, stiffness: float, damping: float, amplitudes: ArrayLike, rates: ArrayLike, name: str = ""
) -> Feedback:
    """Return the force A (y - sum a_i z_i) - B y' with z_i' = y' - d_i z_i: a memory of decaying exponentials.

    Args:
        point: Of one motion, y.
        stiffness: A, N/m.
        damping: B, N s/m.
        amplitudes: a_i.
        rates: d_i, 1/s.
        name: Of the feedback.
    """
    decay = np.atleast_1d(finite(rates, f"feedback {name or '?'}: rates"))
    read = np.column_stack([np.zeros(len(decay)), np.ones(len(decay))])
    kept = -stiffness * finite(amplitudes, f"feedback {name or '?'}: amplitudes")
    return Feedback(point, point, -np.diag(decay), read, kept, [stiffness, -damping], name)


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
    kept = np.hstack([(1 - 1 / level) * np.eye(len(A)), np.zeros((len(A), 2 * Bd.shape[1]))])
    return middle / level + kept, C @ middle + np.hstack([np.zeros((len(C), len(A))), Dd, g * Dd + Dv])
